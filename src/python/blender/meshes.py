# SPDX-License-Identifier: MIT OR Apache-2.0
"""The meshes of a dependency graph as one `.glb`, which Blender's exporter would take from the viewport's graph."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mathutils import Matrix

from .coordinates import MeshSpace
from .images import Images
from .materials import CATCHER, HELD_OUT, HOLDOUT, Film, Material
from .ron import TO_Y_UP, Ron, differ, form, steps, visible
from .textures import ObjectInfo

NO_MATERIAL = {"base_color": 0.8, "metallic": 0.0, "specular": 0.0, "double_sided": True}
# Different values of Object Info's Random among instances.
STEPS = 32
FLOAT, UNSIGNED = 5126, 5125
VERTICES, INDICES = 34962, 34963


class Binary:
    """The numbers of a `.glb`: its views and accessors."""

    def __init__(self) -> None:
        self.bytes = bytearray()
        self.views: list[dict] = []
        self.accessors: list[dict] = []

    def add(self, array: np.ndarray, kind: str, target: int | None = None, bounds: bool = False) -> int:
        """The number of the accessor of an array of `float32` or `uint32`."""
        array = np.ascontiguousarray(array)
        view: dict = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": array.nbytes}
        self.views.append(view | ({"target": target} if target else {}))
        self.bytes += array.tobytes()
        component = UNSIGNED if array.dtype == np.uint32 else FLOAT
        found = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(array), "type": kind}
        if bounds:
            found |= {
                "min": np.atleast_1d(array.min(axis=0)).tolist(),
                "max": np.atleast_1d(array.max(axis=0)).tolist(),
            }
        self.accessors.append(found)
        return len(self.accessors) - 1

    def vectors(self, accessor: int) -> np.ndarray:
        """The vectors of an accessor, (count, 3)."""
        view = self.views[self.accessors[accessor]["bufferView"]]
        first = view["byteOffset"]
        return np.frombuffer(bytes(self.bytes[first : first + view["byteLength"]]), np.float32).reshape(-1, 3)


class Shape(NamedTuple):
    """Where the corners of a mesh are at some time, and their normals."""

    at: np.ndarray
    normals: np.ndarray

    @classmethod
    def of(cls, ob: Any) -> Shape | None:
        mesh = ob.to_mesh()
        found = cls.read(mesh) if mesh else None
        ob.to_mesh_clear()
        return found

    @classmethod
    def read(cls, mesh: Any) -> Shape:
        count = len(mesh.loops)
        corner = _read(mesh.loops, "vertex_index", count, np.int32)
        at = _read(mesh.vertices, "co", len(mesh.vertices) * 3, np.float32).reshape(-1, 3)
        normals = _read(mesh.corner_normals, "vector", count * 3, np.float32).reshape(-1, 3)
        return cls(*(np.nan_to_num(v, nan=0.0, posinf=0.0, neginf=0.0) for v in (at[corner], normals)))

    def equals(self, other: Shape | None) -> bool:
        return other is not None and all(map(np.array_equal, self, other))


class Model:
    """Meshes, the places where they stand, and their materials."""

    def __init__(self, images: Images, override: Any, warn: Callable[[str], None], film: Film):
        self.images, self.override, self.warn, self.film = images, override, warn, film
        self.binary = Binary()
        self.meshes: list[dict] = []
        self.nodes: list[dict] = []
        self.animations: list[dict] = []
        self.numbers: dict[tuple, int | None] = {}
        # Keys of meshes that each object has for itself.
        self.by_object: set[tuple] = set()
        # The nodes of each mesh.
        self.standing: dict[int, list[int]] = {}
        self.names: list[str] = []
        self.overrides: dict[str, Ron] = {}
        self.materials: dict[tuple, Material] = {}

    def add(self, instance: Any, shown: str | None = None) -> int | None:
        """Places the mesh of an instance of the dependency graph. Returns the number of its node, if any of it is seen.

        `shown` is what the film shows in its place.
        """
        ob, place = instance.object, visible(instance.matrix_world)
        if place is None:
            return None
        slots = tuple(slot.material.name_full if slot.material else "" for slot in ob.material_slots)
        # Copies share the data; but the mesh that modifiers make of it is the object's own.
        key = shared = (ob.data.as_pointer() if ob.data else 0, ob.name_full if ob.modifiers else "", slots, shown)
        info = self._info(instance)
        if shared in self.by_object:
            key = (*shared, info)
        if key not in self.numbers:
            mesh = ob.to_mesh()
            number, by_object = self._mesh(ob, mesh, shown, info) if mesh else (None, False)
            ob.to_mesh_clear()
            if by_object:
                self.by_object.add(shared)
                key = (*shared, info)
                if instance.is_instance:
                    self.warn(f"Object Info of instances of {ob.name!r}: its Random has {STEPS} values")
            self.numbers[key] = number
        number = self.numbers[key]
        if number is None:
            return None
        place = TO_Y_UP @ place
        node = {"mesh": number, "name": ob.name, "matrix": [place[r][c] for c in range(4) for r in range(4)]}
        self.nodes.append(node)
        self.standing.setdefault(number, []).append(len(self.nodes) - 1)
        return len(self.nodes) - 1

    def _info(self, instance: Any) -> ObjectInfo:
        """What a material may take from an instance: of many, few numbers, for each is a mesh of its own."""
        info = ObjectInfo.of(instance)
        return info._replace(random=(int(info.random * STEPS) + 0.5) / STEPS) if instance.is_instance else info

    def move(self, node: int, times: list[float], places: list[Matrix]) -> None:
        """Moves a node along with time."""
        shown = [visible(place) for place in places]
        turned = next((place.to_quaternion() for place in shown if place), None)
        # Where nothing of it is seen it is small.
        places = [s or Matrix.LocRotScale(p.translation, turned, (1e-6,) * 3) for s, p in zip(shown, places)]
        parts = steps(places)
        if any(differ(Matrix.LocRotScale(*part), TO_Y_UP @ place, 1e-3) for part, place in zip(parts, places)):
            self.warn(f"object {self.nodes[node]['name']!r}: its motion, for it is sheared")
            return
        del self.nodes[node]["matrix"]
        columns = {
            "translation": np.array([tuple(p[0]) for p in parts], np.float32),
            "rotation": np.array([(p[1].x, p[1].y, p[1].z, p[1].w) for p in parts], np.float32),
            "scale": np.array([tuple(p[2]) for p in parts], np.float32),
        }
        clock = self.binary.add(np.array(times, np.float32), "SCALAR", bounds=True)
        for path, values in columns.items():
            self.nodes[node][path] = values[0].tolist()
            self._animate(node, path, clock, self.binary.add(values, f"VEC{values.shape[1]}"))

    def is_first(self, node: int) -> bool:
        """True for the first node of its mesh."""
        return self.standing[self.nodes[node]["mesh"]][0] == node

    def bend(self, first: int, times: list[float], shapes: list[Shape | None]) -> bool:
        """Moves the vertices of a node's mesh along with time, wherever it stands. True if they move."""
        number, name = self.nodes[first]["mesh"], self.nodes[first]["name"]
        mesh = self.meshes[number]
        rest = self._rest(mesh)
        if len(shapes) != len(times) or any(s is None or s.at.shape != rest.at.shape for s in shapes):
            self.warn(f"object {name!r}: the motion of its vertices, whose number changes")
            return False
        size = max(float(np.ptp(rest.at, axis=0).max()), 1e-9)
        if max(np.abs(s.at - shapes[0].at).max() if s is not shapes[0] else 0.0 for s in shapes) < 1e-5 * size:
            return False
        different = {
            id(s): {
                "POSITION": self.binary.add(s.at - rest.at, "VEC3", VERTICES, bounds=True),
                "NORMAL": self.binary.add(s.normals - rest.normals, "VEC3", VERTICES),
            }
            for s in {id(s): s for s in shapes}.values()
        }
        targets = [different[id(s)] for s in shapes]
        for part in mesh["primitives"]:
            part["targets"] = targets
        mesh["weights"] = [1.0] + [0.0] * (len(times) - 1)
        clock = self.binary.add(np.array(times, np.float32), "SCALAR", bounds=True)
        weights = self.binary.add(np.eye(len(times), dtype=np.float32).ravel(), "SCALAR")
        for node in self.standing[number]:
            self._animate(node, "weights", clock, weights)
        return True

    def _rest(self, mesh: dict) -> Shape:
        attributes = mesh["primitives"][0]["attributes"]
        return Shape(*(self.binary.vectors(attributes[name]) for name in ("POSITION", "NORMAL")))

    def _animate(self, node: int, path: str, clock: int, output: int) -> None:
        if not self.animations:
            self.animations.append({"channels": [], "samplers": []})
        animation = self.animations[0]
        animation["samplers"].append({"input": clock, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})

    def write(self, path: str) -> None:
        """Writes the `.glb`."""
        document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.nodes)))}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": [{"name": name, "doubleSided": True} for name in self.names],
            "accessors": self.binary.accessors,
            "bufferViews": self.binary.views,
            "animations": self.animations,
            "buffers": [{"byteLength": len(self.binary.bytes)}],
        }
        text = json.dumps({key: value for key, value in document.items() if value != []}).encode()
        text += b" " * (-len(text) % 4)
        size = len(self.binary.bytes)
        with open(path, "wb") as out:
            out.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + size))
            out.write(struct.pack("<I4s", len(text), b"JSON") + text)
            out.write(struct.pack("<I4s", size, b"BIN\0"))
            out.write(self.binary.bytes)

    def _mesh(self, ob: Any, mesh: Any, shown: str | None, info: ObjectInfo) -> tuple[int | None, bool]:
        """The number of a mesh, and whether it is that of one object alone, whose materials depend on it."""
        mesh.calc_loop_triangles()
        triangles = len(mesh.loop_triangles)
        if not triangles:
            return None, False
        loops, which = _read(mesh.loop_triangles, "loops", triangles * 3, np.int32), np.empty(triangles, np.int32)
        mesh.loop_triangles.foreach_get("material_index", which)
        which = np.minimum(which, max(len(ob.material_slots) - 1, 0))
        loops = loops.reshape(-1, 3).astype(np.uint32)
        is_whole = _finite(mesh)[loops].all(axis=1)
        if not is_whole.all():
            self.warn(f"object {ob.name!r}: {np.count_nonzero(~is_whole)} triangles, whose vertices are not numbers")
            loops, which = loops[is_whole], which[is_whole]
            if not len(loops):
                return None, False
        space = MeshSpace.of(mesh)
        used = {slot: self._material(ob, int(slot), space, shown, info) for slot in np.unique(which)}
        colors = {m.maps.vertex_colors for _, m in used.values() if m} - {None}
        attributes = self._attributes(mesh, next(iter(colors), None))
        if len(colors) > 1:
            self.warn(f"more than one layer of vertex colours of {ob.name!r}")
        parts = [
            {
                "attributes": attributes,
                "material": number,
                "indices": self.binary.add(loops[which == slot].ravel(), "SCALAR", INDICES),
            }
            for slot, (number, _) in used.items()
        ]
        self.meshes.append({"primitives": parts, "name": ob.name})
        return len(self.meshes) - 1, any(m.maps.object_counts for _, m in used.values() if m)

    def _attributes(self, mesh: Any, color: str | None) -> dict[str, int]:
        count = len(mesh.loops)
        corner = _read(mesh.loops, "vertex_index", count, np.int32)
        shape = Shape.read(mesh)
        found = {
            "POSITION": self.binary.add(shape.at, "VEC3", VERTICES, bounds=True),
            "NORMAL": self.binary.add(shape.normals, "VEC3", VERTICES),
        }
        layers = sorted(mesh.uv_layers, key=lambda layer: not layer.active_render)
        for number, layer in enumerate(layers[:2]):
            uv = _read(layer.uv, "vector", count * 2, np.float32).reshape(-1, 2)
            uv[:, 1] = 1 - uv[:, 1]
            found[f"TEXCOORD_{number}"] = self.binary.add(uv, "VEC2", VERTICES)
        if color is not None:
            layer = mesh.color_attributes.get(color) or mesh.color_attributes.active_color
            if layer is None or layer.domain not in {"POINT", "CORNER"}:
                self.warn(f"the colours {color!r} of the mesh {mesh.name!r}")
            else:
                rgba = _read(layer.data, "color", len(layer.data) * 4, np.float32).reshape(-1, 4)
                found["COLOR_0"] = self.binary.add(rgba[corner] if layer.domain == "POINT" else rgba, "VEC4", VERTICES)
        return found

    def _material(
        self, ob: Any, slot: int, space: MeshSpace, shown: str | None, info: ObjectInfo
    ) -> tuple[int, Material | None]:
        """The number of the material of a slot."""
        material = self.override or (ob.material_slots[slot].material if slot < len(ob.material_slots) else None)
        suffix = f" ({shown})" if shown else ""
        if shown == HOLDOUT:
            return self._number(f"({HOLDOUT})", form("Principled", **HELD_OUT)), None
        if material is None:
            catches = {"shadow_catcher": True} if shown == CATCHER else {}
            return self._number(f"(no material){suffix}", form("Principled", **NO_MATERIAL, **catches)), None
        first = key = (material.name_full, shown)
        found = self.materials.get(first)
        if found and (found.maps.mesh_counts or found.maps.object_counts):
            key = self._key(first, found, space, info)
            found = self.materials.get(key)
        if found is None:
            found = Material(material, space, self.images, self.warn, self.film, shown, info)
            self.materials[first] = self.materials[self._key(first, found, space, info)] = found
            found.number = len(self.names)
            name = f"{material.name_full}{suffix}"
            self._number(name if name not in self.overrides else f"{name} #{len(self.names)}", found.ron)
        return found.number, found

    def _key(self, first: tuple, material: Material, space: MeshSpace, info: ObjectInfo) -> tuple:
        maps = material.maps
        return first + (space if maps.mesh_counts else None, info if maps.object_counts else None)

    def _number(self, name: str, ron: Ron) -> int:
        if name not in self.overrides:
            self.overrides[name] = ron
            self.names.append(name)
        return self.names.index(name)


def _finite(mesh: Any) -> np.ndarray:
    """Whether each corner of a mesh is somewhere."""
    at = _read(mesh.vertices, "co", len(mesh.vertices) * 3, np.float32).reshape(-1, 3)
    return np.isfinite(at).all(axis=1)[_read(mesh.loops, "vertex_index", len(mesh.loops), np.int32)]


def _read(collection: Any, name: str, count: int, kind: type) -> np.ndarray:
    array = np.empty(count, kind)
    collection.foreach_get(name, array)
    return array
