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
