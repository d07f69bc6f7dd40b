# SPDX-License-Identifier: MIT OR Apache-2.0
"""Maps, and what is computed with them: numbers and colours at once, textures as RON that the program computes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from .nodes import LUMINANCE
from .ron import Ron, form

# A map: a number, a colour, or RON.
Map = Any


class NotCarried(Exception):
    """A texture that rayfront has no counterpart of."""


FOLDED: dict[str, Callable[[float, float], float]] = {
    "Add": lambda x, y: x + y,
    "Subtract": lambda x, y: x - y,
    "Multiply": lambda x, y: x * y,
    "Min": min,
    "Max": max,
}
# How the names of pictures begin whose channels are all the same.
GREY = "grey"
RGB = ("Red", "Green", "Blue")
OPPOSITES = {"Add": "Subtract", "Subtract": "Add"}
COMMUTATIVE = {"Add", "Multiply", "Min", "Max"}
TOO_LARGE = "more nodes than a texture can be made of, which count as often as they are used: bake them"


class Size(NamedTuple):
    """What limits a map. The program has no names for parts of one: what is used twice counts twice."""

    steps: int = 1
    # The texels that are kept at a time while the steps are taken.
    texels: int = 1
    # How deep it is nested in the text.
    levels: int = 1


# The largest that the program takes; of its 64 levels, some are around a map.
LARGEST = Size(1000, 8, 52)


def size(x: Map) -> Size:
    """The size of a map, which is computed once."""
    if not isinstance(x, Ron):
        return Size()
    if x.size is None:
        parts = [x.fields[key] for key in ("a", "b", "by", "of") if key in x.fields]
        if not any(isinstance(part, Ron) for part in parts):
            parts = []  # A picture, or a pattern of two colours.
        elif x.name not in {*FOLDED, "Mix", "Curve"}:
            parts.append(1.0)  # The pattern itself, which mixes the others.
        sizes = [size(part) for part in parts]
        texels = max([1, *(waiting + found.texels for waiting, found in enumerate(sizes))])
        levels = max([0, *(found.levels for found in sizes)])
        x.size = Size(1 + sum(found.steps for found in sizes), texels, 1 + levels)
    return x.size


def is_too_large(x: Map) -> bool:
    """Whether the program refuses a map."""
    return any(found > most for found, most in zip(size(x), LARGEST))


def combined(operation: str, x: Map, y: Map) -> Map:
    """Two maps in one: a number or a colour, if both are."""
    if isinstance(x, Ron) or isinstance(y, Ron):
        if operation == "Multiply" and (one(x) or one(y)):
            by, found = (x, y) if one(x) else (y, x)
            return whole(found) if isinstance(by, tuple) else found  # White makes a colour of a number.
        if operation == "Add" and isinstance(x, (int, float)):
            x, y = y, x
        if operation in OPPOSITES and isinstance(y, (int, float)) and y < 0:
            operation, y = OPPOSITES[operation], -y  # The program takes no negative numbers.
        if operation == "Max" and (below_zero(x) or below_zero(y)):
            return y if below_zero(x) else x  # No texture is below 0.
        if operation == "Subtract" and isinstance(x, (int, float)) and x <= 0:
            return 0.0
        if below_zero(x) or below_zero(y):
            raise NotCarried("a number below 0 beside a texture")
        found = form(operation, a=whole(x), b=whole(y))
        is_deep = size(found).texels > LARGEST.texels and operation in COMMUTATIVE
        return form(operation, a=whole(y), b=whole(x)) if is_deep else found  # What comes first waits for nothing.
    fold = FOLDED[operation]
    if isinstance(x, tuple) or isinstance(y, tuple):
        x, y = (v if isinstance(v, tuple) else (v,) * 3 for v in (x, y))
        return tuple(map(fold, x, y))
    return fold(x, y)


def whole(x: Map) -> Map:
    """A map that can be a colour: one channel of a picture as grey."""
    if not isinstance(x, Ron) or x.name != "Texture" or "channel" not in x.fields:
        return x
    if x.fields["image"].startswith(GREY):  # All its channels are the same.
        return form("Texture", **{key: value for key, value in x.fields.items() if key != "channel"})
    return form("Mix", a=0.0, b=1.0, by=x)


def channel(x: Map, number: int) -> Map:
    """Red (0), green or blue of a map, as a number."""
    if isinstance(x, tuple):
        return x[number]
    if not isinstance(x, Ron):
        return x
    if x.name in {"Texture", "Vertex"}:
        return x if "channel" in x.fields else form(x.name, **x.fields, channel=Ron(RGB[number]))
    return _parts(x, lambda part: channel(part, number))


def grey(x: Map, weights: tuple[float, ...] = LUMINANCE) -> Map:
    """The number that Cycles makes of a colour where one is linked to a number; of vectors, `weights` make the mean."""
    if isinstance(x, tuple):
        return sum(c * weight for c, weight in zip(x, weights))
    if not isinstance(x, Ron):
        return x
    is_linear = x.name == "Add" or x.name == "Multiply" and any(isinstance(x.fields[key], (int, float)) for key in "ab")
    if x.name in {"Texture", "Vertex"} or x.name in FOLDED and not is_linear:
        red, green, blue = (channel(x, number) for number in range(3))
        if red == green == blue:
            return red
        first, second, third = (scaled(part, weight) for part, weight in zip((red, green, blue), weights))
        return form("Add", a=form("Add", a=first, b=second), b=third)
    return _parts(x, lambda part: grey(part, weights))


def joined(parts: list[Map]) -> Map:
    """A colour of three numbers."""
    if not any(isinstance(part, Ron) for part in parts):
        return tuple(parts)
    if all(isinstance(part, Ron) and part.name in {"Texture", "Vertex"} for part in parts):
        rests = [{key: value for key, value in part.fields.items() if key != "channel"} for part in parts]
        if [part.fields.get("channel") for part in parts] == list(RGB) and rests[0] == rests[1] == rests[2]:
            return form(parts[0].name, **rests[0])  # It was only taken apart.
    tints = [tuple(float(number == axis) for axis in range(3)) for number in range(3)]
    red, green, blue = (combined("Multiply", part, tint) for part, tint in zip(parts, tints))
    return combined("Add", combined("Add", red, green), blue)


def scaled(x: Map, factor: float) -> Map:
    """A number times a factor up to 1, as a map that can be a colour."""
    is_channel = isinstance(x, Ron) and x.name in {"Texture", "Vertex"}
    return form("Mix", a=0.0, b=factor, by=x) if is_channel else combined("Multiply", x, factor)


def _parts(x: Ron, convert: Callable[[Map], Map]) -> Ron:
    """A pattern or a combination, of which what it is made of is converted: `a`, `b` and the colours of `stops`."""
    if not x.name:
        return x
    fields = {key: whole(convert(part)) if key in {"a", "b"} else part for key, part in x.fields.items()}
    if "stops" in fields:
        fields["stops"] = [(place, convert(color)) for place, color in fields["stops"]]
    return form(x.name, **fields)


def clamped(x: Map, low: float = 0.0, high: float = 1.0) -> Map:
    """A map between two numbers. One of textures is never negative."""
    x = combined("Min", x, high)
    return x if isinstance(x, Ron) and low <= 0 else combined("Max", x, low)


def share(x: Map) -> Map:
    """A map that says how much of one thing there is, and of another. The program takes maps for this from 0 to 1."""
    return x if isinstance(x, Ron) else clamped(x)


def is_arithmetic(x: Map) -> bool:
    """Whether a map may be beyond 1, of textures that are not."""
    return isinstance(x, Ron) and x.name in {"Add", "Subtract", "Multiply", "Max", "Mix"}


def mixed(x: Map, y: Map, by: Map) -> Map:
    """x where `by` is 0, y where it is 1."""
    if by == 0 or x == y:
        return x
    if by == 1:
        return y
    if isinstance(x, Ron) or isinstance(y, Ron) or isinstance(by, Ron):
        if below_zero(x) or below_zero(y):
            raise NotCarried("a number below 0 beside a texture")
        found = form("Mix", a=whole(x), b=whole(y), by=by)
        is_deep = size(found).texels > LARGEST.texels
        return form("Mix", a=whole(y), b=whole(x), by=combined("Subtract", 1.0, by)) if is_deep else found
    return combined("Add", combined("Multiply", x, 1 - by), combined("Multiply", y, by))


def below_zero(x: Map) -> bool:
    """Whether a map is a number below 0, or a colour of which a part is."""
    return not isinstance(x, Ron) and min(x if isinstance(x, tuple) else (x,)) < 0


def said(value: Any) -> str:
    """A value for a message."""
    return ", ".join(f"{v:.3g}" for v in value) if isinstance(value, tuple) else f"{value:.3g}"


def one(x: Map) -> bool:
    """Whether a map is 1 or white everywhere."""
    return not isinstance(x, Ron) and x in (1, (1, 1, 1))
