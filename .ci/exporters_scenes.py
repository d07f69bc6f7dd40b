"""Makes small scenes in Blender and writes each with the default options of Blender's and trimesh's exporters.
usage: exporters_scenes.py FOLDER. Each scene has a folder; exporters_compare.py sees from its name what to compare."""
import math, os, sys
import bpy, trimesh
from mathutils import Matrix

def put(thing, **fields):
    for key, value in fields.items():
        setattr(thing, key, value)
    return thing

def link(name, data, **fields):
    bpy.context.scene.collection.objects.link(thing := bpy.data.objects.new(name, data))
    return put(thing, **fields)

def mesh(name, vertices, faces, edges=(), **fields):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, edges, faces)
    return link(name, data, **fields)

def added(kind, smooth=False, of={}, **fields):
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**of)
    (bpy.ops.object.shade_smooth if smooth else bpy.ops.object.shade_flat)()
    return put(bpy.context.object, **fields)

def cube(**fields): return added("cube", **fields)
def monkey(**fields): return added("monkey", True, **fields)
def ball(**fields): return added("uv_sphere", True, {"segments": 16, "ring_count": 8}, **fields)
def plane(**fields): return added("grid", False, {"x_subdivisions": 4, "y_subdivisions": 4, "size": 4}, **fields)

def paint(thing, colour=(0.8, 0.8, 0.8), name="paint", **inputs):
    """Appends a material to a thing. Returns what makes nodes, what links them, and the surface's inputs."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"].inputs
    for key, value in {"Base Color": (*colour, 1), "Roughness": 0.6, **inputs}.items():
        surface[key.replace("_", " ")].default_value = value
    thing.data.materials.append(material)
    make = lambda kind, **fields: put(material.node_tree.nodes.new("ShaderNode" + kind), **fields)
    return make, material.node_tree.links.new, surface

def picture(name, value, space="sRGB", side=64):
    """A picture beside the files: value(u, v) is the colour of a texel."""
    image, at = bpy.data.images.new(name, side, side, alpha=True), [(i + 0.5) / side for i in range(side)]
    image.pixels[:] = [channel for v in at for u in at for channel in value(u, v)]
    put(image, filepath_raw=os.path.join(place, name + ".png"), file_format="PNG").save()
    image.colorspace_settings.name = space
    return image

def quarters(u, v):
    return 0.9 if u < 0.5 else 0.2, 0.8 if v < 0.5 else 0.1, 0.3, 1

def studs(u, v):
    x, y = 0.35 * math.sin(2 * math.pi * u), 0.35 * math.sin(4 * math.pi * v)
    return 0.5 + x / 2, 0.5 + y / 2, 0.5 + math.sqrt(1 - x * x - y * y) / 2, 1

def textured(thing, image=None, into="Base Color", **fields):
    make, join, surface = paint(thing, **fields)
    node = make("TexImage", image=image or picture("colour", quarters))
    join(node.outputs[0], surface[into])
    return node, make, join, surface

def lamp(kind, energy, **fields):
    for thing in (plane(), cube(location=(0.3, 0.6, 0.3), scale=(0.3, 0.3, 0.3))):
        paint(thing, (0.7, 0.5, 0.3), Specular_IOR_Level=0, Roughness=1)
    data = put(bpy.data.lights.new(kind, kind), energy=energy, **fields)
    link(kind, data, location=(0.3, 0.2, 3), rotation_euler=(0.2, 0.1, 0))

def view(kind, width=1920, height=1080, **fields):
    put(bpy.context.scene.render, resolution_x=width, resolution_y=height)
    for x in (-1.5, 1.5):
        paint(cube(location=(x, 0, 0)), (0.5, 0.25 + x / 8, 0.3))
    data = put(bpy.data.cameras.new("eye"), type=kind, **fields)
    link("eye", data, location=(3, -6, 3), rotation_euler=(1.15, 0, 0.46))

class Scenes:
    def texture_colour(): textured(monkey())
    def emission_texture(): textured(cube(), into="Emission Color", Emission_Strength=3)
    def names_Möbel_à_la_carte(): textured(cube(name="Stuhl 1/ä"), picture("Bild ü 50%", quarters), name="Lack #2")
    def alpha_blend(): paint(plane(), (0.2, 0.6, 0.3), Alpha=0.5)
    def shading_smooth(): paint(monkey(), (0.3, 0.5, 0.7))
    def shading_flat(): added("ico_sphere", of={"subdivisions": 2})
    def glass(): paint(ball(), (0.9, 0.5, 0.5), Transmission_Weight=1, Roughness=0)
    def coats(): paint(ball(), (0.5, 0.1, 0.1), Coat_Weight=1, Sheen_Weight=0.5, Specular_Tint=(1, 0.5, 0.2, 1))
    def lamp_point(): lamp("POINT", 300, shadow_soft_size=0, color=(1, 0.7, 0.4))
    def lamp_spot_sharp(): lamp("SPOT", 400, shadow_soft_size=0, spot_size=0.8, spot_blend=0)
    def lamp_spot_blended(): lamp("SPOT", 400, shadow_soft_size=0, spot_size=1.2, spot_blend=0.5)
    def lamp_sun(): lamp("SUN", 3, angle=0)
    def lamp_area(): lamp("AREA", 100)
    def camera_perspective(): view("PERSP", lens=40, shift_x=0.1)
    def camera_portrait(): view("PERSP", 480, 640, sensor_fit="VERTICAL", lens=30)
    def camera_orthographic(): view("ORTHO", ortho_scale=7)
    def texture_placed():
        image, make, join, _ = textured(plane())
        join(make("UVMap", uv_map="UVMap").outputs[0], (mapping := make("Mapping")).inputs[0])
        for key, value in (("Scale", (2, 3, 1)), ("Location", (0.25, 0.1, 0)), ("Rotation", (0, 0, 0.5))):
            mapping.inputs[key].default_value = value
        join(mapping.outputs[0], image.inputs[0])
    def texture_second_uv():
        thing = plane()
        for corner in thing.data.uv_layers.new(name="other").data:
            corner.uv = (corner.uv[1] * 2, corner.uv[0] * 0.5)
        image, make, join, _ = textured(thing)
        image.extension = "EXTEND"
        join(make("UVMap", uv_map="other").outputs[0], image.inputs[0])
    def texture_normal():
        image, make, join, surface = textured(ball(), picture("studs", studs, "Non-Color"), "Normal")
        join(image.outputs[0], (relief := make("NormalMap")).inputs["Color"])
        join(relief.outputs[0], surface["Normal"])
    def shine_roughness():
        rough = picture("rough", lambda u, v: (0, 0.35 + 0.5 * u, round(v), 1), "Non-Color")
        image, make, join, surface = textured(plane(), rough, "Roughness")
        join(image.outputs[0], (split := make("SeparateColor")).inputs[0])
        join(split.outputs[1], surface["Roughness"])
        join(split.outputs[2], surface["Metallic"])
    def shine_factors():
        for i in range(4):
            paint(ball(location=(i * 2.2, 0, 0)), (0.7, 0.5, 0.2), Metallic=i // 2, Roughness=0.3 + i % 2 * 0.5)
    def alpha_cut_out():
        holes = picture("holes", lambda u, v: (u, v, 0.5, (u - 0.5) ** 2 + (v - 0.5) ** 2 < 0.1))
        image, make, join, surface = textured(plane(), holes)
        join(image.outputs[1], (cut := make("Math", operation="GREATER_THAN")).inputs[0])
        join(cut.outputs[0], surface["Alpha"])
    def vertex_colours():
        thing = monkey()
        colours = thing.data.color_attributes.new("Col", "BYTE_COLOR", "CORNER").data
        for corner, colour in zip(thing.data.loops, colours):
            colour.color = (*(0.5 + x / 4 for x in thing.data.vertices[corner.vertex_index].co), 1)
        make, join, surface = paint(thing)
        join(make("VertexColor", layer_name="Col").outputs[0], surface["Base Color"])
    def vertex_colours_float():
        data = plane().data
        for vertex, colour in zip(data.vertices, data.color_attributes.new("Farbe", "FLOAT_COLOR", "POINT").data):
            colour.color = (0.5 + vertex.co[0] / 8, 0.05, 0.5 + vertex.co[1] / 8, 1)
    def shading_sharp_edges():
        added("cylinder", of={"vertices": 12})
        bpy.ops.object.shade_smooth_by_angle(angle=0.9)
    def normals_custom():
        data = cube().data
        data.normals_split_custom_set([(p.normal * 2 + data.vertices[v].co.normalized()).normalized()
                                       for p in data.polygons for v in p.vertices])
    def normals_negative_zero():
        thing = plane(rotation_euler=(math.pi, 0, 0))
        thing.data.normals_split_custom_set([(-0.0, -0.0, 1.0)] * len(thing.data.loops))
        paint(thing)
    def several_materials():
        thing = cube()
        for i in range(3):
            paint(thing, (0.2 + 0.3 * i, 0.5, 0.8 - 0.3 * i))
            thing.data.polygons[i].material_index = thing.data.polygons[i + 3].material_index = i
    def parented_scaled():
        parent = cube(scale=(2, 0.5, 1), rotation_euler=(0.3, 0.2, 0.5))
        child = ball(location=(0, 0, 2.5), rotation_euler=(0.6, 0.4, 0), scale=(0.5, 1, 1.2), parent=parent)
        child = cube(location=(1, 1, 4), scale=(0.3, 0.3, 0.3), parent=child)
        child.matrix_parent_inverse = Matrix.Translation((0.5, 0, 0))
    def instances():
        inside = bpy.data.collections.new("inside")
        paint(thing := monkey(), (0.6, 0.3, 0.2))
        bpy.context.scene.collection.objects.unlink(thing), inside.objects.link(thing)
        for x in (-2, 2):
            link("place", None, location=(x, 0, 0), rotation_euler=(0, 0, x / 3), scale=(1, 1 + x / 8, 1),
                 instance_type="COLLECTION", instance_collection=inside)
        link("twin", thing.data, location=(0, 2, 0))
    def armature_two_actions():
        thing = added("cylinder", of={"radius": 0.5, "depth": 4, "location": (0, 0, 2)})
        bones = link("bones", bpy.data.armatures.new("bones"))
        bpy.context.view_layer.objects.active = bones
        bpy.ops.object.mode_set(mode="EDIT")
        for i in range(2):
            put(bones.data.edit_bones.new(f"bone {i}"), head=(0, 0, 2 * i), tail=(0, 0, 2 * i + 2))
        bones.data.edit_bones["bone 1"].parent = bones.data.edit_bones["bone 0"]
        bpy.ops.object.mode_set(mode="OBJECT")
        thing.modifiers.new("bones", "ARMATURE").object = thing.parent = bones
        for i in range(2):
            members = [v.index for v in thing.data.vertices if (v.co.z > 0) == bool(i)]
            thing.vertex_groups.new(name=f"bone {i}").add(members, 1, "ADD")
        bone = put(bones.pose.bones["bone 1"], rotation_mode="XYZ")
        for name, angle in (("nod", 0.7), ("sway", -0.4)):
            bones.animation_data_create().action = put(bpy.data.actions.new(name), use_fake_user=True)
            for frame, turn in ((25, angle), (1, 0)):
                put(bone, rotation_euler=(turn, 0, 0)).keyframe_insert("rotation_euler", frame=frame)
    def shape_keys():
        thing = ball()
        thing.shape_key_add(name="Basis")
        for name, axis in (("long", 2), ("wide", 0)):
            key = put(thing.shape_key_add(name=name), value=0.4)
            for point in key.data:
                point.co[axis] *= 2
    def moving():
        for x in (-2, 2):
            thing = monkey(location=(x, 0, 0))
            for frame, angle in ((25, x), (1, 0)):
                put(thing, rotation_euler=(0, 0, angle), location=(x, angle, 0))
                thing.keyframe_insert("rotation_euler", frame=frame), thing.keyframe_insert("location", frame=frame)
    def glass_volume():
        make, join, _ = paint(ball(), (1, 1, 1), Transmission_Weight=1, Roughness=0, IOR=1.33)
        output = bpy.data.materials[0].node_tree.nodes["Material Output"]
        join(make("VolumeAbsorption").outputs[0], output.inputs["Volume"])
        group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
        group.interface.new_socket("Thickness", socket_type="NodeSocketFloat")
        make("Group", node_tree=group).inputs[0].default_value = 0.5
    def units_and_world():
        bpy.context.scene.unit_settings.scale_length = 0.01
        world = bpy.context.scene.world = put(bpy.data.worlds.new("world"), use_nodes=True)
        world.node_tree.nodes["Background"].inputs[0].default_value = (0.3, 0.6, 1, 1)
        paint(monkey(scale=(100, 100, 100)), (0.4, 0.4, 0.7))
    def far_away():
        paint(monkey(location=(1e6, -1e6, 1e6), scale=(100, 100, 100)), (0.5, 0.7, 0.2))
        cube(location=(1e6 + 200, -1e6, 1e6), scale=(50, 50, 50))
    def mirrored():
        paint(monkey(scale=(-1, 1, 1)), (0.7, 0.4, 0.4))
        paint(ball(scale=(1, 1, -0.5), location=(2.5, 0, 0)), (0.4, 0.4, 0.7))
        for material in bpy.data.materials:
            material.use_backface_culling = True
    def empty_and_loose():
        mesh("empty", [], [])
        mesh("points", [(0, 0, 2), (1, 0, 2)], [])
        mesh("edges", [(0, 0, 0), (0, 0, 2)], [], [(0, 1)], location=(2, 0, 0))
        mesh("mixed", [(-2, 0, 0), (-1, 0, 0), (-1, 2, 0), (-2, 2, 0), (-2, 0, 2)], [(0, 1, 2, 3)], [(0, 4)])
        cube().data.materials.append(None)
    def ngon_concave():
        mesh("U", [(x, y, 0) for x, y in zip((0, 3, 3, 2, 2, 1, 1, 0), (0, 0, 3, 3, 1, 1, 3, 3))], [range(8)])
    def ngon_bent():
        mesh("bent", [(math.cos(i * 0.7854), math.sin(i * 0.7854), 0.1 * (i % 2)) for i in range(8)], [range(8)])
        mesh("saddle", [(2, -1, 0), (4, -1, 0.5), (4, 1, 0), (2, 1, 0.5)], [(0, 1, 2, 3)])
    def degenerate():
        mesh("flat", [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 2, 0), (2, 2, 0)], [(0, 1, 2), (0, 2, 4, 3), (1, 2, 0)])

for name, make in list(vars(Scenes).items()):
    if name.startswith("_"):
        continue
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.preferences.addons["io_scene_gltf2"].preferences.allow_embedded_format = True
    place = os.path.join(sys.argv[1], name.replace("_", " ") if name.startswith("names") else name)
    for inside in ("apart", "trimesh"):
        os.makedirs(os.path.join(place, inside))
    make()
    base, camera, light = os.path.join(place, "blender"), name.startswith("camera"), name.startswith("lamp")
    bpy.ops.export_scene.gltf(filepath=base + ".glb", export_cameras=camera, export_lights=light)
    if camera or light or name == "moving":
        continue
    bpy.ops.export_scene.gltf(filepath=base + ".gltf", export_format="GLTF_EMBEDDED")
    bpy.ops.export_scene.gltf(filepath=os.path.join(place, "apart", "blender.gltf"), export_format="GLTF_SEPARATE")
    bpy.ops.wm.obj_export(filepath=base + ".obj")
    bpy.ops.wm.ply_export(filepath=base + ".ply")
    bpy.ops.wm.ply_export(filepath=base + ".ascii.ply", ascii_format=True)
    bpy.ops.wm.stl_export(filepath=base + ".stl")
    loaded = trimesh.load(base + ".glb")
    for ending in ("glb", "obj", "ply", "stl"):
        try:
            whole = loaded if ending in ("glb", "obj") else loaded.to_geometry()
            whole.export(os.path.join(place, "trimesh", "trimesh." + ending))
        except Exception as error:
            print(f"trimesh cannot write {name} as {ending}: {error}", file=sys.stderr)
