# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is inside of bodies: volumes and subsurface scattering, as the `volume` of rayfront's material."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .nodes import Output
from .textures import Maps

Rgb = Sequence[float]

# The most shaders of one volume, each of which counts as often as it is added.
MOST_PARTS = 1000


def of_volume(source: Output, maps: Maps) -> dict[str, Any]:
    """The `volume` of Blender's volume shaders with one density."""
    scattering, absorption, moment = [0.0] * 3, [0.0] * 3, 0.0
    pending, count = [source], 0
    while pending:
        part, count = pending.pop(), count + 1
        if count > MOST_PARTS:
            raise ValueError(f"{maps.user}: a sum of more than {MOST_PARTS} volumes")
        if part.type == "ADD_SHADER":
            pending += [s for s in (part.input(i).source() for i in range(2)) if s]
            continue
        if part.type not in {"VOLUME_ABSORPTION", "VOLUME_SCATTER", "PRINCIPLED_VOLUME"}:
            maps.warn(f"the node {part.node.bl_label}")
            continue
        density, color = maps.constant(part.input("Density")), maps.constant(part.input("Color"))
        for c in range(3):
            if part.type == "VOLUME_ABSORPTION":
                absorption[c] += density * max(1 - color[c], 0)
            else:
                scattering[c] += density * color[c]
        if part.type == "VOLUME_SCATTER":
            phase = getattr(part.node, "phase", "HENYEY_GREENSTEIN")  # Blender 4.2 has this one alone.
            if phase != "HENYEY_GREENSTEIN":
                maps.warn(f"the phase function {phase.replace('_', ' ').title()}")
        if part.type == "PRINCIPLED_VOLUME":
            tint = maps.constant(part.input("Absorption Color"))
            for c in range(3):
                absorption[c] += density * max(1 - color[c], 0) * max(1 - math.sqrt(max(tint[c], 0)), 0)
            for name in ("Emission Strength", "Blackbody Intensity"):
                if part.input(name).source() or part.input(name).value > 0:
                    maps.warn(f"{name} of a volume")
        if part.has("Anisotropy"):
            moment += maps.constant(part.input("Anisotropy")) * density * max(color)
    anisotropy = moment / max(scattering) if max(scattering) > 0 else 0.0
    return volume([s + a for s, a in zip(scattering, absorption)], scattering, anisotropy)


def below_subsurface(color: Rgb, weight: float = 1.0, brightest: float = 1.0) -> tuple[float, Rgb]:
    """The part that a surface lets through, and the colour of what is below it, for a Subsurface Weight.

    In Cycles a surface reflects d = (1 - weight) color, lets in the weight, and lets out whatever comes back. In rayfront
    it lets as much out as in, a part t: if x comes back from below, t² x / (1 - d x) leaves, for the rest is thrown back.
    Here x is such that as much leaves as in Cycles. It is at most 1, so t should be large, and with it what the surface
    has as its own colour: `color` over `brightest`.
    """
    weight = min(max(weight, 0.0), 1.0)
    through, below = 1 - (1 - weight) * brightest, []
    for c in color:
        c = min(max(c, 0.0), 1.0)
        # The mean over a ball by Cycles' walk, which gives less towards a viewer straight ahead and more along the surface.
        leaving = weight * c / (1.09 - 0.12 * c)
        below.append(min(leaving / (through**2 + (1 - weight) * c * leaving), 1.0) if through > 0 else 1.0)
    return through, tuple(below)


def of_subsurface(color: Rgb, below: Rgb, radius: Rgb, anisotropy: float) -> dict[str, Any]:
    """The `volume` of Cycles' random walk: `below` is the colour of all light that comes back, `radius` in metres.

    `color` is that of the shader, by which Cycles measures the radius.

    The fits are those of Cycles (Christensen and Burley 2015; Chiang and others 2016).
    """
    extinction, scattering, anisotropy = [], [], min(max(anisotropy, -0.9), 0.9)
    for a, b, r in zip(color, below, radius):
        a, b = (min(max(c, 0.0), 0.999) for c in (a, b))
        single = 1 - math.exp(-5.09406 * b + 2.61188 * b**2 - 4.31805 * b**3)
        shape = 1.9 - a + 3.5 * (a - 0.8) ** 2
        total = 4 * math.pi / max(r * shape, 1e-6)
        # What is scattered forwards goes on as if it were not: so the colour stays.
        scattering.append(total * single / (1 - anisotropy))
        extinction.append(total * (1 - single) + scattering[-1])
    return volume(extinction, scattering, anisotropy)


def volume(extinction: Rgb, scattering: Rgb, anisotropy: float) -> dict[str, Any]:
    """The fields of a medium with these coefficients, in 1/m."""
    densest = max(extinction)
    if densest <= 0:
        return {}
    fields: dict[str, Any] = {
        "attenuation_color": tuple(math.exp(-e / densest) for e in extinction),
        "attenuation_distance_m": 1 / densest,
    }
    if max(scattering) > 0:
        fields["multiscatter_color"] = tuple(
            multiscatter_color(s / e if e > 0 else 0.0) for s, e in zip(scattering, extinction)
        )
        fields["scatter_anisotropy"] = min(max(anisotropy, -0.99), 0.99)
    return fields


def multiscatter_color(albedo: float) -> float:
    """The colour after many scatterings for which rayfront finds this albedo of one (Kulla and Conty 2017)."""
    low, high = 0.0, 1.0
    for _ in range(40):
        c = (low + high) / 2
        root = 4.09712 + 4.20863 * c - math.sqrt(9.59217 + 41.6808 * c + 17.7126 * c * c)
        low, high = (c, high) if 1 - root * root < albedo else (low, c)
    return (low + high) / 2
