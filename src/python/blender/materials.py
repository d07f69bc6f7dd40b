# SPDX-License-Identifier: MIT OR Apache-2.0
"""Materials as rayfront's `Principled`: shaders of surfaces, and how they are mixed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from . import media
from .arithmetic import TOO_LARGE, Map, clamped, combined, is_too_large, mixed, one, scaled, share
from .coordinates import MeshSpace
from .evaluate import DEEPEST, TOO_DEEP
from .images import Images
from .nodes import Input, Output, surface
from .ron import Ron, form
from .textures import Maps, ObjectInfo

BLACK, GREY, WHITE = (0.0, 0.0, 0.0), (0.8, 0.8, 0.8), (1.0, 1.0, 1.0)
BLEND = Ron("Blend")
# Straight through: no shader at all.
NOTHING = {"base_color": BLACK, "specular": 0.0, "alpha": 0.0, "alpha_mode": BLEND}
DARK = {"base_color": BLACK, "specular": 0.0}
# What objects are on the film other than themselves: what they catch, or nothing. A catcher without any light of its own
# darkens nothing that is behind it.
CATCHER, HOLDOUT = "shadow catcher", "holdout"
HELD_OUT = DARK | {"metallic": 0.0, "double_sided": True, "shadow_catcher": True}
# The values of fields that a shader leaves out, where two are mixed.
DEFAULTS = {
    "base_color": WHITE, "metallic": 0.0, "roughness": 1.0, "specular": 1.0, "emission": BLACK, "alpha": 1.0,
    "transmission": 0.0, "diffuse_transmission": 0.0, "diffuse_transmission_color": WHITE, "clearcoat": 0.0,
    "clearcoat_roughness": 0.0, "sheen_color": BLACK, "sheen_roughness": 0.0, "ior": 1.5, "specular_color": WHITE,
}  # fmt: skip
LIMITED = {*DEFAULTS, "edge_tint"} - {"emission", "ior"}

# The least roughness of glass that blurs at all, and hardly so.
ROUGH = 0.032

Fields = dict[str, Any]


class Film(NamedTuple):
    """Whether the film is transparent, and up to which roughness glass is then as well; None: no glass is."""

    transparent: bool = False
    glass_roughness: float | None = None

    @classmethod
    def of(cls, scene: Any) -> Film:
        cycles = getattr(scene, "cycles", None)
        glass = cycles.film_transparent_roughness if cycles and cycles.film_transparent_glass else None
        return cls(scene.render.film_transparent, glass)


class Material:
    """One material, for the meshes of one space. `ron` is what replaces it in the model."""

    def __init__(
        self,
        material: Any,
        mesh: MeshSpace,
        images: Images,
        warn: Callable[[str], None],
        film: Film,
        shown: str | None = None,
        info: ObjectInfo | None = None,
    ):
        self.material = material
        self.maps = Maps(images, mesh, f"material {material.name!r}", warn, info)
        self.warn = self.maps.warn
        # The fields of shaders, and the shaders that are being followed.
        self.known: dict[Any, Fields] = {}
        self.open: list[Any] = []
        fields = self._nodes() if material.use_nodes and material.node_tree else self._plain()
        fields.setdefault("metallic", 0.0)
        self._limit(fields)
        self._check(fields)
        fields["double_sided"] = True
        if film.transparent:
            self._glass_on(film, fields)
        if shown == CATCHER:
            if fields.get("emission", BLACK) != BLACK:
                self.warn("Emission of a shadow catcher")
                del fields["emission"]
            fields["shadow_catcher"] = True
        self.ron = form("Principled", **fields)
        # Its number in the model.
        self.number = 0

    def _plain(self) -> Fields:
        """Without nodes, materials are matte in Cycles, of the viewport's colour."""
        return {"base_color": tuple(self.material.diffuse_color)[:3], "specular": 0.0}

    def _limit(self, fields: Fields) -> None:
        """Keeps what reflects or lets light through from 0 to 1, beyond which rayfront refuses it."""
        for key in [key for key in fields if key in LIMITED]:
            value = fields[key]
            if isinstance(value, tuple) and max(value) > 1:
                self.warn(f"{key.replace('_', ' ')} above 1")
            if isinstance(value, tuple):
                fields[key] = tuple(min(max(c, 0.0), 1.0) for c in value)
            elif not isinstance(value, Ron):
                fields[key] = min(max(value, 0.0), 1.0)

    def _check(self, fields: Fields) -> None:
        """Raises a ValueError for a map that the program would refuse without saying whose it is."""
        for key, value in fields.items():
            if is_too_large(value["texture"] if key in {"normal", "bump"} else value):
                raise ValueError(f"{self.maps.user}: {key.replace('_', ' ')}: {TOO_LARGE}")

    def _glass_on(self, film: Film, fields: Fields) -> None:
        """Glass on a transparent film: what is behind smooth glass counts as the film's, behind rough glass as glass."""
        if fields.get("transmission", 0.0) == 0.0 or fields.get("ior") == 1.0:
            return
        roughness = fields.get("roughness", 1.0)
        if film.glass_roughness is None:
            fields["roughness"] = combined("Max", roughness, ROUGH)
        elif isinstance(roughness, Ron) or ROUGH < roughness <= film.glass_roughness:
            self.warn("Transparent Glass that is rough: the film keeps what is seen through it")

    def _nodes(self) -> Fields:
        tree = self.material.node_tree
        shader, volume, displacement = (
            surface(tree, "OUTPUT_MATERIAL", name) for name in ("Surface", "Volume", "Displacement")
        )
        fields = self._shader(shader) if shader else {**NOTHING} if volume else {**DARK}
        if volume:
            medium = media.of_volume(volume, self.maps)
            if not shader:
                fields = {"base_color": WHITE, "transmission": 1.0, "roughness": 0.0, "ior": 1.0, "volume": medium}
            elif fields.get("transmission") == 1.0:
                fields["volume"] = medium
            else:
                self.warn("a volume behind a surface that lets no light in")
        if displacement:
            self._displacement(displacement, fields)
        return fields

    def _displacement(self, source: Output, fields: Fields) -> None:
        if source.type != "DISPLACEMENT":
            self.warn("displacement")
            return
        if getattr(self.material, "displacement_method", "BUMP") != "BUMP":
            self.warn("displacement, which is shaded as a bump in its place")
        height = self.maps.number(source.input("Height"))
        _raise(fields, height, self.maps.constant(source.input("Scale")))

    def _shader(self, source: Output | None) -> Fields:
        if source is None:
            return {**DARK}
        key = source.socket.as_pointer(), source.groups
        if key in self.open or len(self.open) >= DEEPEST:
            self.warn(f"{TOO_DEEP}: it is black")
            return {**DARK}
        if key not in self.known:
            self.open.append(key)
            self.known[key] = self._converted(source)
            self._check(self.known[key])
            self.open.pop()
        return {**self.known[key]}

    def _converted(self, source: Output) -> Fields:
        convert = SHADERS.get(source.type)
        if convert:
            return convert(self, source)
        self.warn(f"the node {source.node.bl_label}, for which matte grey stands in")
        return {"base_color": GREY, "specular": 0.0}

    def _diffuse(self, source: Output) -> Fields:
        self._ignored(source, Roughness=0.0)
        return {"base_color": self.maps.color(source.input("Color")), "specular": 0.0} | self._normal(source)

    def _glossy(self, source: Output) -> Fields:
        color = self.maps.color(source.input("Color"))
        roughness = self.maps.number(source.input("Roughness"))
        fields = {"base_color": color, "metallic": 1.0, "roughness": roughness}
        if isinstance(color, tuple):
            # Cycles' has no Fresnel term: the tint takes away at 82 degrees so much that the mean over all directions,
            # to which Schlick's term adds (1 − c) / 21, is the colour.
            cosine = math.cos(math.radians(82))
            bow, rise = 6 * cosine * (1 - cosine) ** 6, (1 - cosine) ** 5
            fields["edge_tint"] = tuple(1 - bow * (1 - c) / (c + (1 - c) * rise) for c in color)
        return fields | self._stretched(source, "Anisotropy", "Rotation", roughness) | self._normal(source)

    def _metallic(self, source: Output) -> Fields:
        roughness = self.maps.number(source.input("Roughness"))
        if getattr(source.node, "fresnel_type", "F82") == "F82":
            color, tint = self.maps.color(source.input("Base Color")), self.maps.constant(source.input("Edge Tint"))
        else:
            color, tint = _conductor(*(self.maps.constant(source.input(name)) for name in ("IOR", "Extinction")))
        fields = {"base_color": color, "edge_tint": tint, "metallic": 1.0, "roughness": roughness}
        return fields | self._stretched(source, "Anisotropy", "Rotation", roughness) | self._normal(source)

    def _glass(self, source: Output) -> Fields:
        color = self.maps.color(source.input("Color"))
        if not one(color):
            self.warn("the colour of reflections by a Glass BSDF: they are white")
        fields = {
            "base_color": color,
            "roughness": self.maps.number(source.input("Roughness")),
            "ior": self.maps.constant(source.input("IOR")),
            "transmission": 1.0,
            "volume": Ron("()"),
        }
        return fields | self._normal(source)

    def _emission(self, source: Output) -> Fields:
        return DARK | {"emission": self._glow(source.input("Color"), source.input("Strength"))}

    def _glow(self, color: Input, strength: Input) -> Map:
        found = [self.maps.color(color), self.maps.number(strength)]
        for number, what in enumerate(("Emission Color", "Emission Strength")):
            if not isinstance(found[number], Ron) and clamped(found[number], high=math.inf) != found[number]:
                self.warn(f"{what} below 0: it takes no light away")
                found[number] = clamped(found[number], high=math.inf)
        return combined("Multiply", *found)

    def _translucent(self, source: Output) -> Fields:
        fields = {"specular": 0.0, "diffuse_transmission": 1.0}
        return fields | {"diffuse_transmission_color": self.maps.color(source.input("Color"))} | self._normal(source)

    def _transparent(self, source: Output) -> Fields:
        color = self.maps.color(source.input("Color"))
        if one(color):
            return {**NOTHING}
        return {"base_color": color, "specular": 0.0, "transmission": 1.0, "roughness": 0.0, "ior": 1.0}

    def _scattering(self, source: Output) -> Fields:
        scale = self.maps.constant(source.input("Scale"))
        radius = [r * scale for r in self.maps.constant(source.input("Radius"))]
        self._ignored(source, Anisotropy=0.0)
        color = self.maps.constant(source.input("Color"))
        medium = media.of_subsurface(color, media.below_subsurface(color)[1], radius, 0.0)
        return {"specular": 0.0, "diffuse_transmission": 1.0, "volume": medium} | self._normal(source)

    def _mix(self, source: Output) -> Fields:
        factor, first, second = (source.input(i) for i in range(3))
        by_source = factor.source()
        if by_source and by_source.type == "LIGHT_PATH":
            self.warn(f"a mix by Light Path ({by_source.socket.name}): its first shader counts for all rays")
            return self._shader(first.source())
        a, b = self._shader(first.source()), self._shader(second.source())
        if by_source and by_source.type == "FRESNEL" and a.get("specular") == 0.0 and b.get("metallic") == 1.0:
            # The plastic of old: matte below a mirror.
            keep = {key: b[key] for key in ("roughness", "normal", "bump") if key in b}
            tint = {} if one(b["base_color"]) else {"specular_color": b["base_color"]}
            rest = {key: value for key, value in a.items() if key != "specular"}
            return rest | keep | tint | {"ior": self.maps.constant(by_source.input("IOR"))}
        by = share(self.maps.number(factor))
        if by in (0, 1):
            return b if by else a
        for shown, hidden, weight in ((b, a, by), (a, b, combined("Subtract", 1.0, by))):
            if hidden.get("alpha") == 0.0:
                return shown | {"alpha": combined("Multiply", shown.get("alpha", 1.0), weight), "alpha_mode": BLEND}
        return self._blended(a, b, by)

    def _blended(self, a: Fields, b: Fields, by: Map) -> Fields:
        leaves = {
            frozenset(("base_color", "specular")),
            frozenset(("specular", "diffuse_transmission", "diffuse_transmission_color")),
        }
        if {frozenset(a), frozenset(b)} == leaves and a["specular"] == b["specular"] == 0.0:
            # Matte on both sides, as leaves are: just what rayfront's material is.
            front, back = (a, b) if "base_color" in a else (b, a)
            through = by if back is b else combined("Subtract", 1.0, by)
            return front | back | {"diffuse_transmission": through}
        alike = set(a) == set(b) and all(a[k] == b[k] for k in a if k not in ("base_color", "emission"))
        if not alike:
            self.warn("a mix of shaders: their values are mixed in place of their light")
        out = {}
        for key in {**a, **b}:
            if key in DEFAULTS:
                out[key] = mixed(a.get(key, DEFAULTS[key]), b.get(key, DEFAULTS[key]), by)
            else:
                out[key] = a.get(key, b.get(key))
        return out

    def _add(self, source: Output) -> Fields:
        a, b = (self._shader(source.input(i).source()) for i in range(2))
        for base, other in ((a, b), (b, a)):
            if set(other) == {"base_color", "specular", "emission"} and other["base_color"] == BLACK:
                return base | {"emission": combined("Add", base.get("emission", BLACK), other["emission"])}
        self.warn("a sum of shaders: only the first one counts")
        return a

    def _principled(self, source: Output) -> Fields:
        maps = self.maps
        roughness, ior = maps.number(source.input("Roughness")), maps.constant(source.input("IOR"))
        fields: Fields = {
            "base_color": maps.color(source.input("Base Color")),
            "metallic": maps.number(source.input("Metallic")),
            "roughness": roughness,
            "ior": ior,
        }
        self._ignored(source, **{"Diffuse Roughness": 0.0, "Coat IOR": 1.5, "Coat Tint": WHITE})
        self._specular(source, fields)
        self._body(source, fields)
        alpha = maps.number(source.input("Alpha"))
        if alpha != 1:
            fields |= {"alpha": alpha, "alpha_mode": BLEND}
        strength = source.input("Emission Strength")
        if strength.source() or strength.value != 0:
            fields["emission"] = self._glow(source.input("Emission Color"), strength)
        coat = maps.number(source.input("Coat Weight"))
        if coat != 0:
            fields |= {"clearcoat": coat, "clearcoat_roughness": maps.number(source.input("Coat Roughness"))}
            if source.input("Coat Normal").source():
                self.warn("Coat Normal")
        sheen = maps.number(source.input("Sheen Weight"))
        if sheen != 0:
            self.warn("Sheen: another model, up to a third brighter or darker than in Cycles")
            fields["sheen_color"] = combined("Multiply", maps.color(source.input("Sheen Tint")), sheen)
            fields["sheen_roughness"] = maps.number(source.input("Sheen Roughness"))
        if source.has("Thin Film Thickness"):
            thickness = maps.constant(source.input("Thin Film Thickness"))
            if thickness > 0:
                if fields["metallic"] != 0:
                    self.warn("Thin Film on metal: its colours differ from those in Cycles")
                film = {"factor": 1.0, "ior": max(maps.constant(source.input("Thin Film IOR")), 1.0)}
                fields["iridescence"] = film | {"thickness_minimum_nm": 0.0, "thickness_maximum_nm": thickness}
        fields |= self._stretched(source, "Anisotropic", "Anisotropic Rotation", roughness)
        return fields | self._normal(source)

    def _specular(self, source: Output, fields: Fields) -> None:
        level = self.maps.number(source.input("Specular IOR Level"))
        tint = self.maps.color(source.input("Specular Tint"))
        if not one(tint):
            fields["specular_color"] = tint
            if fields["metallic"] != 0:
                fields["edge_tint"] = self.maps.constant(source.input("Specular Tint"))
        if isinstance(level, Ron):
            fields["specular"] = combined("Min", combined("Multiply", level, 2.0), 1.0)
        elif abs(level - 0.5) > 1e-4:
            # The reflectance straight on times twice the level, as another index of refraction.
            root = ((fields["ior"] - 1) / (fields["ior"] + 1)) ** 2 * 2 * level
            root = min(max(root, 0.0), 0.98) ** 0.5
            fields["ior"] = (1 + root) / (1 - root)
            if root < 1e-3:
                fields["specular"] = 0.0

    def _body(self, source: Output, fields: Fields) -> None:
        """What lets light in: glass, or subsurface scattering."""
        maps, color = self.maps, fields["base_color"]
        through = maps.number(source.input("Transmission Weight"))
        if through != 0:
            fields |= {"transmission": through, "volume": Ron("()")}
            if through == 1 and isinstance(color, tuple):
                fields["base_color"] = tuple(max(c, 0.0) ** 0.5 for c in color)  # Cycles tints by the root at each surface.
            elif not one(color):
                self.warn("the colour of glass that is a texture, or mixed: it counts on the way in and out")
        weight = maps.number(source.input("Subsurface Weight"))
        if weight != 0:
            if through != 0:
                self.warn("Subsurface beside Transmission")
            else:
                self._subsurface(source, fields, weight)

    def _subsurface(self, source: Output, fields: Fields, weight: Map) -> None:
        maps, color = self.maps, fields["base_color"]
        scale = maps.constant(source.input("Subsurface Scale"))
        radius = [r * scale for r in maps.constant(source.input("Subsurface Radius"))]
        if source.node.subsurface_method != "RANDOM_WALK":
            self.warn(
                f"Subsurface by {source.node.subsurface_method.replace('_', ' ').title()}: Random Walk stands in"
            )
        # Christensen and Burley's has none.
        anisotropy = (
            maps.constant(source.input("Subsurface Anisotropy")) if source.has("Subsurface Anisotropy") else 0.0
        )
        if abs(anisotropy) > 0.5:
            self.warn(f"a Subsurface Anisotropy of {anisotropy:.2g}: darker than in Cycles")
        if isinstance(color, Ron):
            self.warn("Subsurface of a texture's colour: one colour is scattered")
            color = source.input("Base Color").value
        below = media.below_subsurface(color)[1]
        if isinstance(weight, Ron):
            self.warn("a Subsurface Weight that is a texture: light that comes out is weakened by it, too")
        elif weight < 1:
            brightest = 1.0
            if not isinstance(fields["base_color"], Ron) and fields["metallic"] == 0 and 0 < max(color) < 1:
                brightest = max(color)
                fields["base_color"] = tuple(c / brightest for c in color)
            weight, below = media.below_subsurface(color, weight, brightest)
        fields |= {"diffuse_transmission": weight, "volume": media.of_subsurface(color, below, radius, anisotropy)}

    def _stretched(self, source: Output, strength: str, rotation: str, roughness: Map) -> Fields:
        amount = self.maps.constant(source.input(strength))
        if amount == 0:
            return {}
        tangent = source.input("Tangent").source()
        if not tangent or tangent.type != "TANGENT" or tangent.node.direction_type != "UV_MAP":
            self.warn("Anisotropy without a Tangent of the UV map: it follows the UV map")
        turn = self.maps.constant(source.input(rotation)) * 360
        if isinstance(roughness, Ron):
            return {"anisotropy": {"strength": abs(amount), "rotation_degrees": turn}}
        # Cycles stretches both widths, glTF the one along the tangent, up to 1.
        aspect = math.sqrt(1 - 0.9 * abs(amount))
        wide, narrow = min(roughness**2 / aspect, 1.0), roughness**2 * aspect
        stretch = math.sqrt(max(wide - narrow, 0) / max(1 - narrow, 1e-6))
        turn += 90 if amount < 0 else 0
        return {"roughness": math.sqrt(narrow), "anisotropy": {"strength": min(stretch, 1.0), "rotation_degrees": turn}}

    def _normal(self, source: Output) -> Fields:
        found: Fields = {}
        normal = source.input("Normal").source() if source.has("Normal") else None
        while normal:
            inner = None
            if normal.type == "NORMAL_MAP" and normal.node.space == "TANGENT":
                texture = self.maps.color(normal.input("Color"))
                if isinstance(texture, Ron):
                    found["normal"] = {"texture": texture, "scale": self.maps.constant(normal.input("Strength"))}
            elif normal.type == "BUMP":
                height = self.maps.number(normal.input("Height"))
                strength, distance = (self.maps.constant(normal.input(name)) for name in ("Strength", "Distance"))
                _raise(found, height, strength * distance * (-1 if normal.node.invert else 1))
                inner = normal.input("Normal").source()
            else:
                self.warn(f"the node {normal.node.bl_label} as Normal")
            normal = inner
        return found

    def _ignored(self, source: Output, **plain: Any) -> None:
        """Tells of inputs that count in Blender alone, unless they have the value that changes nothing."""
        for name, value in plain.items():
            if source.has(name):
                found = source.input(name)
                if found.source() or not _close(found.value, value):
                    self.warn(name)


def _raise(fields: Fields, height: Map, metres: float) -> None:
    """Adds a relief to that of `fields`: heights of several Bump nodes add up."""
    if not isinstance(height, Ron) or metres == 0:
        return
    if "bump" not in fields:
        fields["bump"] = {"texture": height, "height_m": metres}
        return
    before = fields["bump"]
    whole = abs(before["height_m"]) + abs(metres)
    parts = []
    for texture, amount in ((before["texture"], before["height_m"]), (height, metres)):
        # What goes down is the rest of what goes up.
        upwards = texture if amount > 0 else combined("Subtract", 1.0, texture)
        parts.append(scaled(upwards, abs(amount) / whole))
    fields["bump"] = {"texture": form("Add", a=parts[0], b=parts[1]), "height_m": whole}


def _conductor(index: tuple[float, ...], extinction: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """What a metal reflects straight on by Fresnel's equations, and its tint at 82 degrees over Schlick's."""
    cosine = math.cos(math.radians(82))
    colors, tints = [], []
    for n, k in zip(index, extinction):
        straight, grazing = (_reflectance(max(n, 1e-4), max(k, 0.0), c) for c in (1.0, cosine))
        colors.append(straight)
        tints.append(grazing / (straight + (1 - straight) * (1 - cosine) ** 5))
    return tuple(colors), tuple(tints)


def _reflectance(n: float, k: float, cosine: float) -> float:
    """Fresnel's equations of a conductor in air, for light without polarization."""
    sine, both = 1 - cosine**2, n * n - k * k
    root = math.sqrt((both - sine) ** 2 + 4 * n * n * k * k)
    a = math.sqrt(max((root + both - sine) / 2, 0.0))
    across = (root + cosine**2 - 2 * a * cosine) / (root + cosine**2 + 2 * a * cosine)
    part, mixed = cosine**2 * root + sine**2, 2 * a * cosine * sine
    return across * (1 + (part - mixed) / (part + mixed)) / 2


def _close(a: Any, b: Any) -> bool:
    pairs = zip(a, b) if isinstance(a, tuple) else [(a, b)]
    return all(abs(x - y) < 1e-4 for x, y in pairs)


SHADERS = {
    "BSDF_PRINCIPLED": Material._principled,
    "BSDF_DIFFUSE": Material._diffuse,
    "BSDF_GLOSSY": Material._glossy,
    "BSDF_ANISOTROPIC": Material._glossy,
    "BSDF_METALLIC": Material._metallic,
    "BSDF_GLASS": Material._glass,
    "BSDF_TRANSLUCENT": Material._translucent,
    "BSDF_TRANSPARENT": Material._transparent,
    "SUBSURFACE_SCATTERING": Material._scattering,
    "EMISSION": Material._emission,
    "MIX_SHADER": Material._mix,
    "ADD_SHADER": Material._add,
}
