# SPDX-License-Identifier: MIT OR Apache-2.0
"""Blender's world as rayfront's environment."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mathutils import Euler, Matrix, Vector

from . import atmosphere, exr
from .arithmetic import said
from .coordinates import MeshSpace
from .evaluate import Evaluator, Unknown
from .images import Images
from .nodes import Input, Output, adjusted, leads_to, surface
from .ron import TO_Y_UP, Ron, form, matrix, placed
from .textures import Maps

# Nodes whose light rayfront has.
SURROUNDINGS = {"TEX_ENVIRONMENT", "TEX_SKY"}
# Skies that are computed from the air, by the names of Blender 4 and 5.
NISHITA = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
# How bright skies by Hosek and Wilkie are, over those by Preetham: 0.13 at the zenith, 0.25 near the horizon.
HOSEK_WILKIE = 0.2


class Surroundings(NamedTuple):
    """The entities that give light, their colour if they have one, and the colour that the camera sees in their place."""

    entities: tuple[dict[str, Any], ...] = ()
    color: tuple[float, ...] | None = None
    backdrop: tuple[float, ...] | None = None


def surroundings(world: Any, images: Images, warn: Callable[[str], None]) -> Surroundings:
    """The surroundings of a scene."""
    if world is None:
        return Surroundings()
    maps = Maps(images, MeshSpace(), f"world {world.name!r}", warn)
    found = _surroundings(world, images, maps)
    rays = getattr(world, "cycles_visibility", None)
    kinds = ("diffuse", "glossy", "transmission", "scatter")
    hidden = [name for name in kinds if rays and not getattr(rays, name)]
    if len(hidden) == len(kinds) and (found.color or found.backdrop):
        found = Surroundings(backdrop=found.backdrop or found.color)
    elif hidden and found.entities:
        maps.warn(f"it is not hidden from rays of the kind {', '.join(hidden)}")
    return found if not rays or rays.camera else found._replace(backdrop=(0.0, 0.0, 0.0))


def _surroundings(world: Any, images: Images, maps: Maps) -> Surroundings:
    if not world.use_nodes or not world.node_tree:
        return _plain(tuple(world.color))
    if surface(world.node_tree, "OUTPUT_WORLD", "Volume"):
        maps.warn("a volume")
    source = surface(world.node_tree, "OUTPUT_WORLD", "Surface")
    if source is None:
        return Surroundings()
    if source.type == "MIX_SHADER":
        by = source.input(0).source()
        if by and by.type == "LIGHT_PATH" and by.socket.name == "Is Camera Ray":
            seen = source.input(2).source()
            return _background(source.input(1).source(), images, maps)._replace(backdrop=_seen(seen, maps))
    return _background(source, images, maps)


def _seen(source: Output | None, maps: Maps) -> tuple[float, ...]:
    """The colour of a background that lights nothing."""
    if source is None:
        return (0.0, 0.0, 0.0)
    if source.type != "BACKGROUND" or isinstance(maps.color(source.input("Color")), Ron):
        raise ValueError(f"{maps.user}: what only the camera sees is a {source.node.bl_label}, and no plain colour")
    strength = maps.constant(source.input("Strength"))
    return tuple(c * strength for c in maps.color(source.input("Color")))


def _background(source: Output | None, images: Images, maps: Maps) -> Surroundings:
    if source is None:
        return Surroundings()
    if source.type not in {"BACKGROUND", "EMISSION"}:
        raise ValueError(f"{maps.user}: the node {source.node.bl_label}, which rayfront does not have in a world")
    color, strength = source.input("Color"), source.input("Strength")
    behind, reason = color.source(), None
    if (behind or strength.source()) and (strength.source() or not _is_carried(behind)):
        try:
            return _baked(color, strength, images)
        except Unknown as unknown:
            reason = unknown
    strength = maps.constant(strength)
    while behind and behind.type not in SURROUNDINGS and leads_to(behind, SURROUNDINGS):
        through = next(i for i in adjusted(behind) if leads_to(i.source(), SURROUNDINGS))
        maps.warn(f"the node {behind.node.bl_label}: its {through.socket.name} goes through unchanged")
        behind = through.source()
    if behind and behind.type == "TEX_ENVIRONMENT":
        if str(reason).startswith("the coordinates"):
            maps.warn(f"{reason} of its picture: it lies as by Generated")
        return Surroundings((_picture(behind, strength, images, maps),))
    if behind and behind.type == "TEX_SKY":
        return Surroundings(_sky(behind.node, strength, images, maps))
    kept: list[str] = []
    value = Maps(images, MeshSpace(), maps.user, kept.append).color(color)
    if not isinstance(value, Ron):
        for what in kept:
            maps.warn(what.removeprefix(f"{maps.user}: "))
    else:
        value = color.value
        maps.warn(f"{reason}: the Color of the Background has the plain {said(value)}, without what is linked to it")
    return _plain(tuple(c * strength for c in value))


def _is_carried(source: Output) -> bool:
    """True for pictures of surroundings and skies as rayfront has them: equirectangular, and turned only."""
    if source.type != "TEX_ENVIRONMENT":
        return source.type == "TEX_SKY"
    if not source.node.image:
        return True  # An error.
    by = source.input("Vector").source()
    if by and by.type == "MAPPING" and by.node.vector_type in {"POINT", "TEXTURE", "VECTOR"}:
        values = [by.input(name) for name in ("Location", "Rotation", "Scale")]
        moves = max(map(abs, values[0].value)) > 1e-4 or max(abs(s - 1) for s in values[2].value) > 1e-4
        if moves or any(value.source() for value in values):
            return False
        by = by.input("Vector").source()
    is_plain = by is None or by.type == "TEX_COORD" and by.socket.name in {"Generated", "Object"} and not by.node.object
    return source.node.projection == "EQUIRECTANGULAR" and is_plain


def _baked(color: Input, strength: Input, images: Images) -> Surroundings:
    """Nodes of a world as a picture, or as one colour. An `Unknown` if they cannot be computed."""
    sizes = [(1024, 512), *_sizes(color.socket.id_data)]
    width, height = (min(max(sides), most) for sides, most in zip(zip(*sizes), (4096, 2048)))
    around = math.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    up = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    level, rise = np.cos(up), np.sin(up) + 0 * around
    of = Evaluator(np.stack([level * np.cos(around), level * np.sin(around), rise], axis=-1))
    light = np.maximum(of.input(color) * of.input(strength), 0)
    if light.ndim == 1:
        return _plain(tuple(float(c) for c in light))
    name = "world.exr"
    exr.write(os.path.join(images.folder, name), np.broadcast_to(light, (height, width, 3)).astype(np.float32))
    return Surroundings((_around(name, 1.0, Matrix.Identity(3)),))


def _sizes(tree: Any) -> list[tuple[int, int]]:
    """The sizes of the pictures of a tree and its groups."""
    sizes = []
    for node in tree.nodes:
        if node.type == "TEX_ENVIRONMENT" and node.image:
            sizes.append(tuple(node.image.size))
        elif node.type == "GROUP" and node.node_tree:
            sizes += _sizes(node.node_tree)
    return sizes


def _plain(color: tuple[float, ...]) -> Surroundings:
    return Surroundings(({"light": form("Environment", radiance=color)},) if max(color) > 0 else (), color)


def _picture(source: Output, strength: float, images: Images, maps: Maps) -> dict[str, Any]:
    node = source.node
    if not node.image:
        raise ValueError(f"{maps.user}: an Environment Texture has no picture")
    if node.projection != "EQUIRECTANGULAR":
        maps.warn("a mirror ball: its picture counts as equirectangular")
    return _around(images.file(node.image, maps.user), strength, _turn(source.input("Vector"), maps))


def _around(file: str, strength: float, turn: Matrix) -> dict[str, Any]:
    # Blender's pictures have their middle along +X, rayfront's along -Z, which is Blender's +Y.
    axes = TO_Y_UP.to_3x3()
    m = axes @ turn.transposed() @ Matrix.Rotation(-math.pi / 2, 3, "Z") @ axes.transposed()
    return {"light": form("Environment", image=file, radiance=strength), "transform": matrix(m.to_4x4())}


def _turn(vector: Input, maps: Maps) -> Matrix:
    source = vector.source()
    if source is None or source.type == "TEX_COORD":
        return Matrix.Identity(3)
    if source.type != "MAPPING":
        maps.warn(f"the node {source.node.bl_label}")
        return Matrix.Identity(3)
    if any(source.input(name).source() for name in ("Location", "Rotation", "Scale")):
        maps.warn("a Mapping with linked values")
    if (
        max(abs(s - 1) for s in source.input("Scale").value) > 1e-4
        or max(map(abs, source.input("Location").value)) > 1e-4
    ):
        maps.warn("a Mapping that does more than to turn")
    turn = Euler(source.input("Rotation").value).to_matrix()
    return turn.transposed() if source.node.vector_type == "TEXTURE" else turn


def _sky(node: Any, strength: float, images: Images, maps: Maps) -> tuple[dict[str, Any], ...]:
    name, disc = "sky.exr", False
    if node.sky_type in NISHITA:
        elevation, azimuth = _folded(node.sun_elevation, node.sun_rotation)
        altitude, disc = node.altitude / 1000, node.sun_disc
        haze = node.dust_density if hasattr(node, "dust_density") else node.aerosol_density
        air = atmosphere.Air(node.air_density, haze, node.ozone_density)
        picture = atmosphere.sky(elevation, altitude, air)
        if node.sky_type == "MULTIPLE_SCATTERING":
            maps.warn("light that the air scatters more than once")
    else:
        if "Vector" in node.inputs and node.inputs["Vector"].is_linked:
            maps.warn("what is linked to the Vector of a Sky Texture")
        if node.sky_type != "PREETHAM":
            maps.warn("the Hosek / Wilkie sky: that of Preetham stands in, as bright on the whole")
            strength *= HOSEK_WILKIE
        x, y, z = Vector(node.sun_direction).normalized()
        elevation, azimuth = math.asin(max(0.0, min(1.0, z))), math.atan2(x, y)
        picture = atmosphere.preetham(elevation, node.turbidity)
    exr.write(os.path.join(images.folder, name), picture)
    turn = Matrix.Rotation(-azimuth, 4, "Y")
    around = {"light": form("Environment", image=name, radiance=strength), "transform": matrix(turn)}
    if not disc:
        return (around,)
    light = tuple(c * strength * node.sun_intensity for c in atmosphere.sun(elevation, altitude, air))
    if max(light) <= 0:
        return (around,)
    maps.warn("the Sun Disc: it gives its light, and is seen in mirrors and through glass, but not by the camera")
    toward = Vector((0, math.cos(elevation), math.sin(elevation)))
    place = Matrix.Rotation(-azimuth, 4, "Z") @ toward.to_track_quat("Z", "X").to_matrix().to_4x4()
    sun = form("Directional", irradiance=light, angle_degrees=math.degrees(node.sun_size))
    return around, {"light": sun, "transform": placed(place)}


def _folded(elevation: float, azimuth: float) -> tuple[float, float]:
    """An elevation between nadir and zenith."""
    elevation = math.remainder(elevation, 2 * math.pi)
    if abs(elevation) > math.pi / 2:
        return math.copysign(math.pi, elevation) - elevation, azimuth + math.pi
    return elevation, azimuth
