# SPDX-License-Identifier: MIT OR Apache-2.0
"""The program `rayfront`: where it is."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import Any

import bpy

from .export import SCENE

WINDOWS = sys.platform == "win32"
NAME = "rayfront.exe" if WINDOWS else "rayfront"
# How to start it without a window of its own.
HIDDEN: dict[str, Any] = {"creationflags": subprocess.CREATE_NO_WINDOW} if WINDOWS else {}
# What the program calls by an option, and Blender's panels by a name.
NAMES = {
    "--spp": "Samples", "--until": "Noise Threshold", "--max-time": "Time Limit", "--adaptive": "Adaptive",
    "--denoise": "Denoise", "--seed": "Seed", "--depth": "Light Paths › Total", "--diffuse-depth": "Light Paths › Diffuse",
    "--glossy-depth": "Light Paths › Glossy", "--transmission-depth": "Light Paths › Transmission",
    "--caustics": "Caustics", "--threads": "Threads", "--shutter": "Shutter", "--size": "Resolution",
    "--crop": "Render Region",
}  # fmt: skip
OPTION = re.compile(r"--[a-z][a-z-]*")
# A remark in brackets, which may have some within.
REMARK = re.compile(r" \((?:[^()]|\([^()]*\))*\)")


def message(said: str) -> str:
    """What the program says, for someone who has no command line: with the names of Blender's settings.

    A remark about an option without a setting helps nobody here.
    """
    said = re.sub(r"^error: ", "", said)
    said = re.sub(rf"^{re.escape(SCENE)}:\d+:\d+: ", "", said)

    def remark(found: re.Match) -> str:
        return found[0] if all(option in NAMES for option in OPTION.findall(found[0])) else ""

    return OPTION.sub(lambda found: NAMES.get(found[0], found[0]), REMARK.sub(remark, said)).replace("`", "")


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
