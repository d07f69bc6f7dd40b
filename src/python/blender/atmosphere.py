# SPDX-License-Identifier: MIT OR Apache-2.0
"""A clear sky like that of Blender's Sky Texture: sunlight that air and haze scatter once, and that ozone absorbs.

Nishita and others, "Display of the earth taking into account atmospheric scattering", SIGGRAPH 1993. The sun's spectrum is
that of ASTM E-490, the eye's are the fits of Wyman and others (JCGT 2013); coefficients are near those of Bruneton and
Neyret (2008), fitted to skies that Cycles has rendered. Lengths are in km, coefficients in 1/km.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

GROUND, TOP = 6360.0, 6420.0
# Scale heights of air and haze.
HEIGHTS = np.array([8.0, 1.2])
WAVES = np.arange(380, 781, 20.0)
# The sun's irradiance above the air, W m⁻² nm⁻¹, at each of them.
SUN = np.array([
    1.10, 1.50, 1.73, 1.83, 2.04, 2.07, 1.93, 1.85, 1.86, 1.81, 1.82,
    1.76, 1.71, 1.65, 1.58, 1.51, 1.43, 1.36, 1.29, 1.23, 1.19,
])  # fmt: skip
# Scattering by air and by haze, and what haze absorbs and scatters over what it scatters.
AIR = 1.157e-3 * (WAVES / 1000) ** -4
HAZE, ANISOTROPY, HAZE_EXTINCTION = 2.03e-2, 0.76, 1.11
# Absorption by ozone where it is densest: Chappuis' bands.
OZONE = 2.49e-3 * np.exp(-0.5 * ((WAVES - 594) / np.where(WAVES < 594, 48, 52)) ** 2)
STEPS, STEPS_TO_SUN = 32, 24
# Measured in skies by Cycles: how bright they are, and the light of the sun, whose disc is darker towards its edge, over
# that of an even disc.
BRIGHTNESS = np.array([0.930, 0.932, 0.889])
LIMB = 0.815

# Of Preetham's sky: luminance and chromaticities x and y by turbidity, and the latter two at the zenith.
PEREZ = (
    ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
)
ZENITH = (
    ((0.00166, -0.00375, 0.00209, 0), (-0.02903, 0.06377, -0.03202, 0.00394), (0.11693, -0.21196, 0.06052, 0.25886)),
    ((0.00275, -0.00610, 0.00317, 0), (-0.04214, 0.08970, -0.04153, 0.00516), (0.15346, -0.26756, 0.06670, 0.26688)),
)
# What Blender makes of 1 kcd/m².
OF_PREETHAM = 0.06


class Air(NamedTuple):
    """How much of each there is, as in Blender; 1 is a clear day."""

    air: float
    haze: float
    ozone: float


@functools.lru_cache(4)
def sky(elevation: float, altitude: float, air: Air, height: int = 256) -> np.ndarray:
    """A picture of the sky, (height, 2 · height, 3): linear light, the zenith at the top, the sun's azimuth in the middle."""
    rows, columns = height // 2, height // 4
    up, around = math.pi / 2 - _middles(height, math.pi), _middles(height, math.pi)
    above, azimuth = np.meshgrid(np.append(up[:rows], 0.0), np.linspace(0, math.pi, columns), indexing="ij")
    lit = _radiance(above.ravel(), azimuth.ravel(), elevation, altitude, air).reshape(rows + 1, columns, 3)
    place = around / math.pi * (columns - 1)
    left = np.minimum(place.astype(int), columns - 2)
    part = (place - left)[:, None]
    lit = (lit[:, left] * (1 - part) + lit[:, left + 1] * part).astype(np.float32)
    half = np.empty((height, height, 3), np.float32)
    # As in Cycles, there is below the horizon what is at it, ever darker.
    half[:rows], half[rows:] = lit[:rows], lit[rows] * (np.clip(1 + 2.5 * np.sin(up[rows:]), 0, 1) ** 3)[:, None, None]
    return np.concatenate([half[:, ::-1], half], axis=1)


def sun(elevation: float, altitude: float, air: Air) -> tuple[float, ...]:
    """The irradiance of a surface that faces the sun, of its light alone."""
    toward = np.array([[0.0, math.cos(elevation), math.sin(elevation)]])
    at = np.array([[0.0, 0.0, GROUND + max(altitude, 1e-3)]])
    through = _through(at, toward, air._replace(ozone=0.0))  # As in Cycles.
    return tuple(_color(SUN * LIMB * through * _is_lit(at, toward)[:, None])[0])


def preetham(elevation: float, turbidity: float, height: int = 256) -> np.ndarray:
    """As `sky`, by the fit of Preetham and others (SIGGRAPH 1999), in Blender's units."""
    up, around = np.meshgrid(math.pi / 2 - _middles(height, math.pi), _middles(2 * height, 2 * math.pi), indexing="ij")
    theta, zenith = np.minimum(math.pi / 2 - up, math.pi / 2 - 1e-3), math.pi / 2 - elevation
    # The middle of the picture is the sun's azimuth. Below the horizon, too, it counts how far the sun is.
    cosine = np.cos(up) * -np.cos(around) * math.sin(zenith) + np.sin(up) * math.cos(zenith)
    gamma = np.arccos(np.clip(cosine, -1, 1))
    angles, powers = np.array([zenith**n for n in (3, 2, 1, 0)]), np.array([turbidity**2, turbidity, 1.0])
    chi = (4 / 9 - turbidity / 120) * (math.pi - 2 * zenith)
    top = [
        (4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192,
        *(powers @ np.array(table) @ angles for table in ZENITH),
    ]
    luminance, x, y = (
        t * _perez(p, turbidity, theta, gamma) / _perez(p, turbidity, 0.0, zenith) for t, p in zip(top, PEREZ)
    )
    xyz = np.stack([x / y, np.ones_like(x), (1 - x - y) / y], axis=2) * (luminance * OF_PREETHAM)[..., None]
    return np.maximum(xyz @ _TO_RGB.T, 0).astype(np.float32)


def _perez(table: tuple, turbidity: float, theta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    a, b, c, d, e = (slope * turbidity + start for slope, start in table)
    return (1 + a * np.exp(b / np.cos(theta))) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)


def _middles(count: int, length: float) -> np.ndarray:
    return (np.arange(count) + 0.5) / count * length


def _radiance(up: np.ndarray, azimuth: np.ndarray, elevation: float, altitude: float, air: Air) -> np.ndarray:
    flat = np.cos(up)
    look = np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(up)], axis=1)
    toward = np.array([0.0, math.cos(elevation), math.sin(elevation)])
    eye = np.array([0.0, 0.0, GROUND + max(altitude, 1e-3)])
    cosine = look @ toward
    g = ANISOTROPY
    by_air = 3 / (16 * math.pi) * (1 + cosine**2)
    by_haze = 3 * (1 - g * g) * (1 + cosine**2) / (8 * math.pi * (2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5)
    step = _to_top(eye[None], look) / STEPS
    light, depth = np.zeros((len(look), len(WAVES))), np.zeros((len(look), len(WAVES)))
    for i in range(STEPS):  # As coarse as Cycles' steps, each behind all of its own air, which makes horizons yellower.
        at = eye + look * ((i + 0.5) * step)[:, None]
        matter = _matter(at, air)
        depth += _extinction(matter) * step[:, None]
        scattered = matter[:, 0:1] * AIR * by_air[:, None] + matter[:, 1:2] * HAZE * by_haze[:, None]
        arrives = np.exp(-depth) * _through(at, toward[None], air) * _is_lit(at, toward[None])[:, None]
        light += scattered * arrives * step[:, None]
    return _color(SUN * light)


def _matter(at: np.ndarray, air: Air) -> np.ndarray:
    """The density of air, haze and ozone at places, relative to their largest."""
    height = np.maximum(np.linalg.norm(at, axis=1) - GROUND, 0)
    ozone = np.clip(1 - np.abs(height - 25) / 15, 0, 1)
    return np.stack([*(np.exp(-height / scale) for scale in HEIGHTS), ozone], axis=1) * air


def _extinction(matter: np.ndarray) -> np.ndarray:
    return matter[:, 0:1] * AIR + matter[:, 1:2] * HAZE * HAZE_EXTINCTION + matter[:, 2:3] * OZONE


def _through(at: np.ndarray, toward: np.ndarray, air: Air) -> np.ndarray:
    """The part of light that comes from above the air to places."""
    step = _to_top(at, toward) / STEPS_TO_SUN
    depth = sum(_matter(at + toward * ((i + 0.5) * step)[:, None], air) for i in range(STEPS_TO_SUN))
    return np.exp(-_extinction(depth * step[:, None]))


def _is_lit(at: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Whether the ground is not between places and the sun."""
    along = (at * toward).sum(axis=1)
    nearest = (at**2).sum(axis=1) - along**2
    return (along > 0) | (nearest > GROUND**2)


def _to_top(at: np.ndarray, toward: np.ndarray) -> np.ndarray:
    along = (at * toward).sum(axis=1)
    return np.sqrt(np.maximum(along**2 - (at**2).sum(axis=1) + TOP**2, 0)) - along


def _color(spectrum: np.ndarray) -> np.ndarray:
    """Linear light of sRGB's primaries; nothing is negative."""
    return np.maximum(spectrum @ _EYE * (WAVES[1] - WAVES[0]) * BRIGHTNESS, 0)


def _lobe(mean: float, below: float, above: float) -> np.ndarray:
    return np.exp(-0.5 * ((WAVES - mean) / np.where(WAVES < mean, below, above)) ** 2)


_X = 1.056 * _lobe(599.8, 37.9, 31.0) + 0.362 * _lobe(442.0, 16.0, 26.7) - 0.065 * _lobe(501.1, 20.4, 26.2)
_Y = 0.821 * _lobe(568.8, 46.9, 40.5) + 0.286 * _lobe(530.9, 16.3, 31.1)
_Z = 1.217 * _lobe(437.0, 11.8, 36.0) + 0.681 * _lobe(459.0, 26.0, 13.8)
_TO_RGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_EYE = np.stack([_X, _Y, _Z], axis=1) @ _TO_RGB.T
