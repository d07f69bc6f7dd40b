# SPDX-License-Identifier: MIT OR Apache-2.0
"""Balls of one material each, for `test_blender.py`: a function of each name makes the material."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from test_scenes import ball, camera, checker, fresh, material, node, panorama, picture, plane, shader, surface

LOOKS: dict[str, tuple[Callable[[], Any], float]] = {}


def look(limit: float = 0.02) -> Callable:
    """A look whose picture may differ from that of Cycles by this part of its brightness."""

    def add(function: Callable) -> Callable:
        LOOKS[function.__name__] = (function, limit)
        return function

    return add


def scene(name: str, size: tuple[int, int] = (64, 64)) -> Any:
    """A ball before a grey floor, in surroundings with a bright window."""
    found = fresh(size)
    panorama(1.0, math.radians(20))
    plane((0, 0, 0), 6, material("grey", Base_Color=(0.4, 0.4, 0.4), Roughness=1.0, Specular_IOR_Level=0.0))
    ob = ball((0, 0, 0.7), LOOKS[name][0](), 0.7)
    colors = ob.data.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
    heights = np.array([v.co.z for v in ob.data.vertices], np.float32) / 1.4 + 0.5
    rgba = np.stack([heights, 1 - heights, 0 * heights + 0.2, 0 * heights + 1], axis=1)
    colors.data.foreach_set("color", rgba.ravel())
    camera((0, -5, 1.6), (0, 0, 0.65), lens=90)
    return found


@look()
def matte():
    return material("m", Base_Color=(0.7, 0.3, 0.1), Roughness=1.0, Specular_IOR_Level=0.0)


@look()
def plastic():
    return material("m", Base_Color=(0.7, 0.3, 0.1), Roughness=0.4)


@look()
def half_metal():
    return material("m", Base_Color=(0.9, 0.6, 0.2), Metallic=0.5, Roughness=0.4)


@look()
def metal_with_edge():
    return material("m", Base_Color=(0.9, 0.6, 0.2), Metallic=1.0, Roughness=0.3, Specular_Tint=(0.5, 0.6, 1.0))


@look()
def high_specular():
    return material("m", Base_Color=(0.1, 0.1, 0.1), Roughness=0.3, Specular_IOR_Level=0.9, Specular_Tint=(1, 0.7, 0.5))


@look()
def low_specular():
    return material("m", Base_Color=(0.4, 0.4, 0.4), Roughness=0.3, Specular_IOR_Level=0.2)


@look()
def coat():
    return material("m", Base_Color=(0.1, 0.1, 0.5), Roughness=0.7, Coat_Weight=0.8, Coat_Roughness=0.1)


@look(0.04)
def sheen():
    return material("m", Base_Color=(0.1, 0.1, 0.1), Roughness=0.9, Sheen_Weight=0.8, Sheen_Roughness=0.4)


@look()
def thin_film():
    return material("m", Base_Color=(0.1, 0.1, 0.1), Roughness=0.2, Thin_Film_Thickness=400.0, Thin_Film_IOR=1.8)


@look()
def brushed():
    return material("m", Base_Color=(0.8, 0.8, 0.8), Metallic=1.0, Roughness=0.4, Anisotropic=0.7)


@look()
def tinted_glass():
    return material("m", Base_Color=(0.5, 0.8, 0.9), Roughness=0.0, Transmission_Weight=1.0, IOR=1.45)


@look()
def rough_glass():
    return material("m", Base_Color=(1, 1, 1), Roughness=0.4, Transmission_Weight=1.0, IOR=1.45)


@look()
def half_there():
    return material("m", Base_Color=(0.7, 0.3, 0.1), Roughness=0.5, Alpha=0.4)


@look()
def glow():
    return material("m", Base_Color=(0.2, 0.2, 0.2), Emission_Color=(1, 0.5, 0.2), Emission_Strength=1.5)


@look()
def diffuse_node():
    m = material("m")
    surface(m, "ShaderNodeBsdfDiffuse", Color=(0.2, 0.6, 0.3, 1))
    return m


@look()
def glossy_node():
    m = material("m")
    surface(m, "ShaderNodeBsdfGlossy", Color=(0.4, 0.3, 0.2, 1), Roughness=0.3)
    return m


@look()
def metallic_node():
    m = material("m")
    surface(m, "ShaderNodeBsdfMetallic", Base_Color=(0.9, 0.5, 0.3, 1), Edge_Tint=(0.6, 0.8, 0.9, 1), Roughness=0.25)
    return m


@look(0.03)
def glass_node():
    m = material("m")
    surface(m, "ShaderNodeBsdfGlass", Color=(0.7, 0.9, 0.8, 1), Roughness=0.0, IOR=1.5)
    return m


@look()
def leaf():
    """Diffuse and Translucent, mixed."""
    m = material("m")
    mix = surface(m, "ShaderNodeMixShader", Fac=0.4)
    node(m, "ShaderNodeBsdfDiffuse", mix.inputs[1], Color=(0.3, 0.7, 0.2, 1))
    node(m, "ShaderNodeBsdfTranslucent", mix.inputs[2], Color=(0.6, 0.7, 0.1, 1))
    return m


@look()
def veil():
    """Transparent and Glossy, mixed by a checker."""
    m = material("m")
    mix = surface(m, "ShaderNodeMixShader")
    node(m, "ShaderNodeTexChecker", mix.inputs[0], "Fac", Scale=6.0)
    node(m, "ShaderNodeBsdfTransparent", mix.inputs[1])
    node(m, "ShaderNodeBsdfDiffuse", mix.inputs[2], Color=(0.8, 0.3, 0.2, 1))
    return m


@look()
def tinted_veil():
    m = material("m")
    surface(m, "ShaderNodeBsdfTransparent", Color=(0.5, 0.7, 0.9, 1))
    return m


@look()
def old_plastic():
    """Diffuse and Glossy, mixed by Fresnel."""
    m = material("m")
    mix = surface(m, "ShaderNodeMixShader")
    node(m, "ShaderNodeFresnel", mix.inputs[0], IOR=1.5)
    node(m, "ShaderNodeBsdfDiffuse", mix.inputs[1], Color=(0.5, 0.1, 0.1, 1))
    node(m, "ShaderNodeBsdfGlossy", mix.inputs[2], Color=(1, 1, 1, 1), Roughness=0.2)
    return m


@look()
def sum_with_light():
    m = material("m")
    both = surface(m, "ShaderNodeAddShader")
    node(m, "ShaderNodeBsdfDiffuse", both.inputs[0], Color=(0.3, 0.3, 0.3, 1))
    node(m, "ShaderNodeEmission", both.inputs[1], Color=(0.2, 0.5, 1, 1), Strength=0.5)
    return m


def mapped(m, texture, space, scale=(1, 1, 1), rotation=(0, 0, 0), location=(0, 0, 0), kind="POINT"):
    mapping = node(m, "ShaderNodeMapping", texture.inputs["Vector"])
    mapping.vector_type = kind
    for name, value in (("Scale", scale), ("Rotation", rotation), ("Location", location)):
        mapping.inputs[name].default_value = value
    node(m, "ShaderNodeTexCoord", mapping.inputs["Vector"], space)


@look()
def checker_of_generated():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    node(m, "ShaderNodeTexChecker", shader(m).inputs["Base Color"], Color1=(0.8, 0.2, 0.1, 1), Scale=4.7)
    return m


@look()
def checker_of_object():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    texture = node(m, "ShaderNodeTexChecker", shader(m).inputs["Base Color"], Color1=(0.8, 0.2, 0.1, 1), Scale=2.0)
    mapped(m, texture, "Object", (1, 1.5, 2), (0.3, 0.5, 0.7), (0.1, 0.2, 0.3))
    return m


@look()
def waves():
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    ramp = node(found, "ShaderNodeValToRGB", shader(found).inputs["Base Color"])
    ramp.color_ramp.elements[0].color = (0.8, 0.1, 0.05, 1)
    wave = node(found, "ShaderNodeTexWave", ramp.inputs[0], out="Fac", Scale=0.8, Phase_Offset=1.0)
    wave.bands_direction = "DIAGONAL"
    node(found, "ShaderNodeTexCoord", wave.inputs["Vector"], out="Object")
    return found


@look()
def saw_of_uv():
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    wave = node(found, "ShaderNodeTexWave", shader(found).inputs["Base Color"], Scale=1.5)
    wave.bands_direction, wave.wave_profile = "Y", "SAW"
    node(found, "ShaderNodeTexCoord", wave.inputs["Vector"], out="UV")
    return found


@look()
def checker_of_uv():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    texture = node(m, "ShaderNodeTexChecker", shader(m).inputs["Base Color"], Color1=(0.8, 0.2, 0.1, 1), Scale=8.0)
    mapped(m, texture, "UV", (2, 1, 1), (0, 0, 0.4), (0.1, 0.03, 0))
    return m


@look()
def picture_with_mapping():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    texture = node(m, "ShaderNodeTexImage", shader(m).inputs["Base Color"])
    texture.image = picture("checker", (256, 256), lambda u, v: checker(u, v) * u[..., None])
    texture.interpolation = "Closest"
    mapped(m, texture, "UV", (2, 1, 1), (0, 0, 0.4), (0.1, 0.23, 0))
    return m


@look()
def ramp_of_gradient():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    ramp = node(m, "ShaderNodeValToRGB", shader(m).inputs["Base Color"])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.8, 0.1, 0.1, 1), (0.1, 0.3, 0.9, 1)
    ramp.color_ramp.elements.new(0.4).color = (0.9, 0.9, 0.2, 1)
    node(m, "ShaderNodeTexGradient", ramp.inputs["Fac"], "Fac")
    return m


@look()
def mixed_colors():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    mix = node(m, "ShaderNodeMix", shader(m).inputs["Base Color"], 2)
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    mix.inputs[0].default_value = 0.7
    mix.inputs[7].default_value = (0.9, 0.4, 0.2, 1)
    node(m, "ShaderNodeTexChecker", mix.inputs[6], Scale=5.3)
    return m


@look()
def clamped_picture():
    """A picture behind a Color Ramp's Alpha, a Math node and a Mix node, which clamp."""
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    mix = node(m, "ShaderNodeMix", shader(m).inputs["Base Color"], 2)
    mix.data_type, mix.blend_type, mix.clamp_result = "RGBA", "ADD", True
    m.node_tree.links.new(mix.outputs[2], shader(m).inputs["Base Color"])
    mix.inputs[6].default_value = (0.7, 0.1, 0.3, 1)
    ramp = node(m, "ShaderNodeValToRGB", mix.inputs[7], "Alpha")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0, 0, 0.8), (0, 1, 0, 0.1)
    math = node(m, "ShaderNodeMath", mix.inputs[0])
    math.operation, math.use_clamp, math.inputs[1].default_value = "MULTIPLY", True, 3.0
    texture = node(m, "ShaderNodeTexImage", ramp.inputs["Fac"])
    m.node_tree.links.new(texture.outputs[0], math.inputs[0])
    texture.image = picture("slope", (256, 256), lambda u, v: u[..., None], is_data=True)
    return m


@look()
def vertex_colors():
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    node(m, "ShaderNodeVertexColor", shader(m).inputs["Base Color"]).layer_name = "paint"
    return m


@look()
def group():
    """A node group: a colour goes in, and a darker one comes out."""
    m = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    tree = bpy.data.node_groups.new("darker", "ShaderNodeTree")
    tree.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    first, last, mix = (tree.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeMix"))
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    mix.inputs[0].default_value, mix.inputs[7].default_value = 1.0, (0.5, 0.6, 0.7, 1)
    tree.links.new(first.outputs[0], mix.inputs[6])
    tree.links.new(mix.outputs[2], last.inputs[0])
    whole = node(m, "ShaderNodeGroup")
    whole.node_tree = tree
    m.node_tree.links.new(whole.outputs[0], shader(m).inputs["Base Color"])
    node(m, "ShaderNodeTexChecker", whole.inputs[0], Color1=(0.8, 0.2, 0.1, 1), Scale=3.1)
    return m


@look()
def normal_map():
    m = material("m", Base_Color=(0.5, 0.5, 0.5), Roughness=0.5)
    bent = node(m, "ShaderNodeNormalMap", shader(m).inputs["Normal"], Strength=0.8)
    waves = lambda u, v: np.stack([0.5 + 0.3 * np.sin(60 * u), 0.5 + 0.3 * np.cos(60 * v), 0 * u + 0.9], axis=-1)  # noqa: E731
    node(m, "ShaderNodeTexImage", bent.inputs["Color"]).image = picture("bent", (256, 256), waves, is_data=True)
    return m


@look()
def bump():
    m = material("m", Base_Color=(0.5, 0.5, 0.5), Roughness=0.5)
    raised = node(m, "ShaderNodeBump", shader(m).inputs["Normal"], Strength=1.0, Distance=0.05)
    waves = lambda u, v: (0.5 + 0.25 * np.sin(60 * u) + 0.25 * np.sin(40 * v))[..., None]  # noqa: E731
    node(m, "ShaderNodeTexImage", raised.inputs["Height"]).image = picture("bumps", (512, 512), waves, is_data=True)
    return m


@look(0.03)
def subsurface():
    return material(
        "m", Base_Color=(0.8, 0.5, 0.3), Specular_IOR_Level=0.0, Roughness=1.0, Subsurface_Weight=1.0,
        Subsurface_Radius=(1.0, 0.4, 0.2), Subsurface_Scale=0.3,
    )  # fmt: skip


@look()
def fog():
    m = material("m")
    m.node_tree.nodes.remove(shader(m))
    node(
        m,
        "ShaderNodeVolumePrincipled",
        m.node_tree.nodes["Material Output"].inputs["Volume"],
        Color=(0.8, 0.6, 0.4, 1),
        Density=2.0,
    )
    return m


@look()
def tinted_water():
    m = material("m")
    surface(m, "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1), Roughness=0.0, IOR=1.33)
    node(
        m,
        "ShaderNodeVolumeAbsorption",
        m.node_tree.nodes["Material Output"].inputs["Volume"],
        Color=(0.3, 0.6, 0.9, 1),
        Density=1.0,
    )
    return m
