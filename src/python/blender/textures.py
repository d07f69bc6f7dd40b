# SPDX-License-Identifier: MIT OR Apache-2.0
"""Inputs of shaders as rayfront's maps: numbers, colours, pictures, patterns and what combines them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mathutils import Vector

from .arithmetic import (
    TOO_LARGE,
    Map,
    NotCarried,
    below_zero,
    channel,
    clamped,
    combined,
    grey,
    is_arithmetic,
    is_too_large,
    joined,
    mixed,
    said,
    share,
    whole,
)
from .coordinates import Coordinates, MeshSpace, coordinates
from .evaluate import DEEPEST, TOO_DEEP, Evaluator, Unknown
from .images import ASSOCIATED, LUMINANT, MASKED, PLAIN, Images
from .nodes import WIDE, Input, Output, adjusted, leads_to, weights
from .ron import Ron, form

SEPARATE = {"SEPARATE_COLOR", "SEPRGB"}
SRGB = {"sRGB", "sRGB Texture", "Filmic sRGB"}
DATA = {"Non-Color", "Raw", "Generic Data"}
LINEAR = {"Non-Color", "Linear Rec.709", "Linear", "Raw", "Generic Data"}
BLENDS = {"ADD": "Add", "SUBTRACT": "Subtract", "MULTIPLY": "Multiply", "LIGHTEN": "Max", "DARKEN": "Min"}
OPERATIONS = {"ADD": "Add", "SUBTRACT": "Subtract", "MULTIPLY": "Multiply", "MINIMUM": "Min", "MAXIMUM": "Max"}
# The direction of a Wave Texture's bands, and how fast they follow each other, in radians.
WAVES = {"X": (20, 0, 0), "Y": (0, 20, 0), "Z": (0, 0, 20), "DIAGONAL": (10, 10, 10)}
XYZ_TO_RGB = np.array(
    ((3.2404542, -1.5371385, -0.4985314), (-0.9692660, 1.8760108, 0.0415560), (0.0556434, -0.2040259, 1.0572252))
)


class ObjectInfo(NamedTuple):
    """What a material may take from the object, or the instance, that has it."""

    random: float
    color: tuple[float, ...]
    index: int

    @classmethod
    def of(cls, instance: Any) -> ObjectInfo:
        ob = instance.object
        number = instance.random_id & 0xFFFFFFFF if instance.is_instance else _number_of(ob.name)
        return cls(number / 0xFFFFFFFF, tuple(ob.color), ob.pass_index)


def _number_of(name: str) -> int:
    """The random number of an object in Cycles: Jenkins' hash (lookup3) of a hash of its name."""

    def turned(x: int, bits: int) -> int:
        return (x << bits | x >> (32 - bits)) & 0xFFFFFFFF

    text = 0
    for byte in name.encode():
        text = (text * 37 + byte) & 0xFFFFFFFF
    start = 0xDEADBEEF + 8 + 13
    words = [(start + text) & 0xFFFFFFFF, start, start]
    for changed, by, bits in ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24)):
        words[changed] = ((words[changed] ^ words[by]) - turned(words[by], bits)) & 0xFFFFFFFF
    return words[2]


class Maps:
    """The maps of one material on one mesh of one object.

    `mesh_counts` and `object_counts` say afterwards whether they depend on these, `vertex_colors` which colours of the
    mesh they take.
    """

    def __init__(
        self,
        images: Images,
        mesh: MeshSpace,
        user: str,
        warn: Callable[[str], None],
        info: ObjectInfo | None = None,
    ):
        self.images, self.mesh, self.user, self.info = images, mesh, user, info
        self.warn = lambda what: warn(f"{user}: {what}")
        self.mesh_counts = self.object_counts = False
        self.vertex_colors: str | None = None
        # What outputs are, or why they have no counterpart; and those whose nodes are being followed.
        self.known: dict[Any, Map | NotCarried] = {}
        self.open: list[Any] = []

    def color(self, socket: Input) -> Map:
        """A colour, or a texture."""
        value = self._value(socket, self._color)
        return (value, value, value) if isinstance(value, (int, float)) else whole(value)

    def number(self, socket: Input) -> Map:
        """A number, or a number map."""
        value = self._value(socket, self._number)
        return grey(value) if isinstance(value, tuple) else value  # A colour that stands in for a node.

    def constant(self, socket: Input) -> Any:
        """A number, or three, which no texture can be."""
        value = self.color(socket) if socket.socket.type in WIDE else self.number(socket)
        if isinstance(value, Ron):
            self.warn(f"a texture for {socket.socket.name}")
            return socket.value
        return value

    def _value(self, socket: Input, convert: Callable[[Output], Map]) -> Map:
        source = socket.source()
        if source is None:
            return socket.value
        try:
            return self._output(source, convert)
        except NotCarried as reason:
            with contextlib.suppress(Unknown):
                found = Evaluator(None).input(socket)
                return tuple(map(float, found)) if len(found) == 3 else float(found[0])
            behind = self._behind(source)
            if behind:
                self.warn(f"{reason} (for {socket.socket.name}: its {behind.socket.name} goes through unchanged)")
                return self._value(behind, convert)
            self.warn(f"{reason} (for {socket.socket.name}, where {said(socket.value)} stands in)")
            return socket.value

    def _output(self, source: Output, convert: Callable[[Output], Map]) -> Map:
        key = source.socket.as_pointer(), source.groups, convert.__name__
        # A node takes more of Python's depth here than in an Evaluator.
        if key in self.open or len(self.open) >= DEEPEST // 2:
            raise NotCarried(TOO_DEEP)
        if key not in self.known:
            self.open.append(key)
            try:
                found = convert(source)
                self.known[key] = NotCarried(TOO_LARGE) if is_too_large(found) else found
            except NotCarried as reason:
                self.known[key] = reason
            finally:
                self.open.pop()
        found = self.known[key]
        if isinstance(found, NotCarried):
            raise found
        return found

    def _behind(self, source: Output) -> Input | None:
        """The input that stands in for a node without a counterpart: one with an image behind it, else its first colour."""
        inputs = adjusted(source)
        image = next((i for i in inputs if leads_to(i.source(), {"TEX_IMAGE"})), None)
        if image and image.socket.type != source.socket.type == "RGBA" and image.source().type in SEPARATE:
            return image.source().input(0)  # Not one channel, but all that are put together again.
        return image or next((i for i in inputs if i.socket.type == "RGBA"), None)

    def _color(self, source: Output) -> Map:
        kind, node = source.type, source.node
        if kind == "RGB":
            return tuple(node.outputs[0].default_value)[:3]
        if kind == "VALUE":
            return (node.outputs[0].default_value,) * 3
        if kind == "BLACKBODY" and not source.input(0).source():
            return black_body(source.input(0).value)
        if kind == "TEX_IMAGE":
            return self._picture(source, "Alpha" if source.socket.name == "Alpha" else None)
        if kind in {"VERTEX_COLOR", "ATTRIBUTE"}:
            return self._vertex(source)
        if kind == "OBJECT_INFO":
            return self._object(source)
        if kind == "MIX" and node.data_type == "RGBA" or kind == "MIX_RGB":
            return self._mix(source)
        if kind == "INVERT" and not source.input(0).source():
            return self._lerp(source.input("Color"), 1 - source.input(0).value)
        if kind == "GAMMA" and not any(i.source() for i in source.inputs()):
            return tuple(max(c, 0.0) ** source.input("Gamma").value for c in source.input("Color").value)
        if kind == "VALTORGB":
            return self._ramp(source)
        if kind in {"COMBINE_COLOR", "COMBRGB"} and getattr(node, "mode", "RGB") == "RGB":
            return joined([self.number(i) for i in source.inputs()])
        if kind in PATTERNS:
            return PATTERNS[kind](self, source)
        if kind in SEPARATE | {"MATH", "RGBTOBW", "CLAMP", "MAP_RANGE"}:
            found = self._number(source)
            return (found,) * 3 if isinstance(found, (int, float)) else found
        raise NotCarried(f"the node {node.bl_label}")

    def _number(self, source: Output) -> Map:
        kind, node = source.type, source.node
        if kind == "VALUE":
            return node.outputs[0].default_value
        if kind == "TEX_IMAGE":
            return self._picture(source, "Alpha" if source.socket.name == "Alpha" else "Luminance")
        if kind in SEPARATE and getattr(node, "mode", "RGB") == "RGB":
            return channel(self.color(source.input(0)), "RGB".index(source.socket.name[0]))
        if kind == "RGBTOBW":
            return grey(self.color(source.input(0)))
        if kind == "MATH":
            return self._math(source)
        if kind == "CLAMP":
            low, high = (self.constant(source.input(name)) for name in ("Min", "Max"))
            if node.clamp_type == "RANGE":
                low, high = min(low, high), max(low, high)
            return clamped(self.number(source.input("Value")), low, high)
        if kind in SEPARATE:
            raise NotCarried(f"the node {node.bl_label} of the mode {node.mode}")
        if kind == "MAP_RANGE":
            raise NotCarried(f"the node {node.bl_label}")
        return grey(self._color(source), weights(source.socket))

    def _picture(self, source: Output, part: str | None) -> Ron:
        node = source.node
        if not node.image:
            raise ValueError(f"{self.user}: an Image Texture has no picture")
        place = self._coordinates(source, "UV")
        if place.space == "Object" or node.projection != "FLAT":
            raise NotCarried(f"the picture {node.image.name!r} by other coordinates than UV")
        wrap = {"REPEAT": None, "EXTEND": "Clamp", "MIRROR": "Mirror"}.get(node.extension, "Clamp")
        if node.extension == "CLIP":
            self.warn(f"the picture {node.image.name!r} is clipped: its edge goes on")
        image, space = node.image, node.image.colorspace_settings.name
        if space not in SRGB | LINEAR:
            self.warn(f"the colour space {space} of {node.image.name!r}")
        kind = PLAIN if part == "Alpha" else self._kind(node, space)
        if part == "Luminance" and self.images.is_grey(image):
            part = "Red"
        elif part == "Luminance" and image.is_float:
            part, kind = "Red", LUMINANT
        found = form(
            "Texture",
            image=self.images.file(image, self.user, kind),
            filter=Ron("Nearest") if node.interpolation == "Closest" else None,
            wrap=wrap and Ron(wrap),
            color_space=Ron("Srgb" if space in SRGB else "Linear"),
            channel=Ron(part) if part in {"Red", "Alpha"} else None,
            **place.picture(),
        )
        return grey(found) if part == "Luminance" else found

    def _kind(self, node: Any, space: str) -> str:
        """Which colours Cycles has: times alpha, unless they are data; divided by it again where the node's Alpha is used."""
        image = node.image
        if image.alpha_mode in {"CHANNEL_PACKED", "NONE"} or space in DATA or not self.images.is_veiled(image):
            return PLAIN
        return MASKED if node.outputs["Alpha"].is_linked else ASSOCIATED

    def _coordinates(self, source: Output, default: str) -> Coordinates:
        reasons: list[str] = []
        self.mesh_counts = True
        place = coordinates(source.input("Vector"), self.mesh, default, reasons.append)
        if place is None:
            raise NotCarried(f"the node {source.node.bl_label} with {reasons[0]}")
        return place

    def _vertex(self, source: Output) -> Ron:
        node = source.node
        name = node.layer_name if source.type == "VERTEX_COLOR" else node.attribute_name
        if source.type == "ATTRIBUTE" and node.attribute_type != "GEOMETRY":
            raise NotCarried(f"the attribute {name!r} of an {node.attribute_type.lower()}")
        if self.vertex_colors not in (None, name):
            raise NotCarried(f"the colours {name!r} beside {self.vertex_colors!r}")
        self.vertex_colors = name
        return form("Vertex", channel=Ron("Alpha") if source.socket.name == "Alpha" else None)

    def _object(self, source: Output) -> Map:
        name = source.socket.name
        if self.info is None or name not in {"Random", "Color", "Alpha", "Object Index"}:
            raise NotCarried(f"the {name} of the node {source.node.bl_label}")
        self.object_counts = True
        color = self.info.color
        return {"Random": self.info.random, "Color": color[:3], "Alpha": color[3], "Object Index": self.info.index}[
            name
        ]

    def _lerp(self, socket: Input, weight: float) -> Map:
        """weight · x + (1 − weight) · (1 − x)"""
        inner = self.color(socket)
        if isinstance(inner, tuple):
            return tuple(weight * c + (1 - weight) * (1 - c) for c in inner)
        return form("Mix", a=form("Subtract", a=1.0, b=inner), b=inner, by=weight)

    def _mix(self, source: Output) -> Map:
        inputs = source.inputs()
        factor, a, b = inputs[0], inputs[-2], inputs[-1]
        by, x, y = self.number(factor), self.color(a), self.color(b)
        blend = source.node.blend_type
        if blend != "MIX":
            if blend not in BLENDS:
                raise NotCarried(f"the node {source.node.bl_label} of the type {blend.title()}")
            y = combined(BLENDS[blend], x, y)
        # The older node has one switch, that of the result.
        if getattr(source.node, "clamp_factor", True):
            by = share(by)
        elif is_arithmetic(by) or (isinstance(x, Ron) or isinstance(y, Ron)) and share(by) != by:
            self.warn(f"the node {source.node.bl_label} without Clamp Factor: it counts from 0 to 1")
        switch = "clamp_result" if source.type == "MIX" else "use_clamp"
        return clamped(mixed(x, y, by)) if getattr(source.node, switch) else mixed(x, y, by)

    def _math(self, source: Output) -> Map:
        found = self._operation(source)
        return clamped(found) if source.node.use_clamp else found

    def _operation(self, source: Output) -> Map:
        operation = source.node.operation
        if operation not in OPERATIONS and operation != "MULTIPLY_ADD":
            raise NotCarried(f"the node Math of the operation {operation.title()}")
        a, b = (self.number(i) for i in source.inputs()[:2])
        if operation == "MULTIPLY_ADD":
            more = self.number(source.inputs()[2])
            if isinstance(a, Ron) and not isinstance(b, Ron) and below_zero(b):
                return combined("Subtract", more, combined("Multiply", a, -b))
            return combined("Add", combined("Multiply", a, b), more)
        return combined(OPERATIONS[operation], a, b)

    def _ramp(self, source: Output) -> Map:
        ramp, stops, alone = source.node.color_ramp, [], source.socket.name == "Alpha"

        def part(color: Any) -> Map:
            return color[3] if alone else tuple(color)[:3]

        of = self.number(source.input("Fac" if "Fac" in source.node.inputs else 0))
        if not isinstance(of, Ron):
            return part(ramp.evaluate(of))
        if ramp.interpolation != "CONSTANT" and (ramp.interpolation != "LINEAR" or ramp.color_mode != "RGB"):
            places = {t / 32 for t in range(33)} | {element.position for element in ramp.elements}
            return form("Curve", of=whole(of), stops=[(place, part(ramp.evaluate(place))) for place in sorted(places)])
        for element in ramp.elements:
            if ramp.interpolation == "CONSTANT" and stops:
                stops.append((max(element.position - 1e-5, stops[-1][0]), stops[-1][1]))
            stops.append((element.position, part(element.color)))
        return form("Curve", of=whole(of), stops=stops)

    def _checker(self, source: Output) -> Map:
        place = self._coordinates(source, "Generated")
        scale = self.constant(source.input("Scale"))
        if source.socket.name == "Fac":
            a, b = 0.0, 1.0
        else:
            a, b = (self.color(source.input(name)) for name in ("Color2", "Color1"))
        return form("Checker", **place.pattern(scale), a=a, b=b)

    def _gradient(self, source: Output) -> Map:
        if source.node.gradient_type != "LINEAR":
            raise NotCarried(f"the node Gradient Texture of the type {source.node.gradient_type.title()}")
        return form("Gradient", **self._coordinates(source, "Generated").pattern(1.0))

    def _bricks(self, source: Output) -> Map:
        node = source.node
        place = self._coordinates(source, "Generated")
        height = self.constant(source.input("Row Height"))
        length, mortar = (self.constant(source.input(name)) / height for name in ("Brick Width", "Mortar Size"))
        if node.offset_frequency != 2 or abs(node.offset - 0.5) > 1e-3 or node.squash != 1:
            self.warn("the bond of a Brick Texture: every other row is shifted by half")
        self.warn("a Brick Texture: all bricks have the mean of Color1 and Color2, and their mortar is not smooth")
        if source.socket.name == "Fac":
            a, b = 1.0, 0.0
        else:
            a, first, second = (self.color(source.input(name)) for name in ("Mortar", "Color1", "Color2"))
            part = min(max(0.5 + 0.5 * self.constant(source.input("Bias")), 0.0), 1.0)
            b = mixed(first, second, part)
        scale = self.constant(source.input("Scale")) / height
        place.offset.x += 0.5 * length / (scale or 1.0)  # Blender shifts even rows, rayfront odd ones.
        pattern = place.pattern(scale)
        return form("Bricks", length=length, mortar=min(2 * mortar, 1.0), **pattern, a=a, b=b)

    def _wave(self, source: Output) -> Map:
        node = source.node
        place = self._coordinates(source, "Generated")
        along = Vector(WAVES[node.bands_direction])
        if place.space != "Object":
            along.z = 0.0
        if node.wave_type != "BANDS" or along.length == 0:
            raise NotCarried(f"the node Wave Texture ({node.wave_type.title()}, {node.bands_direction.title()})")
        scale, distortion, phase = (
            self.constant(source.input(name)) for name in ("Scale", "Distortion", "Phase Offset")
        )
        place.turned(along.rotation_difference(Vector((1, 0, 0))))
        waves = scale * along.length / (2 * math.pi)
        stops = [(t / 8, 0.5 - 0.5 * math.cos(math.pi * t / 8)) for t in range(9)]
        fields: dict[str, Any] = {"stops": stops} if node.wave_profile == "SIN" else {}
        if distortion != 0:
            self.warn("the Distortion of a Wave Texture: rayfront's own noise, as strong and as fine, bends its bands")
            octaves = min(max(round(self.constant(source.input("Detail"))) + 1, 1), 16)
            turbulence = 0.25 * abs(distortion) / (2 * math.pi)  # Its noise is finer.
            return form("Marble", turbulence=turbulence, octaves=octaves, **place.pattern(waves), **fields)
        # A gradient is half a wave, and its mirror image the other; of a saw it is a whole one.
        half = 1 if node.wave_profile == "SAW" else 2
        place.offset.x += 1e-5 + phase / (2 * math.pi * (waves or 1.0))
        wrap = Ron("Repeat" if half == 1 else "Mirror")
        return form("Gradient", **place.pattern(half * waves), wrap=wrap, **fields)

    def _noise(self, source: Output) -> Map:
        if source.node.noise_dimensions != "3D":
            raise NotCarried(f"the node Noise Texture in {source.node.noise_dimensions}")
        place = self._coordinates(source, "Generated")
        scale, detail, roughness, lacunarity, distortion = (
            self.constant(source.input(name)) for name in ("Scale", "Detail", "Roughness", "Lacunarity", "Distortion")
        )
        kind = getattr(source.node, "noise_type", "FBM")
        named = "" if kind == "FBM" else f" of the type {kind.replace('_', ' ').title()}"
        plain = (", from 0 to 1" if named else "") + (", without Distortion" if distortion else "")
        self.warn(f"a Noise Texture{named}: rayfront's own noise of the same fineness stands in for it{plain}")
        pattern: dict[str, Any] = {
            "kind": Ron("Ridged") if kind == "RIDGED_MULTIFRACTAL" else None,
            "octaves": min(max(round(detail) + 1, 1), 16),
            "roughness": min(roughness, 1.0),
            "lacunarity": min(max(lacunarity, 1.0), 8.0),
        }
        if source.socket.name != "Color":
            return form("Noise", **pattern, **place.pattern(scale))
        # One noise for each channel, from elsewhere.
        channels = []
        for number, tint in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
            fields = place.pattern(scale)
            fields["offset"] = fields.get("offset", Vector()) + Vector((number * 19.3, number * 7.1, number * 13.7))
            channels.append(form("Noise", **pattern, **fields, a=0.0, b=tint))
        return form("Add", a=form("Add", a=channels[0], b=channels[1]), b=channels[2])

    def _voronoi(self, source: Output) -> Map:
        node, kind = source.node, source.socket.name
        kinds = {"Distance": "Distance", "Color": "Cells"}
        if node.voronoi_dimensions != "3D" or node.feature != "F1" or node.distance != "EUCLIDEAN" or kind not in kinds:
            raise NotCarried(f"the node Voronoi Texture ({node.voronoi_dimensions}, {node.feature}, {kind})")
        place = self._coordinates(source, "Generated")
        scale, randomness = (self.constant(source.input(name)) for name in ("Scale", "Randomness"))
        randomness = min(max(randomness, 0.0), 1.0)
        if randomness > 0 or kind != "Distance":
            self.warn("a Voronoi Texture: rayfront's own cells of the same size stand in for it")
        fields = place.pattern(scale)
        # Without randomness a cell's point is in its corner in Blender, in its middle in rayfront.
        shift = 0.5 * (1 - randomness)
        fields["offset"] = fields.get("offset", Vector()) + Vector((shift, shift, shift))
        return form("Voronoi", kind=Ron(kinds[kind]), randomness=randomness, **fields)


PATTERNS = {
    "TEX_CHECKER": Maps._checker,
    "TEX_GRADIENT": Maps._gradient,
    "TEX_BRICK": Maps._bricks,
    "TEX_NOISE": Maps._noise,
    "TEX_VORONOI": Maps._voronoi,
    "TEX_WAVE": Maps._wave,
}


def black_body(kelvin: float) -> tuple[float, ...]:
    """The colour of a black body, of luminance 1: a number for the places that take no map.

    Planck's law and the fits of the CIE 1931 observer by Wyman and others (2013): within 1 % of Blender's from 2500 K up.
    """
    kelvin = min(max(kelvin, 800.0), 12000.0)  # As in Cycles.
    nm = np.arange(380.0, 781.0, 5.0)
    energy = nm**-5.0 / np.expm1(1.438777e7 / (nm * kelvin))

    def lobe(peak: float, left: float, right: float) -> np.ndarray:
        return np.exp(-(((nm - peak) / np.where(nm < peak, left, right)) ** 2) / 2)

    red = 1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2)
    green = 0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1)
    blue = 1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8)
    x, y, z = ((energy * seen).sum() for seen in (red, green, blue))
    rgb = XYZ_TO_RGB @ (x / y, 1.0, z / y)
    return tuple(max(float(c), 0.0) for c in rgb)
