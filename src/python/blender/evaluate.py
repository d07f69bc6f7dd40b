# SPDX-License-Identifier: MIT OR Apache-2.0
"""Values of nodes, computed with numpy: of constants, and of worlds in all directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from mathutils import Euler

from .images import pixels
from .nodes import Input, Output, weights

Value = np.ndarray

# The longest chain of nodes, far from the depth at which Python gives up.
DEEPEST = 100
TOO_DEEP = "a ring or a very long chain of nodes"


class Unknown(Exception):
    """A node that cannot be computed here."""


class Evaluator:
    """Computes outputs in directions, an array whose last axis is x, y and z; None: for constants.

    Colours and vectors have an axis of three, the last one; numbers one of one.
    """

    def __init__(self, directions: Value | None):
        self.directions = directions
        self.known: dict[Any, Value] = {}
        self.open: list[Any] = []

    def input(self, socket: Input) -> Value:
        source = socket.source()
        wide = socket.socket.type in {"RGBA", "VECTOR", "ROTATION"}
        if source is None:
            return np.atleast_1d(np.array(socket.value, float))
        found = self.output(source)
        if not wide and found.shape[-1] == 3:
            return found @ np.array(weights(source.socket))[:, None]
        return np.broadcast_to(found, (*found.shape[:-1], 3)) if wide else found

    def output(self, source: Output) -> Value:
        key = source.socket.as_pointer(), source.groups
        if key not in self.known:
            if source.type not in NODES:
                raise Unknown(f"the node {source.node.bl_label}")
            if key in self.open or len(self.open) >= DEEPEST:
                raise Unknown(TOO_DEEP)
            self.open.append(key)
            try:
                self.known[key] = np.asarray(NODES[source.type](self, source), float)
            finally:
                self.open.pop()
        return self.known[key]

    def inputs(self, source: Output) -> list[Value]:
        return [self.input(i) for i in source.inputs()]

    def named(self, source: Output, *names: str) -> list[Value]:
        return [self.input(source.input(name)) for name in names]

    def _plain(self, source: Output) -> Any:
        value = source.socket.default_value
        return np.array(value[:3]) if hasattr(value, "__len__") else np.array([value])

    def _place(self, source: Output) -> Value:
        if self.directions is None:
            raise Unknown("coordinates")
        name = source.socket.name
        if name in {"Generated", "Object", "Position"} and not getattr(source.node, "object", None):
            return self.directions
        if name in {"Normal", "Incoming"}:
            return -self.directions
        raise Unknown(f"the coordinates {name}")

    def _mapping(self, source: Output) -> Value:
        at, rotation, scale = self.named(source, "Vector", "Rotation", "Scale")
        if source.input("Rotation").source():
            raise Unknown("a Mapping with a linked Rotation")
        turn, kind = np.array(Euler(rotation).to_matrix()), source.node.vector_type
        if kind == "POINT":
            return (at * scale) @ turn.T + self.input(source.input("Location"))
        if kind == "TEXTURE":
            return (at - self.input(source.input("Location"))) @ turn / np.where(scale == 0, 1, scale)
        if kind == "VECTOR":
            return (at * scale) @ turn.T
        raise Unknown(f"a Mapping of the type {kind.title()}")

    def _separate(self, source: Output) -> Value:
        if getattr(source.node, "mode", "RGB") != "RGB":
            raise Unknown(f"the node {source.node.bl_label} of the mode {source.node.mode}")
        number = list(source.node.outputs).index(source.socket)
        return self.inputs(source)[0][..., number : number + 1]

    def _combine(self, source: Output) -> Value:
        parts = np.concatenate(np.broadcast_arrays(*self.inputs(source)), axis=-1)
        mode = getattr(source.node, "mode", "RGB")
        if mode == "HSL":
            raise Unknown("the node Combine Color of the mode HSL")
        return from_hsv(parts) if mode == "HSV" else parts

    def _ramp(self, source: Output) -> Value:
        ramp, of = source.node.color_ramp, self.inputs(source)[0]
        part = slice(3, 4) if source.socket.name == "Alpha" else slice(0, 3)
        if of.size <= 3:
            return np.array(ramp.evaluate(float(of.ravel()[0]))[part])
        table = np.array([ramp.evaluate(t / 1023)[part] for t in range(1024)])
        if ramp.interpolation == "CONSTANT":
            return table[np.clip(of[..., 0] * 1023, 0, 1023).astype(int)]
        return np.stack([np.interp(of[..., 0], np.linspace(0, 1, 1024), c) for c in table.T], axis=-1)

    def _math(self, source: Output) -> Value:
        operation, (a, b, c) = source.node.operation, (self.inputs(source) * 3)[:3]
        if operation not in OPERATIONS:
            raise Unknown(f"the node Math of the operation {operation.title()}")
        with np.errstate(all="ignore"):
            found = np.nan_to_num(OPERATIONS[operation](a, b, c))
        return np.clip(found, 0, 1) if source.node.use_clamp else found

    def _vectors(self, source: Output) -> Value:
        operation, (a, b) = source.node.operation, (self.inputs(source) * 2)[:2]
        length = lambda v: np.linalg.norm(v, axis=-1, keepdims=True)  # noqa: E731
        found = {
            "ADD": lambda: a + b, "SUBTRACT": lambda: a - b, "MULTIPLY": lambda: a * b, "SCALE": lambda: a * b,
            "NORMALIZE": lambda: a / np.maximum(length(a), 1e-12), "LENGTH": lambda: length(a),
            "DOT_PRODUCT": lambda: (a * b).sum(axis=-1, keepdims=True), "ABSOLUTE": lambda: np.abs(a),
            "MULTIPLY_ADD": lambda: a * b + self.inputs(source)[2],
        }  # fmt: skip
        if operation not in found:
            raise Unknown(f"the node Vector Math of the operation {operation.title()}")
        return found[operation]()

    def _range(self, source: Output) -> Value:
        node = source.node
        if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
            raise Unknown("the node Map Range that is not linear")
        value, first, last, low, high = self.inputs(source)
        with np.errstate(all="ignore"):
            part = np.nan_to_num((value - first) / (last - first), posinf=0, neginf=0)
        return low + (np.clip(part, 0, 1) if node.clamp else part) * (high - low)

    def _mix(self, source: Output) -> Value:
        node = source.node
        by, a, b = (self.inputs(source) * 2)[:3]
        if source.type == "MIX" and node.data_type not in {"RGBA", "FLOAT"}:
            raise Unknown(f"the node Mix of the type {node.data_type.title()}")
        by = np.clip(by, 0, 1) if getattr(node, "clamp_factor", True) else by
        blend = node.blend_type if source.type == "MIX_RGB" or node.data_type == "RGBA" else "MIX"
        if blend not in BLENDS:
            raise Unknown(f"the node {node.bl_label} of the type {blend.title()}")
        found = BLENDS[blend](a, b, by)
        clamps = getattr(node, "clamp_result", False) or getattr(node, "use_clamp", False)
        return np.clip(found, 0, 1) if clamps else found

    def _gamma(self, source: Output) -> Value:
        color, gamma = self.inputs(source)
        return np.where(color > 0, np.maximum(color, 1e-30) ** gamma, color)

    def _contrast(self, source: Output) -> Value:
        color, bright, contrast = self.inputs(source)
        return np.maximum(color * (1 + contrast) + bright - contrast / 2, 0)

    def _hue(self, source: Output) -> Value:
        hue, saturation, value, by, color = self.inputs(source)
        h, s, v = np.split(to_hsv(color), 3, axis=-1)
        parts = np.broadcast_arrays((h + hue + 0.5) % 1, np.clip(s * saturation, 0, 1), v * value)
        return color + by * (np.maximum(from_hsv(np.concatenate(parts, axis=-1)), 0) - color)

    def _curves(self, source: Output) -> Value:
        by, color = self.inputs(source)
        mapping = source.node.mapping
        mapping.initialize()
        after = curved(mapping, mapping.curves[3], color)
        found = [curved(mapping, mapping.curves[number], after[..., number]) for number in range(3)]
        return color + by * (np.stack(found, axis=-1) - color)

    def _invert(self, source: Output) -> Value:
        by, color = self.inputs(source)
        return color + by * (1 - 2 * color)

    def _gradient(self, source: Output) -> Value:
        vector = source.input("Vector")
        at = self.input(vector) if vector.source() else self._generated()
        x, y, z = (at[..., number : number + 1] for number in range(3))
        ball = np.maximum(0.999999 - np.sqrt(x * x + y * y + z * z), 0)
        found = {
            "LINEAR": x, "QUADRATIC": np.maximum(x, 0) ** 2, "DIAGONAL": (x + y) / 2,
            "EASING": 3 * np.clip(x, 0, 1) ** 2 - 2 * np.clip(x, 0, 1) ** 3,
            "RADIAL": np.arctan2(y, x) / (2 * math.pi) + 0.5, "SPHERICAL": ball, "QUADRATIC_SPHERE": ball**2,
        }  # fmt: skip
        return np.clip(found[source.node.gradient_type], 0, 1)

    def _generated(self) -> Value:
        if self.directions is None:
            raise Unknown("coordinates")
        return self.directions

    def _environment(self, source: Output) -> Value:
        image = source.node.image
        if image is None or not min(image.size):
            raise Unknown("an Environment Texture without a picture")
        vector = source.input("Vector")
        x, y, z = np.moveaxis(self.input(vector) if vector.source() else self._generated(), -1, 0)
        if source.node.projection == "MIRROR_BALL":
            length = np.sqrt(np.maximum(x * x + y * y + z * z, 1e-20))
            wide = np.maximum(2 * np.sqrt(np.maximum(0.5 * (1 - y / length), 0)), 1e-9)
            return texels(image, 0.5 * (x / length / wide + 1), 0.5 * (z / length / wide + 1))
        return texels(image, 0.5 - np.arctan2(y, x) / (2 * math.pi), np.arctan2(z, np.hypot(x, y)) / math.pi + 0.5)


def curved(mapping: Any, curve: Any, values: Value) -> Value:
    """Values by a curve, which goes straight on beyond its first and last points."""
    places = [point.location[0] for point in curve.points]
    low, high = min(places), max(places)
    inner = np.linspace(low, high, 1025)
    table = [mapping.evaluate(curve, t) for t in inner]
    before = table[0] - mapping.evaluate(curve, low - 1)
    after = mapping.evaluate(curve, high + 1) - table[-1]
    beyond = np.minimum(values - low, 0) * before + np.maximum(values - high, 0) * after
    return np.interp(values, inner, table) + beyond


def texels(image: Any, u: Value, v: Value) -> Value:
    """A picture's colours, bilinearly; it goes on to the left and right."""
    space = image.colorspace_settings.name
    rows = pixels(image)[::-1, :, :3].astype(np.float32)
    is_coded = not image.is_float  # Else Blender has made them linear.
    if is_coded and space == "sRGB":
        rows = np.where(rows < 0.04045, rows / 12.92, ((np.maximum(rows, 0) + 0.055) / 1.055) ** 2.4)
    elif is_coded and space not in {"Non-Color", "Linear Rec.709"}:
        raise Unknown(f"the colour space {space}")
    height, width = rows.shape[:2]
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    left, low = np.floor(x).astype(int), np.floor(y).astype(int)
    across, up = (x - left)[..., None], (y - low)[..., None]
    right, high = (left + 1) % width, np.minimum(low + 1, height - 1)
    left %= width
    below = rows[low, left] * (1 - across) + rows[low, right] * across
    return below * (1 - up) + (rows[high, left] * (1 - across) + rows[high, right] * across) * up


def to_hsv(color: Value) -> Value:
    high, low = color.max(axis=-1), color.min(axis=-1)
    span = np.where(high > low, high - low, 1)
    r, g, b = np.moveaxis((high[..., None] - color) / span[..., None], -1, 0)
    hue = np.where(color[..., 0] == high, b - g, np.where(color[..., 1] == high, 2 + r - b, 4 + g - r)) / 6 % 1
    saturation = np.where(high > 0, (high - low) / np.where(high > 0, high, 1), 0)
    return np.stack([np.where(high > low, hue, 0), saturation, high], axis=-1)


def from_hsv(hsv: Value) -> Value:
    hue, saturation, value = (hsv[..., number, None] for number in range(3))
    pure = np.clip(np.abs((hue * 6 + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    return value * (1 + saturation * (pure - 1))


OPERATIONS: dict[str, Callable] = {
    "ADD": lambda a, b, c: a + b, "SUBTRACT": lambda a, b, c: a - b, "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: np.where(b == 0, 0, a / b), "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: np.power(a, b), "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "ABSOLUTE": lambda a, b, c: np.abs(a), "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b), "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0, "SINE": lambda a, b, c: np.sin(a), "COSINE": lambda a, b, c: np.cos(a),
    "ARCSINE": lambda a, b, c: np.arcsin(np.clip(a, -1, 1)), "ARCCOSINE": lambda a, b, c: np.arccos(np.clip(a, -1, 1)),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b), "FLOOR": lambda a, b, c: np.floor(a),
    "FRACT": lambda a, b, c: a - np.floor(a), "EXPONENT": lambda a, b, c: np.exp(a),
    "RADIANS": lambda a, b, c: np.radians(a), "DEGREES": lambda a, b, c: np.degrees(a),
}  # fmt: skip
BLENDS: dict[str, Callable] = {
    "MIX": lambda a, b, t: a + t * (b - a), "ADD": lambda a, b, t: a + t * b, "SUBTRACT": lambda a, b, t: a - t * b,
    "MULTIPLY": lambda a, b, t: a * (1 + t * (b - 1)), "SCREEN": lambda a, b, t: 1 - (1 - t * b) * (1 - a),
    "DARKEN": lambda a, b, t: a + t * (np.minimum(a, b) - a), "LIGHTEN": lambda a, b, t: a + t * (np.maximum(a, b) - a),
    "DIFFERENCE": lambda a, b, t: a + t * (np.abs(a - b) - a),
}  # fmt: skip
NODES: dict[str, Callable[[Evaluator, Output], Value]] = {
    "RGB": Evaluator._plain, "VALUE": Evaluator._plain, "TEX_COORD": Evaluator._place, "NEW_GEOMETRY": Evaluator._place,
    "MAPPING": Evaluator._mapping, "SEPXYZ": Evaluator._separate, "SEPARATE_COLOR": Evaluator._separate,
    "COMBXYZ": Evaluator._combine, "COMBINE_COLOR": Evaluator._combine, "VALTORGB": Evaluator._ramp,
    "MATH": Evaluator._math, "VECT_MATH": Evaluator._vectors, "MAP_RANGE": Evaluator._range, "MIX": Evaluator._mix,
    "MIX_RGB": Evaluator._mix, "GAMMA": Evaluator._gamma, "BRIGHTCONTRAST": Evaluator._contrast,
    "HUE_SAT": Evaluator._hue, "CURVE_RGB": Evaluator._curves, "INVERT": Evaluator._invert,
    "RGBTOBW": lambda of, source: of.inputs(source)[0] @ np.array(weights(source.node.inputs[0]))[:, None],
    "TEX_GRADIENT": Evaluator._gradient, "TEX_ENVIRONMENT": Evaluator._environment,
}  # fmt: skip
