# SPDX-License-Identifier: MIT OR Apache-2.0
"""rayfront as a render engine of Blender."""

import bpy

from . import panels
from .engine import RayfrontEngine


def register() -> None:
    """Called by Blender when the extension is enabled."""
    bpy.utils.register_class(RayfrontEngine)
    panels.register()


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
    panels.unregister()
    bpy.utils.unregister_class(RayfrontEngine)
