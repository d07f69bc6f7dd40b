# SPDX-License-Identifier: MIT OR Apache-2.0
"""The scenes of `test_blender.py`, made anew for each picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from mathutils import Vector


def fresh(size: tuple[int, int]) -> Any:
    """An empty scene, and Cycles without anything that would be a bias."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.rayfront")
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.view_settings.view_transform = "Standard"
    cycles = scene.cycles
    cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", False, False
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = cycles.blur_glossy = 0
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(cycles, f"{kind}_bounces", 12)
    return scene


def link(ob: Any) -> Any:
    bpy.context.collection.objects.link(ob)
    return ob


def aim(ob: Any, at: tuple, to: tuple) -> None:
    ob.location = at
    ob.rotation_euler = (Vector(to) - Vector(at)).to_track_quat("-Z", "Y").to_euler()


def lamp(kind: str, at: tuple, to: tuple = (0, 0, 0), **fields: Any) -> Any:
    data = bpy.data.lights.new(kind.lower(), kind)
    for name, value in fields.items():
        setattr(data, name, value)
    ob = link(bpy.data.objects.new(kind.lower(), data))
    aim(ob, at, to)
    return ob


def camera(at: tuple, to: tuple, **fields: Any) -> Any:
    data = bpy.data.cameras.new("camera")
    for name, value in fields.items():
        setattr(data, name, value)
    ob = link(bpy.data.objects.new("camera", data))
    aim(ob, at, to)
    bpy.context.scene.camera = ob
    return ob


def focus(ob: Any, distance: float, **fields: Any) -> None:
    dof = ob.data.dof
    dof.use_dof, dof.focus_distance = True, distance
    for name, value in fields.items():
        setattr(dof, name, value)


def material(name: str, **inputs: Any) -> Any:
    """A Principled BSDF; `Base_Color` is the input Base Color."""
    found = bpy.data.materials.new(name)
    found.use_nodes = True
    for key, value in inputs.items():
        socket = shader(found).inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1) if socket.type == "RGBA" else value
    return found


def shader(material: Any) -> Any:
    return material.node_tree.nodes["Principled BSDF"]


def node(material: Any, kind: str, to: Any = None, out: str | int = 0, **inputs: Any) -> Any:
    """Adds a node to a material, and links an output of it."""
    found = material.node_tree.nodes.new(kind)
    for key, value in inputs.items():
        found.inputs[key.replace("_", " ")].default_value = value
    if to is not None:
        material.node_tree.links.new(found.outputs[out], to)
    return found


def geometry(name: str, *kinds: str) -> list[Any]:
    """A tree of geometry nodes: the nodes of its input and output, and one of each kind."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    return [tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", *kinds)]


def group(tree: Any, kind: str, to: Any, **free: Any) -> Any:
    """Adds a group with one node to a tree, and links its output. Inputs of the node in `free` are the group's."""
    inner, outer = bpy.data.node_groups.new(kind, "ShaderNodeTree"), tree.nodes.new("ShaderNodeGroup")
    first, found, last = (inner.nodes.new(name) for name in ("NodeGroupInput", kind, "NodeGroupOutput"))
    sockets = {"RGBA": "Color", "VALUE": "Float", "VECTOR": "Vector", "SHADER": "Shader"}
    for name, of in [(None, found.outputs[0]), *((key, found.inputs[key.replace("_", " ")]) for key in free)]:
        direction, kind_of = "INPUT" if name else "OUTPUT", f"NodeSocket{sockets[of.type]}"
        inner.interface.new_socket(of.name, in_out=direction, socket_type=kind_of)
        inner.links.new(*((first.outputs[of.name], of) if name else (of, last.inputs[of.name])))
    outer.node_tree = inner
    for key, value in free.items():
        if value is not None:
            outer.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(outer.outputs[0], to)
    return outer


def surface(material: Any, kind: str, **inputs: Any) -> Any:
    """Replaces the shader of a material."""
    return node(material, kind, material.node_tree.nodes["Material Output"].inputs["Surface"], **inputs)


def picture(name: str, size: tuple[int, int], function: Callable, **fields: Any) -> Any:
    image = bpy.data.images.new(name, *size, **fields)
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    rgba = np.ones((size[1], size[0], 4), np.float32)
    rgba[..., :3] = function((x + 0.5) / size[0], (y + 0.5) / size[1])
    image.pixels.foreach_set(rgba.ravel())
    return image


def checker(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.where((((u * 8).astype(int) + (v * 8).astype(int)) % 2)[..., None], (0.85, 0.8, 0.7), (0.1, 0.15, 0.3))


def plane(at: tuple, size: float, of: Any, turn: tuple = (0, 0, 0)) -> Any:
    bpy.ops.mesh.primitive_plane_add(size=size, location=at, rotation=turn)
    bpy.context.object.data.materials.append(of)
    return bpy.context.object


def ball(at: tuple, of: Any, radius: float = 0.5) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=radius, location=at)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(of)
    return bpy.context.object


def world(color: tuple) -> Any:
    found = bpy.data.worlds.new("world")
    bpy.context.scene.world = found
    found.use_nodes = True
    found.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1)
    return found


def panorama(strength: float = 1.0, turn: float = 0.0) -> None:
    """A sky with a soft, bright window, turned about +Z."""

    def light(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        window = np.exp(-(((u - 0.3) / 0.08) ** 2) - ((v - 0.75) / 0.1) ** 2)
        return 0.3 + 0.3 * v[..., None] * (0.6, 0.8, 1.0) + window[..., None] * (9.0, 7.0, 4.0)

    image = picture("sky", (128, 64), light, float_buffer=True, is_data=True)
    found = world((0, 0, 0))
    nodes, links = found.node_tree.nodes, found.node_tree.links
    texture, mapping, coordinates = (
        nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord")
    )
    texture.image = image
    mapping.inputs["Rotation"].default_value[2] = turn
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    nodes["Background"].inputs["Strength"].default_value = strength


def lamps(size: tuple[int, int], *kinds: str) -> Any:
    """Lamps over white matte things in grey surroundings."""
    scene = fresh(size)
    world((0.05, 0.05, 0.06))
    white = material("white", Base_Color=(0.7, 0.7, 0.7), Roughness=1.0, Specular_IOR_Level=0.0)
    plane((0, 0, 0), 12, white)
    plane((0, 3, 3), 12, white, (math.radians(90), 0, 0))
    for x in (-2, 0, 2):
        ball((x, 0, 0.5), white)
    if "POINT" in kinds:
        lamp("POINT", (-3, -1, 2), energy=120, shadow_soft_size=0.15, color=(1, 0.6, 0.4))
    if "SUN" in kinds:
        lamp("SUN", (4, -6, 7), energy=0.8, angle=math.radians(4), color=(1, 0.95, 0.8))
    if "AREA" in kinds:
        area = lamp(
            "AREA", (2.5, -1, 3), (1, 0, 0), energy=90, shape="RECTANGLE", size=1.2, size_y=0.5, color=(0.5, 0.7, 1)
        )
        area.scale = (1.5, 1, 1)
    if "SPOT" in kinds:
        lamp("SPOT", (0, -3, 3.5), energy=300, spot_size=math.radians(40), spot_blend=0.4, shadow_soft_size=0.3)
    camera((0, -8, 3), (0, 0, 0.9), lens=45)
    return scene


def mirrors(resolution: tuple[int, int], kind: str, **fields: Any) -> Any:
    """Smooth and hardly rough metal, glass and lacquer below a lamp, which is seen in them."""
    scene = fresh(resolution)
    world((0.05, 0.05, 0.05))
    plane((0, 0, 0), 12, material("grey", Base_Color=(0.1, 0.1, 0.1), Roughness=1.0, Specular_IOR_Level=0.0))
    for x, of in (
        (-2.4, {"Metallic": 1.0, "Roughness": 0.0}),
        (-1.2, {"Metallic": 1.0, "Roughness": 0.02}),
        (0.0, {"Metallic": 1.0, "Roughness": 0.1}),
        (1.2, {"Base_Color": (1, 1, 1), "Roughness": 0.0, "Transmission_Weight": 1.0, "IOR": 1.45}),
        (2.4, {"Base_Color": (0.1, 0.1, 0.5), "Roughness": 0.6, "Coat_Weight": 1.0, "Coat_Roughness": 0.0}),
    ):
        ball((x, 0, 0.55), material("of", **of), 0.55)
    lamp(kind, (-1, -3, 3.5), (0, 0, 0.5), **fields)
    camera((0, -8, 2.5), (0, 0, 0.5), lens=50)
    return scene


def subsurface(weight: float, scale: float, anisotropy: float = 0.0) -> Any:
    """A ball in the sun, and nothing else."""
    scene = fresh((64, 64))
    world((0, 0, 0))
    inputs = {"Base_Color": (0.8, 0.5, 0.3), "Roughness": 1.0, "Specular_IOR_Level": 0.0}
    inputs |= {"Subsurface_Weight": weight, "Subsurface_Radius": (1.0, 0.4, 0.2), "Subsurface_Scale": scale}
    inputs["Subsurface_Anisotropy"] = anisotropy
    ball((0, 0, 0.7), material("skin", **inputs), 0.7)
    lamp("SUN", (-2, -4, 3), (0, 0, 0.7), energy=3, angle=math.radians(3))
    camera((0, -5, 1.6), (0, 0, 0.65), lens=90)
    return scene


def catcher(size: tuple[int, int]) -> Any:
    """A ball on a shadow catcher, on a transparent film, in the sun and in the light of a blue area."""
    scene = fresh(size)
    world((0.3, 0.3, 0.3))
    white = material("white", Base_Color=(0.7, 0.7, 0.7), Roughness=1.0, Specular_IOR_Level=0.0)
    plane((0, 0, 0), 8, white).is_shadow_catcher = True
    ball((0, 0, 0.8), material("red", Base_Color=(0.7, 0.1, 0.1), Roughness=1.0, Specular_IOR_Level=0.0), 0.8)
    lamp("SUN", (4, -2, 7), energy=1.5, angle=math.radians(4))
    lamp("AREA", (-3, -1, 3), energy=120, size=1.0, color=(0.5, 0.7, 1))
    camera((0, -7, 3), (0, 0, 0.7), lens=45)
    scene.render.film_transparent = True
    return scene


def sky(size: tuple[int, int], strength: float, **fields: Any) -> Any:
    """A ball of plaster and one of gold under a Sky Texture."""
    scene = fresh(size)
    nodes = world((0, 0, 0)).node_tree.nodes
    texture = nodes.new("ShaderNodeTexSky")
    for name, value in fields.items():
        setattr(texture, name, value)
    scene.world.node_tree.links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    nodes["Background"].inputs["Strength"].default_value = strength
    white = material("white", Base_Color=(0.7, 0.7, 0.7), Roughness=1.0, Specular_IOR_Level=0.0)
    plane((0, 0, 0), 30, white)
    ball((-1, 0, 1), white, 1)
    ball((1.5, -0.5, 0.6), material("gold", Base_Color=(0.9, 0.6, 0.2), Metallic=1.0, Roughness=0.4), 0.6)
    camera((0, -7, 2.5), (0, 0, 0.8), lens=40)
    return scene


def materials(size: tuple[int, int]) -> Any:
    """Materials under a picture of surroundings, with depth of field; a subdivided cube, copies, a ball that moves."""
    scene = fresh(size)
    panorama(1.2, math.radians(50))
    floor = material("floor", Roughness=0.6)
    checks = node(floor, "ShaderNodeTexImage", shader(floor).inputs["Base Color"])
    checks.image, checks.interpolation = picture("checker", (256, 256), checker), "Closest"
    plane((0, 0, 0), 12, floor)
    plastic = material("plastic", Base_Color=(0.7, 0.05, 0.05), Roughness=0.25)
    ball((-2.2, 0, 0.5), material("glass", Base_Color=(1, 1, 1), Roughness=0.0, Transmission_Weight=1.0, IOR=1.45))
    ball((-1.1, 0, 0.5), plastic)
    ball((0, 0, 0.5), material("gold", Base_Color=(0.9, 0.6, 0.2), Metallic=1.0, Roughness=0.2))
    ball((1.1, 0, 0.5), material("coat", Base_Color=(0.05, 0.1, 0.5), Roughness=0.6, Coat_Weight=1.0))
    ball(
        (2.2, 0, 0.5), material("glow", Base_Color=(0.2, 0.2, 0.2), Emission_Color=(1, 0.5, 0.2), Emission_Strength=2.0)
    )
    rough = material("rough map", Metallic=1.0)
    ramp = node(rough, "ShaderNodeTexImage", shader(rough).inputs["Roughness"])
    ramp.image = picture("rough", (128, 128), lambda u, v: (0.1 + 0.8 * u)[..., None], is_data=True)
    bpy.ops.mesh.primitive_cube_add(size=1.1, location=(-0.8, 1.6, 0.6))
    cube = bpy.context.object
    cube.data.materials.append(rough)
    modifier = cube.modifiers.new("subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 3
    mover = ball((1.0, -1.3, 0.3), material("matte", Base_Color=(0.1, 0.6, 0.2), Roughness=1.0), radius=0.3)
    mover.name = "mover"
    for frame, x in ((1, 1.0), (3, -1.0)):
        mover.location.x = x
        mover.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    inner = bpy.data.collections.new("inner")
    bpy.ops.mesh.primitive_cone_add(radius1=0.25, depth=0.6, location=(0, 0, 0.3))
    cone = bpy.context.object
    cone.data.materials.append(plastic)
    bpy.context.collection.objects.unlink(cone)
    inner.objects.link(cone)
    for x in (1.0, 2.0):
        copy = link(bpy.data.objects.new(f"copy {x}", None))
        copy.instance_type, copy.instance_collection, copy.location = "COLLECTION", inner, (x, 1.8, 0)
    focus(camera((0, -7, 2.4), (0, 0, 0.6), lens=60), math.hypot(7, 1.8), aperture_fstop=0.8)
    return scene
