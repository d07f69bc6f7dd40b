# SPDX-License-Identifier: MIT OR Apache-2.0
"""Values as text of rayfront's scene files (RON), and places from Blender's axes to rayfront's."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from mathutils import Matrix, Quaternion, Vector

# Blender's +Z is up, rayfront's +Y. Cameras and lamps look along -Z in both.
TO_Y_UP = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))
MIRROR = Matrix.Diagonal((-1, 1, 1, 1))


class Ron(str):
    """Text that is RON already: a form, of which `name` and `fields` are known, or a word."""

    name: str = ""
    fields: dict[str, Any] = {}
    # Of a map, once it is known: see `arithmetic.size`.
    size: Any = None


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
    return str(np.float32(value))  # As Blender has it, in as few digits as it takes.


def form(name: str, **fields: Any) -> Ron:
    """`name(field: value, …)`, without the fields that are None."""
    given = {key: value for key, value in fields.items() if value is not None}
    found = Ron(name + text(given))
    found.name, found.fields = name, given
    return found


def matrix(m: Matrix) -> Ron:
    """A transform of rayfront's world."""
    return Ron(f"Matrix({text(tuple(tuple(row) for row in m[:3]))})")


def placed(m: Matrix) -> Ron:
    """The place of something that Blender has put at `m`."""
    return matrix(TO_Y_UP @ m)


def unscaled(m: Matrix) -> Matrix:
    """`m` with axes of length 1, for cameras and lamps, which look along −Z whatever the sign of a scale, as in Cycles.

    Its size counts for areas and for the cones of spots alone, which see to it themselves.
    """
    axes = m.to_3x3()
    if min(column.length for column in axes.col) < 1e-12:
        return Matrix.LocRotScale(m.translation, m.to_quaternion(), None)
    for column in range(3):
        axes.col[column].normalize()
    return Matrix.Translation(m.translation) @ axes.to_4x4()


def upright(m: Matrix) -> Matrix:
    """`m`, or its mirror image that has the same −Z: lamps are as wide to the left as to the right."""
    return m @ MIRROR if m.determinant() < 0 else m


def visible(m: Matrix) -> Matrix | None:
    """`m`, a little thicker if it is flat: rayfront leaves out what has no volume. None if it has no area, either."""

    def is_full(axes: np.ndarray) -> bool:
        return abs(np.linalg.det(axes)) > 1e-7 * np.prod(np.linalg.norm(axes, axis=0))

    axes = np.array(m.to_3x3(), float)
    if is_full(axes):
        return m
    left, scale, right = np.linalg.svd(axes)
    # Not mirrored, so that the normals of what was flat before keep their side.
    scale[2] = 1e-3 * scale[1] * np.linalg.det(left) * np.linalg.det(right)
    axes = (left * scale) @ right
    return Matrix.Translation(m.translation) @ Matrix(axes).to_4x4() if is_full(axes) else None


def differ(a: Matrix, b: Matrix, limit: float = 1e-6) -> bool:
    """Whether two places are further apart than rounding makes them."""
    return max(abs(x - y) for left, right in zip(a, b) for x, y in zip(left, right)) > limit


def steps(places: list[Matrix]) -> list[tuple[Vector, Quaternion, Vector]]:
    """Translation, rotation and scale in rayfront's world, of a thing that moves the shorter way from place to place."""
    parts = [(TO_Y_UP @ place).decompose() for place in places]
    for earlier, later in zip(parts, parts[1:]):
        if earlier[1].dot(later[1]) < 0:
            later[1].negate()
    return parts


def moved(times: list[float], places: list[Matrix]) -> dict[str, Any]:
    """The transform of a camera that moves, with keys."""
    mirrored = places[0].determinant() < 0
    parts = steps([place @ MIRROR for place in places] if mirrored else places)
    keys = {
        "translate": [(time, part[0]) for time, part in zip(times, parts)],
        "rotate_quaternion": [(time, (q.x, q.y, q.z, q.w)) for time, (_, q, _) in zip(times, parts)],
    }
    fields: dict[str, Any] = {name: Ron(f"Keys({text(values)})") for name, values in keys.items()}
    return fields | ({"scale": (-1.0, 1.0, 1.0)} if mirrored else {})
