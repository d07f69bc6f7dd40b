# SPDX-License-Identifier: MIT OR Apache-2.0
"""Balls of one material each, whose nodes are used in less common ways. See `test_looks.py`."""

from __future__ import annotations

from typing import Any

import numpy as np

from test_looks import look
from test_scenes import material, node, picture, shader, surface


def slopes(of: Any, to: Any, out: str | int = 0, **fields: Any) -> Any:
    """Links a picture whose red grows along u and whose green along v. Returns its node."""
    texture = node(of, "ShaderNodeTexImage", to, out)
    texture.image = picture("slopes", (64, 64), lambda u, v: np.stack([u, v, 0 * u + 0.3], axis=-1), **fields)
    return texture


@look(0.03)
def subsurface_by_burley():
    """Christensen and Burley's has no anisotropy: Blender takes the input away."""
    found = material("m", Base_Color=(0.8, 0.5, 0.3), Specular_IOR_Level=0.0, Roughness=1.0, Subsurface_Weight=1.0)
    shader(found).subsurface_method = "BURLEY"
    shader(found).inputs["Subsurface Scale"].default_value = 0.05
    return found


@look()
def conductor():
    """A Metallic BSDF by indices of refraction, those of copper."""
    found = material("m")
    metal = surface(found, "ShaderNodeBsdfMetallic", Roughness=0.3)
    metal.fresnel_type = "PHYSICAL_CONDUCTOR"
    metal.inputs["IOR"].default_value, metal.inputs["Extinction"].default_value = (0.24, 0.8, 1.2), (3.6, 2.6, 2.4)
    return found


@look()
def emission_strength_by_picture():
    """With white as Emission Color."""
    found = material("m", Base_Color=(0.2, 0.2, 0.2), Emission_Color=(1, 1, 1), Specular_IOR_Level=0.0)
    slopes(found, shader(found).inputs["Emission Strength"], "Alpha")
    return found


@look()
def emission_node_by_picture():
    found = material("m")
    glow = surface(found, "ShaderNodeEmission")
    separate = node(found, "ShaderNodeSeparateColor", glow.inputs["Strength"], "Green")
    slopes(found, separate.inputs[0])
    return found


@look(0.04)
def sheen_by_picture():
    found = material("m", Base_Color=(0.1, 0.1, 0.1), Roughness=0.9, Sheen_Roughness=0.4)
    separate = node(found, "ShaderNodeSeparateColor", shader(found).inputs["Sheen Weight"], "Red")
    slopes(found, separate.inputs[0])
    return found


@look()
def roughness_by_green():
    """Cycles takes the luminance of a colour as a number, whatever it comes from."""
    found = material("m", Metallic=1.0)
    node(found, "ShaderNodeRGB", shader(found).inputs["Roughness"]).outputs[0].default_value = (0, 0.6, 0, 1)
    return found


@look()
def roughness_by_picture():
    found = material("m", Metallic=1.0)
    slopes(found, shader(found).inputs["Roughness"])
    return found


@look()
def alpha_by_vertex_colors():
    found = material("m", Base_Color=(0.7, 0.3, 0.1), Roughness=1.0, Specular_IOR_Level=0.0)
    node(found, "ShaderNodeVertexColor", shader(found).inputs["Alpha"]).layer_name = "paint"
    return found


@look()
def glow_by_bright_picture():
    """The luminance of a picture that goes up to 3."""
    found = material("m", Base_Color=(0.2, 0.2, 0.2), Emission_Color=(1, 0.5, 0.2), Specular_IOR_Level=0.0)
    texture = node(found, "ShaderNodeTexImage", shader(found).inputs["Emission Strength"])
    bright = lambda u, v: np.stack([3 * u, v, 0 * u], axis=-1)  # noqa: E731
    texture.image = picture("bright", (64, 64), bright, float_buffer=True, is_data=True)
    return found


@look()
def ramp_of_mixed_colors():
    """The luminance of colours that are mixed, multiplied and subtracted."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    ramp = node(found, "ShaderNodeValToRGB", shader(found).inputs["Base Color"])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.8, 0.1, 0.1, 1), (0.1, 0.3, 0.9, 1)
    mix = node(found, "ShaderNodeMix", ramp.inputs[0], 2)
    mix.data_type, mix.blend_type, mix.inputs[0].default_value = "RGBA", "MULTIPLY", 1.0
    found.node_tree.links.new(mix.outputs[2], ramp.inputs[0])
    mix.inputs[7].default_value = (0.2, 1, 0.5, 1)
    slopes(found, mix.inputs[6])
    return found


@look()
def black_and_white():
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    slopes(found, node(found, "ShaderNodeRGBToBW", shader(found).inputs["Base Color"]).inputs[0])
    return found


def veiled(found: Any, **fields: Any) -> Any:
    """A picture with stripes of alpha as Base Color."""
    texture = node(found, "ShaderNodeTexImage", shader(found).inputs["Base Color"])
    image = texture.image = picture("veiled", (64, 64), lambda u, v: np.stack([u, v, 0 * u + 0.8], axis=-1), **fields)
    texels = np.empty(64 * 64 * 4, np.float32)
    image.pixels.foreach_get(texels)
    texels.reshape(64, 64, 4)[..., 3] = np.arange(64) // 8 % 3 / 2
    image.pixels.foreach_set(texels)
    return texture


@look()
def picture_with_alpha():
    """Cycles' colours are multiplied by alpha, as they are stored."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    veiled(found, alpha=True)
    return found


@look()
def picture_with_packed_alpha():
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    veiled(found, alpha=True).image.alpha_mode = "CHANNEL_PACKED"
    return found


@look()
def picture_with_used_alpha():
    """Where alpha is used, they are not, but for those that are not there at all."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    texture = veiled(found, alpha=True)
    found.node_tree.links.new(texture.outputs["Alpha"], shader(found).inputs["Coat Weight"])
    return found


@look()
def one_vertex_color():
    """One channel of the mesh's colours as a colour."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    separate = node(found, "ShaderNodeSeparateColor", shader(found).inputs["Base Color"], "Green")
    node(found, "ShaderNodeVertexColor", separate.inputs[0]).layer_name = "paint"
    return found


def ripples(found: Any, to: Any, across: bool, **inputs: Any) -> Any:
    raised = node(found, "ShaderNodeBump", to, Distance=0.05, **inputs)
    waves = lambda u, v: 0.5 + 0.5 * np.sin(60 * v if across else 40 * u)[..., None]  # noqa: E731
    texture = node(found, "ShaderNodeTexImage", raised.inputs["Height"])
    texture.image = picture("ripples", (512, 512), waves, is_data=True)
    return raised


@look()
def two_bumps():
    """One Bump on another, one of which goes down."""
    found = material("m", Base_Color=(0.8, 0.8, 0.8), Roughness=0.25, Metallic=1.0)
    outer = ripples(found, shader(found).inputs["Normal"], True)
    outer.invert = True
    ripples(found, outer.inputs["Normal"], False, Strength=0.7)
    return found


@look()
def without_nodes():
    """Matte, whatever the viewport shows."""
    found = material("m")
    found.use_nodes, found.diffuse_color, found.roughness, found.metallic = False, (0.8, 0.1, 0.1, 1), 0.2, 1.0
    return found


@look()
def two_outputs():
    """One for EEVEE, which is active, and one for Cycles."""
    found = material("m", Base_Color=(0.8, 0.1, 0.1))
    found.node_tree.nodes["Material Output"].target = "EEVEE"
    other = node(found, "ShaderNodeOutputMaterial")
    other.target = "CYCLES"
    node(found, "ShaderNodeBsdfDiffuse", other.inputs["Surface"], Color=(0.1, 0.8, 0.1, 1))
    found.node_tree.nodes.active = found.node_tree.nodes["Material Output"]
    return found


@look()
def two_outputs_for_all():
    """The active one counts."""
    found = material("m", Base_Color=(0.8, 0.1, 0.1))
    other = node(found, "ShaderNodeOutputMaterial")
    node(found, "ShaderNodeBsdfDiffuse", other.inputs["Surface"], Color=(0.1, 0.8, 0.1, 1))
    found.node_tree.nodes["Material Output"].is_active_output = True
    other.is_active_output = False
    return found


@look()
def constants():
    """Nodes without textures are computed."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    hue = node(found, "ShaderNodeHueSaturation", shader(found).inputs["Base Color"], Hue=0.6, Saturation=0.8)
    curves = node(found, "ShaderNodeRGBCurve", hue.inputs["Color"])
    curves.mapping.curves[3].points[0].location = (0, 0.2)
    node(found, "ShaderNodeCombineColor", curves.inputs["Color"], Red=0.8, Green=0.1, Blue=0.3)
    return found


@look()
def exchanged_channels():
    """The channels of a picture in another order."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    join = node(found, "ShaderNodeCombineColor", shader(found).inputs["Base Color"], Blue=0.4)
    separate = node(found, "ShaderNodeSeparateColor", join.inputs["Green"], "Red")
    found.node_tree.links.new(separate.outputs["Green"], join.inputs["Red"])
    slopes(found, separate.inputs[0])
    return found


def ramp_of_u(mode: str, interpolation: str) -> Any:
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    ramp = node(found, "ShaderNodeValToRGB", shader(found).inputs["Base Color"])
    ramp.color_ramp.color_mode, ramp.color_ramp.interpolation = mode, interpolation
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0, 0, 1), (0, 0, 0.8, 1)
    gradient = node(found, "ShaderNodeTexGradient", ramp.inputs[0])
    node(found, "ShaderNodeTexCoord", gradient.inputs[0], "UV")
    return found


@look()
def ramp_by_hue():
    return ramp_of_u("HSV", "LINEAR")


@look()
def ramp_that_eases():
    return ramp_of_u("RGB", "EASE")


@look(0.005)
def cells_in_a_grid():
    """Voronoi cells without randomness."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    cells = node(found, "ShaderNodeTexVoronoi", shader(found).inputs["Base Color"], "Distance", Scale=4.0)
    cells.inputs["Randomness"].default_value = 0
    node(found, "ShaderNodeTexCoord", cells.inputs["Vector"], "Object")
    return found


@look(0.05)
def colored_noise():
    """Another noise than Blender's, as colourful."""
    found = material("m", Roughness=1.0, Specular_IOR_Level=0.0)
    noise = node(found, "ShaderNodeTexNoise", shader(found).inputs["Base Color"], "Color", Scale=30.0)
    node(found, "ShaderNodeTexCoord", noise.inputs["Vector"], "Object")
    return found
