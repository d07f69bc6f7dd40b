# SPDX-License-Identifier: MIT OR Apache-2.0
"""Blender's lamps as rayfront's, with the same power."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from mathutils import Matrix, Vector

from .nodes import surface
from .ron import Ron, form, placed, unscaled, upright
from .textures import black_body


def light(ob: Any, place: Matrix, warn: Callable[[str], None]) -> dict[str, Any] | None:
    """The entity of a lamp at a place in Blender's world. None if it gives no light."""
    data, warn_ = ob.data, lambda what: warn(f"lamp {ob.name!r}: {what}")
    # In Cycles, too, these are dark: what has no direction, and areas without one.
    needed = {"POINT": [], "AREA": [0, 1, 2]}.get(data.type, [2])
    if not all(place.col[axis].xyz.length > 0 for axis in needed):
        return None
    power = _tint(data, warn_) * data.energy * 2 ** getattr(data, "exposure", 0.0)
    if not getattr(data, "normalize", True):
        power *= data.area(matrix_world=place)
    if min(power) < 0:
        warn_("it takes light away, where its strength is negative")
        power = [max(p, 0.0) for p in power]
    if data.type == "AREA" and getattr(getattr(data, "cycles", None), "is_portal", False):
        warn_("a portal: it guides no light, and gives none")
        return None
    if max(power) <= 0:
        return None
    if not data.use_shadow or not getattr(getattr(data, "cycles", None), "cast_shadow", True):
        warn_("it casts shadows here")
    bounces = getattr(getattr(data, "cycles", None), "max_bounces", 1024)
    if bounces < 16:
        warn_(f"Max Bounces {bounces}: its light is followed farther")
    extent = 1 if data.type == "AREA" else data.angle if data.type == "SUN" else data.shadow_soft_size
    if ob.visible_camera and data.type != "AREA" and extent > 0:
        warn_("the camera does not see it")
    if extent > 0 and not getattr(getattr(data, "cycles", None), "use_multiple_importance_sampling", True):
        warn_("mirrors and glass show it, also without Multiple Importance")
    fields = KINDS[data.type](ob, tuple(power), place, warn_)
    fields["transform"] = placed(upright(unscaled(place)))
    return fields


def _tint(data: Any, warn: Callable[[str], None]) -> Vector:
    tint = Vector(data.color)
    if getattr(data, "use_temperature", False):
        tint *= Vector(data.temperature_color)
    if not data.use_nodes or not data.node_tree:
        return tint
    source = surface(data.node_tree, "OUTPUT_LIGHT", "Surface")
    if source is None or source.type != "EMISSION":
        if source:
            warn(f"the node {source.node.bl_label}")
        return tint if source else Vector((0, 0, 0))
    color, strength = source.input("Color"), source.input("Strength")
    behind, shade = color.source(), Vector(color.value)
    if behind and behind.type == "BLACKBODY" and not behind.input(0).source():
        behind, shade = None, Vector(black_body(behind.input(0).value))
    for value, linked in ((color, behind), (strength, strength.source())):
        if linked:
            warn(f"what is linked to the {value.socket.name} of its Emission")
    return tint * shade * (strength.value if not strength.source() else 1.0)


def _sun(ob: Any, power: tuple, place: Matrix, warn: Any) -> dict[str, Any]:
    return {"light": form("Directional", irradiance=power, angle_degrees=math.degrees(ob.data.angle))}


def _area(ob: Any, power: tuple, place: Matrix, warn: Any) -> dict[str, Any]:
    data = ob.data
    if data.spread < math.pi - 1e-3:
        warn(f"a spread of {math.degrees(data.spread):.0f} degrees: it shines in all directions")
    scale, height = place.to_scale(), data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
    size = (data.size * abs(scale.x), height * abs(scale.y))
    outline = Ron("Disc") if data.shape in {"DISK", "ELLIPSE"} else None
    seen = True if ob.visible_camera else None
    if seen:
        warn("the camera sees it, and nothing behind it")
    return {"light": form("Area", power_w=power, size_m=size, outline=outline, visible=seen)}


def _point(ob: Any, power: tuple, place: Matrix, warn: Any) -> dict[str, Any]:
    return {"light": form("Point", power_w=power, radius_m=ob.data.shadow_soft_size)}


def _spot(ob: Any, power: tuple, place: Matrix, warn: Any) -> dict[str, Any]:
    data = ob.data
    if data.use_square:
        warn("a square cone: it is round")
    outer = math.cos(data.spot_size / 2)
    inner = math.acos(min(outer + (1 - outer) * data.spot_blend, 1.0))
    across, up, along = (column.length for column in place.to_3x3().col)
    if abs(across - up) > 1e-3 * max(across, up):
        warn("a stretched cone: it is round")
    # A scale makes the cone wider or longer, in Cycles, too.
    width = math.sqrt(across * up) or along
    angles = {
        name: math.degrees(math.atan2(math.sin(angle) * width, math.cos(angle) * along))
        for name, angle in (("inner_degrees", inner), ("outer_degrees", data.spot_size / 2))
    }
    edge, radius = Ron("Smoothstep"), data.shadow_soft_size
    return {"light": form("Spot", power_w=power, **angles, edge=edge, radius_m=radius)}


KINDS = {"SUN": _sun, "AREA": _area, "POINT": _point, "SPOT": _spot}
