# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures of Blender as files beside the scene, with numpy alone."""

from __future__ import annotations

import os
import shutil
import struct
import zlib
from typing import Any

import bpy
import numpy as np

from . import exr

# What rayfront reads as it is.
READABLE = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".webp", ".hdr", ".exr"}


class Images:
    """The files of a scene's pictures. Each picture is saved once."""

    def __init__(self, folder: str):
        self.folder = folder
        self.files: dict[str, str] = {}

    def file(self, image: Any, user: str) -> str:
        """The name of a picture's file. A ValueError if there is no picture: Cycles would show magenta."""
        key = image.name_full  # Those of libraries may have the same name.
        if key not in self.files:
            self.files[key] = self._save(image, f"picture{len(self.files)}", user)
        return self.files[key]

    def _save(self, image: Any, name: str, user: str) -> str:
        if image.source in {"TILED", "SEQUENCE", "MOVIE"}:
            kind = {"TILED": "UDIM tiles", "SEQUENCE": "a sequence", "MOVIE": "a movie"}[image.source]
            raise ValueError(f"{user}: the picture {image.name!r} is {kind}, which rayfront cannot read")
        path = bpy.path.abspath(image.filepath_from_user(), library=image.library) if image.filepath else ""
        ending = os.path.splitext(path)[1].lower()
        if not image.is_dirty and ending in READABLE:
            if image.packed_file:
                with open(os.path.join(self.folder, name + ending), "wb") as out:
                    out.write(image.packed_file.data)
                return name + ending
            if os.path.isfile(path):
                shutil.copyfile(path, os.path.join(self.folder, name + ending))
                return name + ending
        if not image.size[0] or not image.size[1] or (image.source == "FILE" and not image.has_data):
            raise ValueError(f"{user}: the picture {image.name!r} has no pixels: {path or 'it was never saved'}")
        rows = pixels(image)
        if image.is_float:
            exr.write(os.path.join(self.folder, name + ".exr"), rows[..., :3])
            return name + ".exr"
        write_png(os.path.join(self.folder, name + ".png"), rows)
        return name + ".png"


def pixels(image: Any) -> np.ndarray:
    """(height, width, 3 or 4), the top row first."""
    (width, height), channels = image.size, image.channels
    flat = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(flat)
    rows = flat.reshape(height, width, channels)[::-1]
    return rows if channels >= 3 else np.repeat(rows[..., :1], 3, axis=2)


def write_png(path: str, rows: np.ndarray) -> None:
    """(height, width, 3 or 4) from 0 to 1, the top row first."""
    height, width, channels = rows.shape
    texels = (np.clip(rows, 0, 1) * 255 + 0.5).astype(np.uint8).reshape(height, width * channels)
    raw = np.concatenate([np.zeros((height, 1), np.uint8), texels], axis=1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in ((b"IHDR", header), (b"IDAT", zlib.compress(raw, 3)), (b"IEND", b"")):
            out.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
