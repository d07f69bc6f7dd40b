# SPDX-License-Identifier: MIT OR Apache-2.0
"""A dependency graph as a scene of rayfront in a folder. Reads Blender's data, and changes none."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, NamedTuple

import bpy
from mathutils import Matrix

from . import strands
from .cameras import camera
from .coordinates import MeshSpace
from .images import Images
from .lights import light
from .materials import CATCHER, HELD_OUT, HOLDOUT, Film, Material
from .meshes import Model, Shape
from .ron import Ron, differ, form, moved, placed, text, unscaled, visible
from .world import surroundings

SCENE = "scene.ron"


class Moments(NamedTuple):
    """The time for which a shutter is open: `part` of a frame, in which places are read at each of `times`.

    `go_back` returns to the frame that is rendered: Blender names files by it, and starts the next picture from it.
    """

    part: float
    times: list[float]
    go_to: Callable[[float], None]
    go_back: Callable[[], None]


class Exported(NamedTuple):
    """What the program has to be told about the scene, and the factor on the light that it finds."""

    size: tuple[int, int]
    shutter: float | None
    exposure: float


class Export:
    """The parts of one scene."""

    def __init__(self, depsgraph: Any, folder: str, warn: Callable[[str], None]):
        self.depsgraph, self.folder, self.warn = depsgraph, folder, warn
        layer = depsgraph.view_layer_eval
        self.images = Images(folder)
        self.groups = {group.name for group in layer.lightgroups}
        # A model for each light group of its objects: a group is of all below an entity.
        self.models: dict[str, Model] = {}
        self.entities: list[dict[str, Any]] = []
        self.count = 0
        self.film = Film.of(depsgraph.scene_eval)
        # What the film shows in place of things.
        self.shown: set[str] = set()

    def write(self, moments: Moments | None) -> Exported:
        """Writes all files. A ValueError says what would make the picture one of something else."""
        scene, layer = self.depsgraph.scene, self.depsgraph.view_layer_eval
        if not scene.camera:
            raise ValueError("the scene has no camera")
        render = scene.render
        # Values with keys are those of the frame in the evaluated scene alone.
        evaluated = self.depsgraph.scene_eval
        part = render.resolution_percentage / 100
        size = (max(1, int(render.resolution_x * part)), max(1, int(render.resolution_y * part)))
        self.entities.append({"name": "camera"})
        eye = self._camera(size)
        world = (getattr(layer, "world_override", None) or evaluated.world) if layer.use_sky else None
        self._include(layer)
        around = surroundings(world, self.images, self.warn)
        for name, entity in zip(("world", "sun of the world"), around.entities):
            self.entities.append({"name": name} | self._group(world) | entity)
        self._collections(layer.layer_collection)
        nodes, shutter = self._instances(), None
        if moments:
            # As in Cycles, lamps and the lens are those in the middle of the shutter's time.
            moments.go_to(0.5)
            eye = self._camera(size)
        self._lamps()
        if moments:
            shutter = self._moves(moments, nodes, size, eye)
        self._models()
        evaluated = self.depsgraph.scene_eval  # Anew, for the shutter has changed the frame.
        self._beside(evaluated)
        lines = "".join(f"  {text(entity)},\n" for entity in self.entities)
        with open(os.path.join(self.folder, SCENE), "w", encoding="utf-8") as out:
            out.write(f"(settings: {text(settings(evaluated, size, around.backdrop))},\nentities: [\n{lines}])\n")
        cycles = getattr(evaluated, "cycles", None)
        return Exported(size, shutter, cycles.film_exposure if cycles else 1.0)

    def _camera(self, size: tuple[int, int]) -> Matrix:
        """Writes the camera as it is now. Returns where its lens is, as seen from the camera."""
        lens, place = camera(self.depsgraph, size, self.folder, self.warn)
        self.entities[0] |= {"camera": lens, "transform": placed(place)}
        return unscaled(self._eye().matrix_world).inverted() @ place

    def _eye(self) -> Any:
        return self.depsgraph.scene.camera.evaluated_get(self.depsgraph)

    def _lamps(self) -> None:
        for instance in self.depsgraph.object_instances:
            ob = instance.object
            if ob.type == "LIGHT" and self._is_visible(instance):
                self.count += 1
                found = light(ob, instance.matrix_world.copy(), self.warn)
                if found:
                    self.entities.append({"name": f"{ob.name} (light{self.count})"} | self._group(ob) | found)

    def _models(self) -> None:
        """Writes the meshes, when all of them are placed, and moved."""
        for number, (group, model) in enumerate(self.models.items()):
            if model.nodes:
                name = f"model{number}.glb"
                model.write(os.path.join(self.folder, name))
                materials = ",\n      ".join(f"{text(key)}: {ron}" for key, ron in model.overrides.items())
                entity = {"gltf": name, "overrides": Ron("{\n      " + materials + ",\n  }")}
                self.entities.append(entity | ({"group": group} if group else {}))

    def _group(self, of: Any) -> dict[str, str]:
        """The light group of an object or a world, as a field."""
        return {"group": of.lightgroup} if of.lightgroup in self.groups else {}

    def _instances(self) -> dict[tuple, tuple[Model, int]]:
        """Adds all but lamps that the dependency graph places. Returns the nodes of the meshes, by what stays the same with time."""
        nodes = {}
        for instance in self.depsgraph.object_instances:
            ob = instance.object
            if ob.type == "LIGHT" or not self._is_visible(instance):
                continue
            if isinstance(ob.data, bpy.types.Mesh):  # Text and the like come once more, as a mesh.
                self._particles(ob)
                # Those of new objects are 0.1 and 0.
                geometry = getattr(ob, "shadow_terminator_geometry_offset", 0.1)
                if geometry > 0.1001 or getattr(ob, "shadow_terminator_shading_offset", 0.0) > 0:
                    self.warn(f"object {ob.name!r}: Shadow Terminator: shadows begin where its triangles turn away")
                if instance.show_self:
                    model = self._model(ob)
                    node = model.add(instance, self._shown(instance))
                    if node is not None:
                        nodes[identity(instance)] = model, node
            elif ob.type == "CURVES":
                if instance.show_self and self.depsgraph.view_layer_eval.use_strand:
                    self._curves(instance)
            elif ob.type in {"VOLUME", "POINTCLOUD"}:  # Grease Pencil is drawn by Blender over any engine's picture.
                self.warn(f"object {ob.name!r}: {'a grid of a volume' if ob.type == 'VOLUME' else 'a point cloud'}")
        return nodes

    def _model(self, ob: Any) -> Model:
        group = self._group(ob).get("group", "")
        if group not in self.models:
            override = self.depsgraph.view_layer_eval.material_override
            self.models[group] = Model(self.images, override, self.warn, self.film)
        return self.models[group]

    def _curves(self, instance: Any) -> None:
        ob, place, self.count = instance.object, visible(instance.matrix_world), self.count + 1
        name = f"strands{self.count}.hair"
        if place is None or not strands.write(ob.data, os.path.join(self.folder, name)):
            return
        override = self.depsgraph.view_layer_eval.material_override
        material = override or next((slot.material for slot in ob.material_slots if slot.material), None)
        entity = {"name": f"{ob.name} ({name})", "shape": form("Strands", file=name)}
        shown = self._shown(instance)
        if shown == HOLDOUT:
            entity["material"] = form("Principled", **HELD_OUT)
        elif material:
            entity["material"] = Material(material, MeshSpace(), self.images, self.warn, self.film, shown).ron
        elif shown:
            self.warn(f"object {ob.name!r}: a shadow catcher without a material")
        self.entities.append(entity | self._group(ob) | {"transform": placed(place)})

    def _particles(self, ob: Any) -> None:
        for system in ob.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                self.warn(f"object {ob.name!r}: hair by particles (convert it to curves)")

    def _shown(self, instance: Any) -> str | None:
        """What the film shows in place of an instance, because of the object or, as in Cycles, of what places it."""
        layer = self.depsgraph.view_layer_eval
        either = [ob for ob in (instance.object, instance.parent) if ob]
        found = None
        if any(ob.holdout_get(view_layer=layer) for ob in either):
            found = HOLDOUT
            if not self.film.transparent:
                self.warn(f"object {instance.object.name!r}: a holdout, without Film › Transparent")
                return None
            self.warn(f"object {instance.object.name!r}: the light of a holdout on other things: it gives none back")
        elif any(ob.is_shadow_catcher for ob in either):
            found = CATCHER
        if found:
            self.shown.add(found)
        return found

    def _beside(self, scene: Any) -> None:
        """Tells of what the program leaves out beside shadow catchers, of which it also makes holdouts."""
        if not self.shown:
            return
        beside = f"beside a {' and a '.join(sorted(self.shown))}"
        if self.groups:
            self.warn(f"light groups, {beside}")
        if len(self.shown) > 1:
            self.warn("smooth edges of holdouts before shadow catchers")
        materials = [ron for model in self.models.values() for ron in model.overrides.values()]
        if scene.rayfront.caustics and any("transmission: " in ron for ron in materials):
            self.warn(f"Caustics by photons, {beside}: they are left to chance")

    def _is_visible(self, instance: Any) -> bool:
        """Tells of what hides an instance, by itself or, as in Cycles, by what places it, from some rays. False if all do."""
        ob = instance.object
        if ob.type == "LIGHT":
            kinds = ("diffuse", "glossy", "transmission", "volume_scatter")
        elif isinstance(ob.data, bpy.types.Mesh) or ob.type == "CURVES":
            kinds = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
        else:
            return True
        either = [of for of in (ob, instance.parent) if of]
        hidden = [kind for kind in kinds if not all(getattr(of, f"visible_{kind}") for of in either)]
        if len(hidden) == len(kinds):
            return False
        if hidden:
            names = ", ".join(kind.replace("_", " ") for kind in hidden)
            self.warn(f"object {ob.name!r}: it is not hidden from rays of the kind {names}")
        if ob.light_linking.receiver_collection or ob.light_linking.blocker_collection:
            self.warn(f"object {ob.name!r}: light linking")
        return True

    def _include(self, layer: Any) -> None:
        """Tells of what a view layer leaves out, except for the world, curves and motion blur."""
        for name, what in (("use_solid", "Surfaces"), ("use_volumes", "Volumes")):
            if not getattr(layer, name):
                self.warn(f"the view layer without {what}: they are seen")

    def _collections(self, layer: Any) -> None:
        """Tells of what a view layer does with collections beyond hiding them."""
        for child in layer.children:
            if child.indirect_only and not child.exclude:
                self.warn(f"collection {child.name!r}: Indirect Only: the camera sees it")
            self._collections(child)

    def _moves(
        self, moments: Moments, nodes: dict[tuple, tuple[Model, int]], size: tuple, shift: Matrix
    ) -> float | None:
        """Gives moving meshes and the camera their places at several times. Returns the shutter's part, if any moves.

        `size` is that of the image, `shift` where the lens is, as seen from the camera.
        """
        seen: dict[tuple, list[Matrix]] = {key: [] for key in nodes}
        shapes = {key: [] for key, (model, node) in nodes.items() if model.is_first(node)}
        cameras, lenses, unblurred = [], [], set()
        strands_at: dict[tuple, list[tuple[Matrix, bytes]]] = {}
        try:
            for time in moments.times:
                moments.go_to(time)
                cameras.append(self._eye().matrix_world.copy())
                lenses.append(camera(self.depsgraph, size, self.folder, lambda _: None)[0])
                for instance in self.depsgraph.object_instances:
                    key = identity(instance)
                    if not blurs(instance.object):
                        unblurred.add(key)
                    if key in seen:
                        seen[key].append(instance.matrix_world.copy())
                    if key in shapes and may_bend(instance.object):
                        shape, known = Shape.of(instance.object), shapes[key]
                        # Most stay as they are, and are kept once.
                        known.append(known[0] if known and shape and shape.equals(known[0]) else shape)
                    if instance.object.type == "CURVES":
                        at = instance.matrix_world.copy(), strands.digest(instance.object.data)
                        strands_at.setdefault(key, []).append(at)
        finally:
            moments.go_back()
        moving = {
            key: places
            for key, places in seen.items()
            if len(places) == len(moments.times) and any(differ(places[0], other) for other in places[1:])
        }
        # Of the program's frames of one second.
        times = [time * moments.part for time in moments.times]
        for key, places in moving.items():
            model, node = nodes[key]
            model.move(node, times, [places[len(places) // 2]] * len(places) if key in unblurred else places)
        for key in unblurred & set(shapes):
            shapes[key] = [found[len(found) // 2] for found in [shapes[key]] for _ in found]
        bent = [nodes[key][0].bend(nodes[key][1], times, found) for key, found in shapes.items() if found]
        for (name, *_), places in strands_at.items():
            (first, points), *others = places
            if any(points != p or differ(first, m) for m, p in others):
                self.warn(f"object {name!r}: the motion of its hair")
        zooms = self._zooms(times, lenses)
        if any(differ(cameras[0], other) for other in cameras[1:]):
            self.entities[0]["transform"] = moved(times, [unscaled(m) @ shift for m in cameras])
        elif not moving and not any(bent) and not zooms:
            return None
        return moments.part

    def _zooms(self, times: list[float], lenses: list[Ron]) -> bool:
        """Gives a camera that zooms its focal lengths, and tells of what else Cycles blurs beside motion."""
        cycles = getattr(self.depsgraph.scene_eval, "cycles", None)
        if getattr(cycles, "rolling_shutter_type", "NONE") != "NONE":
            self.warn("Rolling Shutter: all rows see the same time")
        lengths = [lens.fields.get("focal_length_mm", lens.fields.get("fx", 0.0)) for lens in lenses]
        if max(lengths) - min(lengths) <= 1e-4 * max(lengths):
            return False
        lens = self.entities[0]["camera"]
        if lens.name != "Photographic":
            self.warn("the zoom of a camera with pixels that are not square: it is that of the shutter's middle")
            return False
        keys = Ron(f"Keys({text(list(zip(times, lengths)))})")
        self.entities[0]["camera"] = form(lens.name, **lens.fields | {"focal_length_mm": keys})
        return True


def blurs(ob: Any) -> bool:
    """Whether an object's own Motion Blur, of Cycles, is on."""
    return getattr(getattr(ob, "cycles", None), "use_motion_blur", True)


def may_bend(ob: Any) -> bool:
    """True for objects whose vertices may move by themselves."""
    original = ob.original
    return bool(ob.modifiers or original.type != "MESH" or original.data.shape_keys)


def identity(instance: Any) -> tuple:
    """What an instance is, at any time."""
    parent = instance.parent.name_full if instance.parent else ""
    return instance.object.name_full, parent, tuple(instance.persistent_id) if instance.is_instance else ()


def settings(scene: Any, size: tuple[int, int], backdrop: tuple[float, ...] | None) -> dict[str, Any]:
    """How to render, and what the camera sees in place of the surroundings."""
    mine = scene.rayfront
    fields: dict[str, Any] = {
        "size": size,
        "samples": mine.samples,
        "max_depth": mine.max_depth,
        "transport": Ron("Path"),
        "exposure": Ron("Fixed"),
        "seed": mine.seed,
        "filter": pixel_filter(scene),
    }
    for kind in ("diffuse", "glossy", "transmission"):
        depth = getattr(mine, f"{kind}_depth")
        if depth < mine.max_depth:
            fields[f"{kind}_depth"] = depth
    if not mine.caustics:
        fields["caustics"] = Ron("Off")
    if mine.clamp > 0:
        fields["clamp"] = mine.clamp
    if scene.render.film_transparent:
        fields["transparent"] = True
    elif backdrop:
        fields["backdrop"] = backdrop
    return fields


def pixel_filter(scene: Any) -> Ron:
    """The filter of Cycles, else, without that add-on, that of the width that EEVEE has."""
    cycles = getattr(scene, "cycles", None)
    width = max(cycles.filter_width if cycles else scene.render.filter_size, 0.01)
    kind = cycles.pixel_filter_type if cycles else "BLACKMAN_HARRIS"
    if kind == "BOX":
        return Ron("Box")
    if kind == "GAUSSIAN":
        return form(
            "Gaussian", radius=0.75 * width
        )  # Its deviation is a quarter of the width, and a third of the radius.
    # What Blender calls a width is where the weight is zero: rayfront's radius.
    return form("BlackmanHarris", radius=width)


def folder(path: str) -> str:
    """A folder that exists, named as in Blender."""
    found = bpy.path.abspath(path)
    os.makedirs(found, exist_ok=True)
    return found
