# SPDX-License-Identifier: MIT OR Apache-2.0
"""The program `rayfront`: where it is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from typing import Any

import bpy

WINDOWS = sys.platform == "win32"
NAME = "rayfront.exe" if WINDOWS else "rayfront"
# How to start it without a window of its own.
HIDDEN: dict[str, Any] = {"creationflags": subprocess.CREATE_NO_WINDOW} if WINDOWS else {}


def path() -> str:
    """The program of the preferences, else the one in the extension, else the one in the PATH. A ValueError if none is there."""
    addon = bpy.context.preferences.addons.get(__package__)
    wanted = bpy.path.abspath(addon.preferences.program) if addon and addon.preferences else ""
    inside = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", NAME)
    if wanted:
        found = shutil.which(wanted)
    elif os.path.isfile(inside):
        if not os.access(inside, os.X_OK):  # Blender unpacks zips without the permissions in them.
            os.chmod(inside, 0o755)
        found = inside
    else:
        found = shutil.which(NAME)
    if not found:
        raise ValueError(f"there is no program {wanted or NAME!r}: name it in Preferences › Add-ons › rayfront")
    return os.path.abspath(found)
