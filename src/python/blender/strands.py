# SPDX-License-Identifier: MIT OR Apache-2.0
"""Hair and other curves as rayfront's strands."""

from __future__ import annotations

import hashlib
import struct
from typing import Any

import numpy as np

HAS_POINTS, HAS_RADII = 2, 4
# That of curves without radii in Cycles, in metres.
RADIUS = 0.005


def digest(curves: Any) -> bytes:
    """What is another if any point of a `Curves` data-block moves."""
    at = np.empty(len(curves.points) * 3, np.float32)
    curves.points.foreach_get("position", at)
    return hashlib.blake2b(at.tobytes(), digest_size=16).digest()


def write(curves: Any, path: str) -> bool:
    """Writes the curves of a `Curves` data-block as a `.hair` file (Cem Yuksel's). False if there are none."""
    points, count = len(curves.points), len(curves.curves)
    if not count:
        return False
    at, radii = np.empty(points * 3, np.float32), np.empty(points, np.float32)
    curves.points.foreach_get("position", at)
    if "radius" in curves.attributes:
        curves.points.foreach_get("radius", radii)
    else:
        radii[:] = RADIUS
    lengths = np.empty(count, np.int32)
    curves.curves.foreach_get("points_length", lengths)
    if lengths.max() < 2 or lengths.max() > 65536:
        return False
    keep = lengths >= 2
    kept = np.repeat(keep, lengths)
    _write(path, (lengths[keep] - 1).astype("<u2"), at.reshape(-1, 3)[kept], radii[kept])
    return True


def _write(path: str, segments: np.ndarray, points: np.ndarray, radii: np.ndarray) -> None:
    header = struct.pack("<4sIII", b"HAIR", len(segments), len(points), 1 | HAS_POINTS | HAS_RADII)
    defaults = struct.pack("<I6f", 1, float(radii.max()) * 2, 0.0, 1.0, 1.0, 1.0, 0.0)
    with open(path, "wb") as out:
        out.write((header + defaults).ljust(128, b"\0"))
        out.write(segments.tobytes() + points.astype("<f4").tobytes() + (radii * 2).astype("<f4").tobytes())
