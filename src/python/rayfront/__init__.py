"""A renderer and ray queries for the CPU.

    import rayfront
    rayfront.load("model.glb").render(size=(640, 360), spp=64).save("model.png")

`load` reads a scene (`.ron`), a model (`.gltf`, `.glb`) or a mesh (`.ply`, `.obj`, `.stl`). `World` makes a scene of dicts with the
keys of scene files; each form of scene files is an attribute of this module, such as `rayfront.Sphere(radius_m=1)` or
`rayfront.Path`. `Scene` traces rays through meshes, spheres and instances.
"""

from __future__ import annotations

import os
import re
import warnings as _warnings
from typing import NamedTuple

import numpy as np

from . import _native
from ._native import Rendering, __version__, allow_outside

__all__ = [
    "Finding",
    "Hits",
    "Mesh",
    "Rendering",
    "Scene",
    "SceneBuilder",
    "SceneWarning",
    "Variant",
    "World",
    "allow_outside",
    "load",
    "__version__",
]


class SceneWarning(UserWarning):
    """The image of a scene is probably not as intended."""


class Finding(NamedTuple):
    """Something that is probably not as intended: its subject, the problem, and the remedy."""

    about: str | None
    what: str
    remedy: str | None


class Variant:
    """A form, as in scene files: a name, with or without values.

    A keyword of Python takes an underscore at its end: `LookAt(from_=(0, 1, 4), to=(0, 0, 0))`.
    """

    def __init__(self, name, values=(), fields=None):
        self._name, self._values, self._fields = name, tuple(values), fields

    def __call__(self, *values, **fields):
        if values and fields:
            raise TypeError(f"{self._name}: give all values by keyword, or none")
        return Variant(self._name, values, fields)

    def __repr__(self):
        return _ron(self, {})


class Mesh(Variant):
    """A mesh from arrays, or from a file (`.ply`, `.obj`, `.stl`).

    vertices (N, 3), faces (F, 3), normals (N, 3) and uvs (N, 2); or one object with `vertices` and `faces`, such as a
    mesh of trimesh; or a path. colors: (N, 3), or (F, 3) for faces, linear if they are floats and sRGB if they are uint8;
    they multiply the material's colour. The colors of a trimesh mesh are used.
    """

    def __init__(self, vertices, faces=None, normals=None, uvs=None, colors=None):
        if isinstance(vertices, (str, os.PathLike)):
            super().__init__("Mesh", (os.fspath(vertices),))
            self.arrays = None
            return
        super().__init__("Mesh")
        if colors is None and faces is None:
            colors = _colors_of(vertices)
        vertices, faces = _mesh(vertices, faces)
        normals, uvs, colors = _floats(normals), _floats(uvs), _colors(colors)
        if colors is not None and len(colors) != len(vertices):
            if len(colors) != len(faces):
                raise ValueError(f"there are {len(colors)} colors for {len(vertices)} vertices and {len(faces)} faces")
            # Each face has corners of its own.
            colors = np.repeat(colors, 3, axis=0)
            vertices, normals, uvs = (
                array if array is None else np.ascontiguousarray(array[faces.ravel()]) for array in (vertices, normals, uvs)
            )
            faces = np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
        self.arrays = (vertices, faces, normals, uvs, colors)


class World:
    """A scene: entities, the materials that they share, and how to render them.

    `entities` is a list of dicts of components, `materials` a dict of materials by name, `settings` a dict. Keys and defaults
    are those of scene files. Paths of files are relative to `folder`.

        World(
            settings={"size": (320, 180), "samples": 16, "transport": rayfront.Path},
            materials={"red": rayfront.Principled(base_color="#a01010", metallic=0)},
            entities=[
                {"camera": rayfront.Pinhole(vertical_fov_degrees=40),
                 "transform": rayfront.LookAt(from_=(0, 1, 4), to=(0, 0, 0))},
                {"shape": rayfront.Sphere(radius_m=1), "material": "red"},
                {"light": rayfront.Sky(elevation_degrees=30)},
            ],
        )
    """

    def __init__(self, entities=(), *, materials=None, settings=None, folder="."):
        meshes = {}
        lines = [(None, "(")]
        lines += [("settings", f"settings: {_ron(dict(settings or {}), meshes)},"), (None, "materials: {")]
        named = dict(materials or {}).items()
        lines += [(f"materials[{name!r}]", f"{_string(name)}: {_ron(item, meshes)},") for name, item in named]
        lines += [(None, "},"), (None, "entities: [")]
        lines += [(f"entities[{i}]", _ron(item, meshes) + ",") for i, item in enumerate(entities)]
        lines += [(None, "],"), (None, ")")]
        self.text = "\n".join(line for _, line in lines)
        """The text of the scene as a scene file."""
        arrays = [(name, *mesh.arrays) for name, mesh in meshes.values()]
        try:
            self._native = _native.World.parse(self.text, os.fspath(folder), arrays)
        except ValueError as error:
            raise _in_place(error, lines, [name for name, _ in meshes.values()]) from None

    @classmethod
    def _of(cls, native):
        world = cls.__new__(cls)
        world._native, world.text = native, None
        return world

    @property
    def cameras(self):
        """The names of the cameras; the first one is the default."""
        return self._native.cameras

    @property
    def warnings(self):
        """Oddities that are no errors."""
        return self._native.warnings

    def parts(self, query=None):
        """Returns the parts that a query selects, such as 'Light' or 'Material["gl*"]': a name and its components each.

        The components are texts as in a scene file. Without a query: all entities and materials.
        """
        return self._native.parts(query)

    @property
    def size(self):
        """Width and height of the image; `render(size=…)` overrides it."""
        return tuple(self._native.size)

    def render(
        self,
        size=None,
        spp=None,
        *,
        seed=None,
        camera=None,
        layers=(),
        schedule="wavefront",
        threads=0,
        denoise=False,
        crop=None,
        noise=None,
        depth=None,
        exposure=None,
        tonemap=None,
        transport=None,
        progress=None,
    ):
        """Renders the scene. Arguments override its settings.

        size: width and height in pixels. spp: samples per pixel. layers: some of depth, normal, albedo, position, entity,
        material, coverage, samples, variance, nodes, tests, path-length, time. schedule: wavefront or recursive; the image is the same. threads: 0 is one for
        each core. denoise: also returns an image without noise. crop: only the columns x0 to x1 and rows y0 to y1, as (x0, y0, x1, y1).
        noise: stops once the noise is below this fraction of the image's brightness, such as 0.01. depth: bounces. exposure (in stops, or
        "auto") and tonemap (clamp, scale-by-maximum, reinhard, aces, agx, pbr-neutral): the display of images, not the
        values of `numpy`. transport: path, whitted or auto. progress: called with the fraction that is done, 0 to 1.

        A probable mistake, such as a scene without light, raises a `SceneWarning`. Other Python threads keep running, and
        Ctrl-C ends the rendering.
        """
        if isinstance(layers, str):
            layers = (layers,)
        # Settings take forms, so forms are valid here, too.
        tonemap, transport = (value._name if isinstance(value, Variant) else value for value in (tonemap, transport))
        size = None if size is None else _size(size)
        for what, value in (("spp", spp), ("seed", seed), ("threads", threads), ("depth", depth)):
            if value is not None and (isinstance(value, bool) or not hasattr(value, "__index__") or value < 0):
                raise ValueError(f"{what} must be a whole number of at least 0, not {value!r}")
        if camera is not None and not isinstance(camera, str):
            raise ValueError(f"camera must be one of {self.cameras}, not {camera!r}")
        if crop is not None:
            sides = list(crop) if isinstance(crop, (tuple, list, np.ndarray)) else []
            if len(sides) != 4 or any(side != int(side) or side < 0 for side in sides):
                raise ValueError(f"crop must be (x0, y0, x1, y1) in pixels, not {crop!r}")
            crop = [int(side) for side in sides]
        rendering = self._native.render(
            size, spp, seed, camera, list(layers), schedule, threads, denoise, crop, noise, depth, exposure, tonemap, transport, progress
        )
        for warning in rendering.warnings:
            _warnings.warn(warning, SceneWarning, stacklevel=2)
        return rendering

    def check(self, size=None, camera=None):
        """Returns probable mistakes as `Finding`s: no light, a camera within a wall, lights in wrong units …"""
        size = None if size is None else _size(size)
        return [Finding(*finding) for finding in self._native.check(size, camera)]


def _variable(value):
    """The text of a variable's value in a scene file."""
    if isinstance(value, (str, bool)):
        return value if isinstance(value, str) else str(value).lower()
    if np.ndim(value) > 0:
        return f"({', '.join(_variable(part) for part in value)})"
    return repr(np.asarray(value).item())


def load(
    path,
    *,
    time=None,
    variant=None,
    scene=None,
    animation=None,
    env=None,
    set=(),
    hide=(),
    only=(),
    look_at=None,
    orbit=None,
    zoom=None,
    ground=False,
    light_units="auto",
    solid_glass=False,
    double_sided=False,
    size=None,
    up="y",
    env_turn=None,
    env_strength=None,
    background=None,
    var=None,
):
    """Reads a scene, a model or a mesh; adds the camera and the light that it lacks.

    time: the moment of animations, in seconds. variant, scene, animation: of a glTF file, by name or number. env: the
    environment: a picture, "studio", "sky" or "sky:30,220". set: statements that change values, such as 'Material["paint"].roughness = 0.2'. hide, only: queries
    that select what is removed, or kept. look_at: the camera's position and its target, ((x, y, z), (x, y, z)). orbit: the angles
    in degrees by which cameras orbit their target, (right, up). zoom: the factor by which they come nearer. ground: adds a grey
    floor (True), or one of which only shadows are seen ("shadow"). light_units ("auto", "candela", "watt"), solid_glass and double_sided: the interpretation of glTF files. size: the size
    of the image, for which an added camera is placed. up: the axis that points up in a model or mesh, "y" or "z". env_turn: the
    angle in degrees by which environments are turned, clockwise seen from above. env_strength: the factor on their light.
    background: what images show behind things, a grey, (red, green, blue), "#c03020", a gradient as in scene files, or the
        path of a picture; it lights nothing.
    var: values of the scene file's variables by name: numbers, tuples, or text as in scene files, {"paint": "Srgb(1, 0, 0)"}.
    """
    scene, animation = (None if given is None else str(given) for given in (scene, animation))
    lists = [[text] if isinstance(text, str) else list(text) for text in (set, hide, only)]
    if look_at is not None:
        places = np.asarray(look_at, dtype=np.float64) if not isinstance(look_at, str) else np.zeros(0)
        if places.shape != (2, 3):
            raise ValueError(f"look_at must be two points, ((x, y, z), (x, y, z)), not {look_at!r}")
        look_at = places.tolist()
    if orbit is not None:
        orbit = np.asarray(orbit, dtype=np.float64).tolist()
        if not isinstance(orbit, list) or len(orbit) != 2:
            raise ValueError(f"orbit must be two angles in degrees, (right, up), not {orbit!r}")
    size = None if size is None else _size(size)
    ground = {True: "grey", False: None}.get(ground, ground)
    if background is not None and not isinstance(background, str):
        background = str(np.asarray(background, dtype=np.float64).tolist()).strip("[]")
    how = (look_at, orbit, zoom, ground, light_units, solid_glass, double_sided, size)
    var = {name: _variable(value) for name, value in (var or {}).items()}
    how += (up, env_turn, env_strength, background, var)
    return World._of(_native.World.load(os.fspath(path), time, variant, scene, animation, env, *lists, *how))


class Hits(NamedTuple):
    """The hits of rays: one value for each ray.

    t is in lengths of the direction, and infinite for a miss; u and v are the weights of a triangle's second and third corner;
    instance, shape and primitive are numbers, -1 for a miss.
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    instance: np.ndarray
    shape: np.ndarray
    primitive: np.ndarray


class SceneBuilder:
    """Shapes and their placements. A shape without a placement is not hit."""

    def __init__(self):
        self._native = _native.Builder()

    def add_mesh(self, vertices, faces=None):
        """Adds a mesh, vertices (N, 3) and faces (F, 3) or an object that has both, and returns its number."""
        return self._native.add_mesh(*_mesh(vertices, faces))

    def add_spheres(self, spheres):
        """Adds a shape of spheres (N, 4), centres and radii, and returns its number."""
        return self._native.add_spheres(_columns("spheres", spheres, 4))

    def place(self, shape, to_world=None):
        """Places a shape by a matrix (3, 4) or (4, 4), by default the identity, and returns the instance's number."""
        matrix = _affine(np.eye(4) if to_world is None else to_world)
        if shape < 0:
            raise ValueError(f"shape must be a number that add_mesh or add_spheres returned, not {shape}")
        return self._native.place(shape, matrix.ravel().tolist())

    def build(self):
        """Builds the scene. The builder cannot be used again."""
        return Scene._of(self._native.build())


class Scene:
    """A scene for ray queries: a mesh, or the result of a `SceneBuilder`.

        scene = Scene(vertices, faces)          # (N, 3) and (F, 3), or an object that has both
        hits = scene.closest(origins, directions)
    """

    def __init__(self, vertices, faces=None):
        builder = SceneBuilder()
        builder.place(builder.add_mesh(vertices, faces))
        self._native = builder._native.build()

    @classmethod
    def _of(cls, native):
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    def closest(self, origins, directions, t_min=0.0, t_max=np.inf, *, coherence="unknown", threads=0):
        """Returns the nearest hit of each ray origin + t * direction with t_min < t <= t_max; t_min below 0 counts as 0.

        origins, directions: (N, 3); t_min, t_max: a number, or one for each ray. coherence: the relation of successive rays,
        "coherent", "scattered" or "unknown"; it only affects the time. threads: 0 is one for each core; up to 16384 rays are
        traced by the calling thread.
        """
        return Hits(*self._native.closest(*_rays(origins, directions, t_min, t_max), coherence, threads))

    def any(self, origins, directions, t_min=0.0, t_max=np.inf, *, coherence="unknown", threads=0):
        """Returns for each ray whether it hits anything."""
        return self._native.any(*_rays(origins, directions, t_min, t_max), coherence, threads)

    @property
    def bounds(self):
        """The bounding box's corners, (2, 3), padded by the rounding error; None for an empty scene."""
        bounds = self._native.bounds
        return None if bounds is None else np.array(bounds, dtype=np.float32)

    @property
    def memory_bytes(self):
        """The scene's memory in bytes."""
        return self._native.memory_bytes


# The forms of scene files, except `Mesh`.
_FORMS = """
    Aces Add Agx Albedo All Alpha Area Auto Bezier Bilinear BlackmanHarris Blend Blinn BlinnPhong Blue Box Bricks
    Candela Capsule CatmullClark CatmullRom Cells Center Checker Clamp Cone Constant Coverage Curve Cylinder Depth
    Directional Disc Displace Distance Edges Entity Environment Equidistant Equisolid Fisheye Fixed Flat Fractal
    Gaussian Gradient Green Grid HeightField Image Independent Intrinsics InverseSquare Jittered Kelvin Keys Lathe Left
    Linear LookAt Loop Lumens Lux Marble Mask Material Matrix Max Metaballs Metal Min Mirror Mix Multiply Nearest Nits
    Nodes Noise Normal Normals Object Off On Opaque Open OpenCv Orthographic OverUnder Panorama Path PathLength
    PbrNeutral Phong Photographic Photometric Pinhole Plane Point Position Principled Prism Rectangle Red Regular
    Reinhard Repeat Ridged Right Round Samples ScaleByMaximum SideBySide Sky Smooth Smoothstep Sobol Sphere Spot Squared
    Srgb Step Stereographic Strands Subdivide Subtract Tent Tests Text Texture ThinLens Time Torus Triangle Trilinear
    Tube Turbulence Unbiased Uniform Uv Uv1 Variance Vertex Voronoi Whitted Wood
""".split()
globals().update({name: Variant(name) for name in _FORMS})


def _colors(colors):
    """Converts colours to linear ones; bytes are sRGB."""
    if colors is None:
        return None
    colors = np.asarray(colors)
    if colors.ndim != 2 or colors.shape[1] not in (3, 4):
        raise ValueError(f"colors must have the shape (N, 3), not {colors.shape}")
    colors = colors[:, :3]
    if colors.dtype != np.uint8:
        if not np.issubdtype(colors.dtype, np.floating):
            raise TypeError(f"colors must be uint8 (sRGB) or floats (linear), not {colors.dtype}")
        if not (colors >= 0).all():
            raise ValueError("colors must be at least 0")
        return _floats(colors)
    part = colors / 255
    return _floats(np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4))


def _colors_of(mesh):
    """The colours of a trimesh mesh; its textures are not supported."""
    visual = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "texture":
        what = "the texture and the material of the mesh are not used: export it as .glb and load that"
        _warnings.warn(what, SceneWarning, stacklevel=3)
    return {"vertex": lambda: visual.vertex_colors, "face": lambda: visual.face_colors}.get(kind, lambda: None)()


def _floats(array):
    return None if array is None else np.ascontiguousarray(array, dtype=np.float32)


def _columns(what, array, count):
    array = _floats(array)
    if array.ndim != 2 or array.shape[1] != count:
        raise ValueError(f"{what} must have the shape (N, {count}), not {array.shape}")
    return array


def _mesh(vertices, faces):
    if faces is None:
        if not (hasattr(vertices, "vertices") and hasattr(vertices, "faces")):
            # A file may hold several meshes, which trimesh gives as a scene of its own.
            advice = ": use its to_mesh()" if hasattr(vertices, "to_mesh") else ""
            raise TypeError(f"give vertices and faces, or an object that has both{advice}")
        vertices, faces = vertices.vertices, vertices.faces
    faces = np.asarray(faces)
    if faces.size and not np.issubdtype(faces.dtype, np.integer):
        raise TypeError(f"faces must be whole numbers, not {faces.dtype}")
    if faces.size and (faces.min() < 0 or faces.max() > 0xFFFFFFFF):
        raise ValueError("faces must be indices of vertices, from 0")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces must have the shape (F, 3), not {faces.shape}: only triangles are supported")
    return _columns("vertices", vertices, 3), np.ascontiguousarray(faces, dtype=np.uint32)


def _size(size):
    sides = list(size) if isinstance(size, (tuple, list, np.ndarray)) else []
    if len(sides) != 2 or any(side != int(side) or side < 1 for side in sides):
        raise ValueError(f"size must be a width and a height in pixels, such as (640, 360), not {size!r}")
    return [int(side) for side in sides]


def _rays(origins, directions, t_min, t_max):
    # A single origin or direction is used for all rays.
    origins, directions = (
        _columns(what, np.atleast_2d(_floats(array)), 3)
        for what, array in (("origins", origins), ("directions", directions))
    )
    count = max(len(origins), len(directions)) if len(origins) and len(directions) else 0
    columns = []
    for what, array in (("origins", origins), ("directions", directions)):
        if len(array) not in (1, count):
            raise ValueError(f"there are {len(origins)} origins and {len(directions)} directions")
        columns.append(array if len(array) == count else np.tile(array, (count, 1)))
    for what, t in (("t_min", t_min), ("t_max", t_max)):
        t = _floats(t).ravel()
        if t.size not in (1, count):
            raise ValueError(f"{t.size} {what} for {count} rays")
        columns.append(t if t.size == count else np.full(count, t[0], np.float32))
    return tuple(columns)


def _in_place(error, lines, meshes):
    """The error with the place in the arguments instead of a line and a column of the text."""
    for name in meshes:
        if str(error).startswith(f"{name}: "):
            place = next((place for place, line in lines if f'Mesh("{name}")' in line), None)
            return ValueError(f"{place or 'World'}: its mesh: {str(error)[len(name) + 2 :]}")
    found = re.search(r"World:(\d+):(\d+): (.*)", str(error), re.S)
    if not found or int(found[1]) > len(lines):
        return error
    place, line = lines[int(found[1]) - 1]
    column = int(found[2]) - 1
    start = max(0, column - 40)
    shown = line[start : column + 60]
    return ValueError(f"{place or 'World'}: {found[3]}\n  {shown}\n  {' ' * (column - start)}^")


# Fields whose keys are names of the user.
_BY_NAME = {"materials", "overrides"}


def _ron(value, meshes, by_name=False):
    """The value as in a scene file; meshes of arrays get names by which the reader finds them."""
    if isinstance(value, Mesh) and value.arrays is not None:
        name, _ = meshes.setdefault(id(value), (f"array-{len(meshes)}.ply", value))
        return f'Mesh("{name}")'
    if isinstance(value, Variant):
        if value._name == "Matrix" and len(value._values) == 1:
            return _matrix(value._values[0], meshes)
        if value._fields is None and not value._values:
            return value._name
        inside = [_ron(item, meshes) for item in value._values]
        return f"{value._name}({', '.join(inside)}{_fields(value._fields or {}, meshes)})"
    if isinstance(value, dict) and by_name:
        items = (f"{_string(name)}: {_ron(item, meshes)}" for name, item in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, dict):
        return f"({_fields(value, meshes)})"
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (str, os.PathLike)):
        return _string(os.fspath(value))
    if isinstance(value, np.ndarray) and value.shape in ((3, 4), (4, 4)):
        return _matrix(value, meshes)
    # Lists of numbers are vectors: scene files have no lists of numbers.
    if isinstance(value, list) and value and all(isinstance(item, (int, float, np.number)) for item in value):
        value = tuple(value)
    if isinstance(value, list) and len(value) in (3, 4) and all(_is_row(row) for row in value):
        return _matrix(value, meshes)
    if isinstance(value, list):
        return "[" + ", ".join(_ron(item, meshes) for item in value) + "]"
    if isinstance(value, (tuple, np.ndarray)):
        return "(" + ", ".join(_ron(item, meshes) for item in value) + ")"
    raise TypeError(f"{value!r} cannot be written in a scene file")


def _is_row(row):
    """Tests for a row of a matrix."""
    is_list = isinstance(row, (list, tuple)) and len(row) == 4
    return is_list and all(isinstance(number, (int, float, np.number)) for number in row)


def _affine(rows):
    """The first three rows of a matrix."""
    matrix = np.asarray(rows, dtype=np.float64)
    if matrix.shape not in ((3, 4), (4, 4)):
        raise ValueError(f"a matrix must have the shape (3, 4) or (4, 4), not {matrix.shape}")
    if len(matrix) == 4 and not np.allclose(matrix[3], [0, 0, 0, 1], atol=1e-6):
        raise ValueError("the last row of a matrix must be 0, 0, 0, 1: translations are in the last column")
    return matrix[:3]


def _matrix(rows, meshes):
    return f"Matrix({_ron(tuple(map(tuple, _affine(rows))), meshes)})"


def _fields(fields, meshes):
    given = ((name.rstrip("_"), value) for name, value in fields.items() if value is not None)
    return ", ".join(f"{name}: {_ron(value, meshes, name in _BY_NAME)}" for name, value in given)


def _string(text):
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{{{ord(c):x}}}" for c in escaped) + '"'
