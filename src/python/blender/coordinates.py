# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where textures lie: Blender's texture coordinates and mappings as those of rayfront."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from mathutils import Euler, Quaternion, Vector

from .nodes import Input
from .ron import Ron


class MeshSpace(NamedTuple):
    """What materials need to know of a mesh: its UV maps, the first being the active one, and its texture space."""

    uv_maps: tuple[str, ...] = ()
    location: tuple[float, float, float] = (0, 0, 0)
    size: tuple[float, float, float] = (1, 1, 1)

    @classmethod
    def of(cls, mesh: Any) -> MeshSpace:
        layers = sorted(mesh.uv_layers, key=lambda layer: not layer.active_render)
        return cls(tuple(layer.name for layer in layers[:2]), tuple(mesh.texspace_location), tuple(mesh.texspace_size))


class Coordinates:
    """rotate(coordinates · scale) + offset, of a space of rayfront: `Uv`, `Uv1` or `Object`."""

    def __init__(self, space: str):
        self.space = space
        # UV as Blender has it: rayfront's v goes downwards.
        flat = space != "Object"
        self.scale = Vector((1, -1, 1)) if flat else Vector((1, 1, 1))
        self.offset = Vector((0, 1, 0)) if flat else Vector((0, 0, 0))
        self.rotation = Euler((0, 0, 0))

    def mapped(self, location: Vector, rotation: Euler, scale: Vector) -> None:
        """Adds a mapping of points on top."""
        self.scale *= scale
        self.offset = rotation.to_matrix() @ (self.offset * scale) + location
        self.rotation = rotation

    def turned(self, rotation: Quaternion) -> None:
        """Adds a rotation on top."""
        self.offset.rotate(rotation)
        self.rotation = (rotation @ self.rotation.to_quaternion()).to_euler()

    def pattern(self, scale: float) -> dict[str, Any]:
        """The fields of a pattern that is `scale` times as fine."""
        fields: dict[str, Any] = {"space": Ron(self.space), "scale": self.scale * scale}
        if any(abs(angle) > 1e-6 for angle in self.rotation):
            fields["rotate_degrees"] = tuple(math.degrees(angle) for angle in self.rotation)
        if self.offset.length > 1e-9:
            fields["offset"] = self.offset * scale
        return fields

    def picture(self) -> dict[str, Any]:
        """The fields of a picture, whose v goes downwards as well."""
        fields: dict[str, Any] = {}
        scale = (self.scale.x, -self.scale.y)
        if max(abs(s - 1) for s in scale) > 1e-6:
            fields["scale"] = scale
        if abs(self.rotation.z) > 1e-6:
            fields["rotation_degrees"] = math.degrees(self.rotation.z)
        offset = (self.offset.x, 1 - self.offset.y)
        if max(map(abs, offset)) > 1e-9:
            fields["offset"] = offset
        if self.space == "Uv1":
            fields["uv_set"] = 1
        return fields


def coordinates(socket: Input, mesh: MeshSpace, default: str, warn: Callable[[str], None]) -> Coordinates | None:
    """The coordinates that come into a `Vector` input. None, with a warning, if rayfront does not have them."""
    source = socket.source()
    mapping = None
    if source and source.type == "MAPPING":
        mapping = source
        source = source.input("Vector").source()
        if source is None:
            return _unknown("a Mapping without coordinates", warn)
    space = _space(source, mesh, default, warn)
    if not space or not mapping:
        return space
    values = [mapping.input(name) for name in ("Location", "Rotation", "Scale")]
    if any(value.source() for value in values):
        return _unknown("a Mapping with linked values", warn)
    location, rotation, scale = Vector(values[0].value), Euler(values[1].value), Vector(values[2].value)
    kind = mapping.node.vector_type
    if kind == "TEXTURE":
        uniform = max(scale) - min(scale) < 1e-6
        if 0 in scale or not (uniform or max(map(abs, rotation)) < 1e-6):
            return _unknown("a Mapping of a texture that is turned and stretched", warn)
        scale = Vector(1 / s for s in scale)
        back = rotation.to_matrix().transposed()
        location, rotation = back @ (-location * scale), back.to_euler()
    elif kind != "POINT":
        return _unknown(f"a Mapping of the type {kind.title()}", warn)
    if space.space != "Object" and max(map(abs, rotation[:2])) > 1e-6:
        return _unknown("a Mapping that turns UV out of its plane", warn)
    space.mapped(location, rotation, scale)
    return space


def _space(source: Any, mesh: MeshSpace, default: str, warn: Callable[[str], None]) -> Coordinates | None:
    name = source.socket.name if source and source.type == "TEX_COORD" else default
    if source and source.type == "UVMAP":
        name = "UV"
        wanted = source.node.uv_map
        if wanted in mesh.uv_maps[1:]:
            return Coordinates("Uv1")
        if wanted and wanted not in mesh.uv_maps:
            return _unknown(f"the UV map {wanted!r}", warn)
    elif source and source.type != "TEX_COORD":
        return _unknown(f"coordinates by the node {source.node.bl_label}", warn)
    if name == "UV":
        return Coordinates("Uv")
    if name == "Object" and not (source and source.type == "TEX_COORD" and source.node.object):
        return Coordinates("Object")
    if name == "Generated" and all(mesh.size):
        found = Coordinates("Object")
        half = Vector(1 / (2 * size) for size in mesh.size)
        found.scale, found.offset = half, Vector((0.5, 0.5, 0.5)) - Vector(mesh.location) * half
        return found
    return _unknown(f"the coordinates {name}", warn)


def _unknown(what: str, warn: Callable[[str], None]) -> None:
    warn(what)
