# SPDX-License-Identifier: MIT OR Apache-2.0
"""Balls of one material each, whose nodes are used in less common ways. See `test_looks.py`."""

from __future__ import annotations

from test_looks import look
from test_scenes import material, shader, surface


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
