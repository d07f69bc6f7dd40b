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
from .arithmetic import GREY
from .nodes import LUMINANCE

# What rayfront reads as it is.
READABLE = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".webp", ".hdr", ".exr"}
SEVERAL = {"TILED": "UDIM tiles", "SEQUENCE": "a sequence", "MOVIE": "a movie"}


# Kinds of files of a picture: as it is; its colours times alpha, as Cycles has them; black where alpha is 0; the luminance
# of colours beyond 1.
PLAIN, ASSOCIATED, MASKED, LUMINANT = "picture", "associated", "masked", GREY


class Images:
    """The files of a scene's pictures. Each picture is saved once, of each kind."""

    def __init__(self, folder: str):
        self.folder = folder
        self.files: dict[tuple[str, str], str] = {}
        # Of pictures that were looked at: whether all channels are the same, and whether any texel lets through.
        self.greys: dict[str, bool] = {}
        self.veils: dict[str, bool] = {}

    def file(self, image: Any, user: str, kind: str = PLAIN) -> str:
        """The name of a picture's file. A ValueError if there is no picture: Cycles would show magenta."""
        key = image.name_full, kind  # Those of libraries may have the same name.
        if key not in self.files:
            name = f"{kind}{len(self.files)}"
            self.files[key] = self._save(image, name, user) if kind == PLAIN else self._bake(image, name, kind)
        return self.files[key]

    def is_grey(self, image: Any) -> bool:
        """True if red, green and blue are the same in all texels."""
        key = image.name_full
        if key not in self.greys:
            rows = pixels(image) if _is_one(image) and image.depth not in {8, 16} else None
            self.greys[key] = rows is None or bool((rows[..., :1] == rows[..., 1:3]).all())
        return self.greys[key]

    def is_veiled(self, image: Any) -> bool:
        """True if the colours of a picture are stored beside an alpha below 1, as those of 8 bits are."""
        key = image.name_full
        if key not in self.veils:
            has_alpha = not image.is_float and image.channels == 4 and image.depth not in {8, 24, 48} and _is_one(image)
            self.veils[key] = has_alpha and bool((pixels(image)[..., 3] < 1).any())
        return self.veils[key]

    def _bake(self, image: Any, name: str, kind: str) -> str:
        rows = pixels(image)
        if kind in {ASSOCIATED, MASKED}:
            alpha = rows[..., 3:]
            write_png(
                os.path.join(self.folder, name + ".png"), rows[..., :3] * (alpha if kind == ASSOCIATED else alpha > 0)
            )
            return name + ".png"
        exr.write(
            os.path.join(self.folder, name + ".exr"),
            np.repeat(rows[..., :3] @ LUMINANCE, 3).reshape(*rows.shape[:2], 3),
        )
        return name + ".exr"

    def _save(self, image: Any, name: str, user: str) -> str:
        if image.source in SEVERAL:
            raise ValueError(
                f"{user}: the picture {image.name!r} is {SEVERAL[image.source]}, which rayfront cannot read"
            )
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


def _is_one(image: Any) -> bool:
    """True for a picture that has pixels, and is not one of several."""
    return image.source not in SEVERAL and min(image.size) > 0 and (image.source != "FILE" or len(image.pixels) > 0)


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
