"""Shows files with rayfront and, as Blender imports them, with Cycles, and compares what the camera sees first.
usage: exporters_compare.py PROGRAM FOLDER [PART OF A PATH]. Prints a line for each file, and one of counts."""
import glob, json, math, os, subprocess, sys
import bpy, numpy as np, OpenEXR
from mathutils import Matrix, Vector

program, folder, part = (sys.argv[1:] + [""])[:3]
lines = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Blender speaks there.
FROM_Y_UP = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
IMPORT = {".glb": bpy.ops.import_scene.gltf, ".gltf": bpy.ops.import_scene.gltf, ".obj": bpy.ops.wm.obj_import,
          ".ply": bpy.ops.wm.ply_import, ".stl": bpy.ops.wm.stl_import}
# Further comparisons and other ways to compare, by the beginning of a scene's name.
KINDS = {"lamp": "light", "three_lamps": "light", "lamp_spot_blended": "soft", "camera": "camera", "shine": "shine",
         "emission": "emission", "moving": "moving", "three_unlit": "unlit", "ngon_bent": "bent"}

def layers(path):
    """The channels of an EXR file by their names: those of Blender without the name of the view layer."""
    with OpenEXR.File(path, separate_channels=True) as file:
        return {name.removeprefix("ViewLayer."): c.pixels.astype(float) for name, c in file.channels().items()}

def colour(channels, name, ends="RGB"):
    return np.stack([channels[name + end] for end in ends], axis=-1)

def matte(material, kind, kinds):
    """Leaves of a material what the passes show: colour, cut-outs, normals, what it emits, and missing backs."""
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
    for node in [n for n in nodes if n.type == "BSDF_PRINCIPLED" and "shine" not in kinds]:
        for name in ("Metallic", "Transmission Weight", "Specular IOR Level", "Coat Weight", "Sheen Weight"):
            for old in list(node.inputs[name].links):
                material.node_tree.links.remove(old)
            node.inputs[name].default_value = 0
        base = node.inputs["Base Color"]
        # rayfront cuts out what the alpha of an OBJ file's picture says; Blender needs a map_d for this.
        if kind == ".obj" and base.links and base.links[0].from_node.type == "TEX_IMAGE":
            link(base.links[0].from_node.outputs["Alpha"], node.inputs["Alpha"])
        # Blender drops the colour (Kd) that an OBJ file's picture is multiplied by; 0.8 means that there is none.
        if kind == ".obj" and base.links and not np.allclose(base.default_value[:3], 0.8):
            product = nodes.new("ShaderNodeVectorMath")
            product.operation, product.inputs[1].default_value = "MULTIPLY", base.default_value[:3]
            link(base.links[0].from_socket, product.inputs[0])
            link(product.outputs[0], base)
    for inside in list(output.inputs["Volume"].links):
        material.node_tree.links.remove(inside)
    if material.use_backface_culling:
        back, clear, mix = (nodes.new("ShaderNode" + n) for n in ("NewGeometry", "BsdfTransparent", "MixShader"))
        link(back.outputs["Backfacing"], mix.inputs[0])
        link(output.inputs["Surface"].links[0].from_socket, mix.inputs[1])
        link(clear.outputs[0], mix.inputs[2])
        link(mix.outputs[0], output.inputs["Surface"])

def bare(data, gltf):
    """A material for a mesh that has none: its colours, or the format's default."""
    material = bpy.data.materials.new("bare")
    material.use_nodes, material.use_backface_culling = True, gltf
    base = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    base.default_value = (1, 1, 1, 1) if gltf else (0.8, 0.8, 0.8, 1)
    if data.color_attributes:
        node = material.node_tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = data.color_attributes[0].name
        material.node_tree.links.new(node.outputs[0], base)
    return material

def linked(name, data):
    bpy.context.scene.collection.objects.link(thing := bpy.data.objects.new(name, data))
    return thing

def samples(path):
    return 256 if "three_lamps" in path else 32  # Each sample is lit by one of the lamps.

def reference(path, kinds):
    """Imports a file and renders it. Returns the size, the camera's place (None for the file's own) and passes."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    kind = os.path.splitext(path)[1]
    IMPORT[kind](filepath=path)
    scene = bpy.context.scene
    scene.frame_set(0)
    for image in bpy.data.images if kind == ".obj" else ():
        image.alpha_mode = "CHANNEL_PACKED"
    for data in bpy.data.meshes:
        if not any(data.materials):
            data.materials.clear()
            data.materials.append(bare(data, kind in (".glb", ".gltf")))
    for material in bpy.data.materials:
        if material.use_nodes:
            matte(material, kind, kinds)
    if "moving" in kinds:
        for animated in [o.animation_data for o in scene.objects if o.animation_data]:
            animated.action = None
            for track in animated.nla_tracks:
                track.mute = False
        scene.frame_set(12)
    corners = np.array([i.matrix_world @ Vector(c) for i in bpy.context.evaluated_depsgraph_get().object_instances
                        if i.object.type == "MESH" and i.object.data.vertices for c in i.object.bound_box])
    low, high = corners.min(0), corners.max(0)
    radius = max(np.linalg.norm(high - low) / 2, 1e-6)
    camera, place = next((o for o in scene.objects if o.type == "CAMERA" and "camera" in kinds), None), None
    if camera is None:
        camera, away = linked("eye", bpy.data.cameras.new("eye")), Vector((0.5, -0.8, 0.9)).normalized()
        camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(40)
        camera.data.clip_start, camera.data.clip_end = radius / 100, radius * 100
        place = Matrix.Translation(Vector((low + high) / 2) + away * radius / math.sin(math.radians(20))) @ \
            away.to_track_quat("Z", "Y").to_matrix().to_4x4()
        camera.matrix_world = place
    if "shine" in kinds:
        sun = linked("sun", bpy.data.lights.new("sun", "SUN"))
        sun.data.energy, sun.data.angle = 3, 0
    scene.camera = camera
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    render.engine, render.film_transparent, render.threads_mode, render.threads = "CYCLES", True, "FIXED", 1
    size = (64, 64) if place else (48, 64) if "portrait" in path else (96, 54)
    (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
    cycles.samples, cycles.max_bounces = samples(path), 0
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    layer.use_pass_normal = layer.use_pass_z = layer.use_pass_diffuse_color = layer.use_pass_emit = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    render.filepath = path + ".blender.exr"
    bpy.ops.render.render(write_still=True)
    return size, place, layers(render.filepath)

def shown(path, size, camera, kinds, z_up):
    """Renders a file with rayfront. Returns its layers (None if it refuses) and what it says."""
    base, model = path + ".rayfront", json.dumps(os.path.basename(path), ensure_ascii=False)
    entities = [f"(gltf: {model})" if path.endswith(("glb", "gltf")) else f"(shape: Mesh({model}))"]
    options = ["--time", "0.5"] if "moving" in kinds else ["--light-units", "watt"] if "three" in path else []
    if camera is not None:
        rows = [tuple(row) for row in (camera if z_up else FROM_Y_UP.inverted() @ camera)[:3]]
        entities.append(f'(name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: Matrix({tuple(rows)}))')
        options += ["--camera", "eye"]
    if "shine" in kinds:
        entities.append("(light: Directional(irradiance: 3), transform: (rotate_degrees: (-90, 0, 0)))")
    elif not kinds & {"light", "soft", "emission"}:
        entities.append("(light: Environment(radiance: 0.5))")
    settings = f"size: {size}, samples: {2 * samples(path)}, transport: Path, sharing: Off, max_depth: 1, " \
        "caustics: Off, filter: Tent(radius: 0.01), aov: [Depth, Normal, Albedo, Coverage]"
    with open(base + ".ron", "w", encoding="utf-8") as file:
        file.write(f"(settings: ({settings}), entities: [{', '.join(entities)}])")
    run = subprocess.run([program, base + ".ron", "-o", base + ".exr", "--json", "--threads", "1", *options],
                         capture_output=True, text=True, timeout=60)
    said = [s for s in dict.fromkeys(run.stderr.splitlines()) if s and not s.startswith(("Progress", "render"))]
    return layers(base + ".exr") if run.returncode == 0 else None, said

def differences(ours, theirs, kinds, z_up, loose):
    """The share of pixels, in percent, that differ beyond a tolerance, by what differs, and the share compared."""
    here, there = ours["coverage.A"], theirs["Combined.A"]
    depth, true_depth = ours["depth.Z"], np.where(there > 0.01, theirs["Depth.Z"], 0)
    turned = colour(ours, "normal.", "XYZ") @ (np.eye(3) if z_up else np.array(FROM_Y_UP.to_3x3()).T)
    normal, true_normal = (n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-9)
                           for n in (turned, colour(theirs, "Normal.", "XYZ")))
    albedo = colour(ours, "albedo.")
    true_albedo = colour(theirs, "DiffCol.") / np.maximum(there, 1e-3)[..., None]
    true_albedo += colour(theirs, "Emit.") if "unlit" in kinds else 0
    light, true_light = colour(ours, ""), colour(theirs, "Emit." if "emission" in kinds else "Combined.")
    # What changes from a pixel to the next is an edge, where the renderers may differ.
    edge = np.zeros(there.shape, bool)
    for value, step in ((there, 0.3), (true_depth / max(true_depth.max(), 1e-9), 0.05), (true_normal, 0.35),
                        (true_albedo / max(true_albedo.max(), 1e-9), 0.05),
                        (true_light / max(true_light.max(), 1e-9), 0.05 if "emission" in kinds else 9)):
        for axis, by in ((0, 1), (0, -1), (1, 1), (1, -1)):
            jump = np.abs(np.roll(value, by, axis) - value)
            edge |= (jump.max(-1) if jump.ndim == 3 else jump) > step
    inner = (there > 0.01) & (here > 0.01) & ~edge
    angle = np.degrees(np.arccos(np.clip((normal * true_normal).sum(-1), -1, 1)))
    bad = {"coverage": (np.abs(here - there) > 0.2) & ~edge,
           "depth": inner & (np.abs(depth - true_depth) > (0.02 if loose else 0.003) * true_depth)}
    bad["normal"] = inner & (angle > (90 if "bent" in kinds else 12 if loose else 4))
    limit = 9 if "shine" in kinds else 0.06 if loose else 0.03
    bad["albedo"] = inner & (np.abs(albedo - true_albedo) > limit).any(-1)
    if "soft" in kinds:  # A soft cone fades by another law in Blender: what is compared is where it is brightest.
        bad["light"] = inner & (abs(light.max() / true_light.max() - 1) > 0.06)
    elif kinds & {"light", "shine", "emission"}:
        limit = (0.25 if "shine" in kinds else 0.06) * (true_light + 0.1 * true_light.max())
        bad["light"] = inner & (np.abs(light - true_light) > limit).any(-1)
    whole = ((there > 0.01) | (here > 0.01)).sum() or 1
    return {name: 100 * mask.sum() / whole for name, mask in bad.items()}, 100 * inner.sum() / whole

def compare(path, name):
    kinds = {kind for start, kind in KINDS.items() if name.startswith(start)}
    kinds -= {"light"} if "soft" in kinds else set() if path.endswith(("glb", "gltf")) else {"shine"}
    z_up, packed = path.endswith(("ply", "stl")), ".packed" in path
    try:
        size, camera, theirs = reference(path.split(".packed")[0] + ".glb" if packed else path, kinds)
    except Exception as error:
        return "NO REFERENCE", str(error).strip().splitlines()[-1], []
    ours, said = shown(path, size, camera, kinds, z_up)
    if ours is None:
        return "REFUSED", " / ".join(said), []
    shares, inner = differences(ours, theirs, kinds, z_up, packed or "bent" in kinds)
    figures = " ".join(f"{key} {share:.1f}%" for key, share in shares.items() if share > 1)
    return "DIFFERS" if figures else "ok", figures or f"{inner:.0f}% compared", said

counts = dict.fromkeys(("ok", "DIFFERS", "REFUSED"), 0)
for path in sorted(glob.glob(os.path.join(folder, "**", "*.*"), recursive=True)):
    if path.endswith(tuple(IMPORT)) and part in path:
        verdict, figures, said = compare(path, name := os.path.relpath(path, folder))
        counts[verdict] = counts.get(verdict, 0) + 1
        print(f"{verdict:8} {name}: {figures}", *("    " + line for line in said), sep="\n", file=lines, flush=True)
print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()), file=lines, flush=True)
sys.exit(counts["ok"] < sum(counts.values()))
