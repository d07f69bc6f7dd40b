# SPDX-License-Identifier: GPL-3.0-or-later
"""Values as text of rayfront's scene files (RON), and the way from Blender's axes to rayfront's."""

from __future__ import annotations

import json
from typing import Any

from mathutils import Matrix

# Blender's +Z is up, rayfront's +Y. Cameras and lamps look along -Z in both.
TO_Y_UP = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))


class Ron(str):
    """Text that is RON already: a form, a word."""


def text(value: Any) -> str:
    """A number, a text, a vector, a list (of Python: `[…]`), or fields (a dict: `(key: value, …)`) as RON."""
    if isinstance(value, Ron):
        return str(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, dict):
        return "(" + ", ".join(f"{key}: {text(v)}" for key, v in value.items()) + ")"
    if isinstance(value, list):
        return "[" + ", ".join(map(text, value)) + "]"
    if hasattr(value, "__len__"):
        return "(" + ", ".join(map(text, value)) + ")"
    return repr(round(float(value), 9))


def form(name: str, **fields: Any) -> Ron:
    """`name(field: value, …)`, without the fields that are None."""
    return Ron(name + text({key: value for key, value in fields.items() if value is not None}))


def matrix(m: Matrix) -> Ron:
    """A transform of rayfront's world."""
    return Ron(f"Matrix({text(tuple(tuple(row) for row in m[:3]))})")


def placed(m: Matrix) -> Ron:
    """The place of something that Blender has put at `m`."""
    return matrix(TO_Y_UP @ m)


def unscaled(m: Matrix) -> Matrix:
    """The place and the rotation of `m`: of cameras and lamps nothing else counts."""
    place, turn, _ = m.decompose()
    return Matrix.LocRotScale(place, turn, None)
