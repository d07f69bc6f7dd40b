# SPDX-License-Identifier: MIT OR Apache-2.0
"""Renders scenes in Blender's Python module with rayfront and with Cycles, and compares: see README.md.

    python test_blender.py PROGRAM [FOLDER] [--only NAMES] [--list]

PROGRAM is packed as an extension and installed as a user would, in a folder for this test alone. FOLDER keeps the
pictures. Exits with 1 if something is not as it should be.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import inspect
import json
import math
import os
import re
import struct
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from typing import Any

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
HOME = tempfile.TemporaryDirectory(prefix="rayfront_test_")
os.environ["BLENDER_USER_RESOURCES"] = HOME.name

import bpy  # noqa: E402  (after its folder is known)
import numpy as np  # noqa: E402

import package  # noqa: E402
import test_looks  # noqa: E402
import test_node_looks  # noqa: E402, F401  (its looks are added to those of test_looks)
import test_scenes as scenes  # noqa: E402
import test_told  # noqa: E402

SIZE = (128, 72)
TESTS: dict[str, Callable] = {}
failures: list[str] = []
FOLDER = ""


def test(function: Callable) -> Callable:
    TESTS[function.__name__] = function
    return function


def check(name: str, holds: bool, what: str) -> None:
    print(f"{'ok    ' if holds else 'FAILED'} {name}: {what}", flush=True)
    if not holds:
        failures.append(name)


def engine() -> Any:
    from bl_ext.user_default.rayfront.engine import RayfrontEngine

    return RayfrontEngine


def shoot(scene: Any, name: str, samples: int, cycles: bool = False) -> dict[str, np.ndarray]:
    """The planes of a picture, by their names without the layer's."""
    from bl_ext.user_default.rayfront import exr

    scene.render.engine = "CYCLES" if cycles else "RAYFRONT"
    if cycles:
        scene.cycles.samples = samples
    else:
        scene.rayfront.samples = samples
    render = scene.render
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    render.image_settings.exr_codec = "ZIP"
    render.filepath = os.path.join(FOLDER, f"{name}_{'cycles' if cycles else 'rayfront'}.exr")
    bpy.ops.render.render(write_still=True)
    planes = exr.read(render.filepath)
    return {key.split(".", 1)[1]: plane for key, plane in planes.items()}


def rgb(planes: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([planes[f"Combined.{c}"] for c in "RGB"], axis=2)


def save(name: str, *pictures: np.ndarray) -> None:
    """A row of pictures as a PNG."""
    from bl_ext.user_default.rayfront.images import write_png

    row = np.clip(np.concatenate(pictures, axis=1), 0, 1)
    row = np.where(row < 0.0031308, row * 12.92, 1.055 * row ** (1 / 2.4) - 0.055)
    write_png(os.path.join(FOLDER, f"{name}.png"), row)


def blocks(picture: np.ndarray, side: int = 12) -> np.ndarray:
    height, width = (n // side * side for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // side, side, width // side, side, -1).mean(axis=(1, 3))


def compare(name: str, scene: Any, samples: int, of_cycles: int, limit: float = 0.02, rms: float = 0.05) -> None:
    """The same scene by both: the ratio of the means, and the difference of blocks of 12 x 12 pixels."""
    theirs = rgb(shoot(scene, name, of_cycles, cycles=True))
    started = time.perf_counter()
    ours = rgb(shoot(scene, name, samples))
    seconds = time.perf_counter() - started
    ratio = ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1))
    difference = math.sqrt(((blocks(ours) - blocks(theirs)) ** 2).mean()) / theirs.mean()
    save(name, ours, theirs)
    lost = engine().last["lost"]
    what = f"ratios {' '.join(f'{r:.4f}' for r in ratio)}, blocks {difference:.3f}, {seconds:.1f} s"
    check(name, bool(np.all(np.abs(ratio - 1) < limit)) and difference < rms, what + (f"; {lost}" if lost else ""))


@test
def four_lamps() -> None:
    compare("four_lamps", scenes.lamps(SIZE, "POINT", "SUN", "AREA", "SPOT"), 128, 256, 0.003)


@test
def each_lamp() -> None:
    for kind in ("POINT", "SUN", "AREA", "SPOT"):
        compare(f"lamp_{kind.lower()}", scenes.lamps(SIZE, kind), 64, 128, 0.005)


@test
def lamps_in_mirrors() -> None:
    """Mirrors and glass show lamps that the camera does not see. Without it the means are 0.6 to 0.9."""
    for kind, fields in (
        ("AREA", {"energy": 60, "shape": "SQUARE", "size": 0.8}),
        ("POINT", {"energy": 60, "shadow_soft_size": 0.15}),
        ("SPOT", {"energy": 60, "shadow_soft_size": 0.15, "spot_size": 1.5}),
        ("SUN", {"energy": 1.5, "angle": math.radians(3)}),
    ):
        compare(f"mirrors_{kind.lower()}", scenes.mirrors(SIZE, kind, **fields), 512, 1024, rms=0.2)


@test
def grey_world() -> None:
    compare("grey_world", scenes.lamps(SIZE), 64, 128, 0.003)


@test
def materials() -> None:
    compare("materials", scenes.materials(SIZE), 128, 256)


@test
def looks() -> None:
    """Materials one by one. RAYFRONT_LOOKS chooses some."""
    chosen = os.environ.get("RAYFRONT_LOOKS", "").split(",")
    for name, (_, limit) in test_looks.LOOKS.items():
        if chosen == [""] or name in chosen:
            compare(f"look_{name}", test_looks.scene(name), 64, 128, limit, rms=0.06)


@test
def subsurface() -> None:
    """A ball in the sun, for each weight with a narrow and a wide radius, and with light that goes on forwards."""
    cases = [(weight, scale, 0.0) for weight in (0.25, 0.5, 0.75, 1.0) for scale in (0.05, 0.3)]
    for weight, scale, anisotropy in [*cases, (1.0, 0.3, 0.5)]:
        name = f"subsurface_{weight}_{scale}_{anisotropy}"
        compare(name, scenes.subsurface(weight, scale, anisotropy), 128, 256, 0.03, rms=0.12)
        check(f"{name}_told", not engine().last["lost"], f"{engine().last['lost']}")


@test
def cameras() -> None:
    """The picture of surroundings by each kind of camera, and lamps through a lens."""

    def scene(**fields: Any) -> Any:
        found = scenes.lamps(SIZE, "SUN")
        scenes.panorama(1.0, 0.5)
        scenes.camera((0, -8, 3), (0, 0, 0.9), **fields)
        return found

    compare("camera_shifted", scene(lens=45, shift_x=0.1, shift_y=-0.15), 32, 32)
    compare("camera_upright", scene(lens=45, sensor_fit="VERTICAL", sensor_height=20), 32, 32)
    compare("camera_orthographic", scene(type="ORTHO", ortho_scale=6, shift_x=0.1, shift_y=0.1), 32, 32)
    compare("camera_panorama", scene(type="PANO", panorama_type="EQUIRECTANGULAR"), 32, 32)
    wide = scene(lens=45)
    wide.render.pixel_aspect_x = 1.5
    compare("camera_wide_pixels", wide, 32, 32)
    for name, fields in (
        ("lens_blades", {"aperture_blades": 5, "aperture_rotation": 0.4}),
        ("lens_wide", {"aperture_ratio": 0.5}),
        ("lens_narrow", {"aperture_ratio": 2.0, "aperture_blades": 6}),
    ):
        lens = scenes.materials(SIZE)
        scenes.focus(lens.camera, 4.0, aperture_fstop=0.5, **fields)
        compare(f"camera_{name}", lens, 64, 128, rms=0.06)
    square = scene(type="PANO", panorama_type="FISHEYE_EQUIDISTANT", fisheye_fov=2.5)
    square.render.resolution_x = square.render.resolution_y
    compare("camera_fisheye", square, 32, 32)
    for name, fields in (
        ("", {"fisheye_fov": 5.0}),
        ("_by_height", {"fisheye_fov": 5.0, "sensor_fit": "VERTICAL", "sensor_height": 20}),
        ("_upright", {"fisheye_fov": 5.0}),
    ):
        wide = scene(type="PANO", panorama_type="FISHEYE_EQUISOLID", fisheye_lens=12, **fields)
        if name == "_upright":
            wide.render.resolution_x, wide.render.resolution_y = SIZE[::-1]
        compare(f"camera_equisolid{name}", wide, 32, 32)
        check(f"camera_equisolid{name}_told", not engine().last["lost"], f"{engine().last['lost']}")
    round_ = scene(type="PANO", panorama_type="FISHEYE_EQUIDISTANT", fisheye_fov=2.5)
    picture = rgb(shoot(round_, "camera_equidistant", 4))
    edges, told = picture[:, :20].max(), "\n".join(engine().last["lost"])
    check("camera_equidistant", edges == 0 < picture.mean() and "its disc is round" in told, f"{edges}; {told}")


def compare_films(name: str, scene: Any, limit: float = 0.02, rms: float = 0.02) -> None:
    """Light and opacity of the same transparent film by both."""
    theirs, ours = shoot(scene, name, 128, cycles=True), shoot(scene, name, 64)
    both = [np.dstack([rgb(planes), planes["Combined.A"]]) for planes in (ours, theirs)]
    ratio = rgb(ours).mean() / rgb(theirs).mean()
    a, b = (film[..., 3].mean() for film in both)
    difference = math.sqrt(((blocks(both[0]) - blocks(both[1]))[..., 3] ** 2).mean())
    over = [film[..., :3] + 0.5 * (1 - film[..., 3:]) for film in both]
    save(name, *over, *(np.repeat(film[..., 3:], 3, axis=2) for film in both))
    holds = abs(ratio - 1) < limit and abs(a - b) < 0.01 and difference < rms
    lost = engine().last["lost"]
    what = f"light {ratio:.4f}, alpha {a:.4f}, Cycles {b:.4f}, blocks {difference:.3f}"
    check(name, holds, what + (f"; {lost}" if lost else ""))


@test
def transparency() -> None:
    """Surroundings that light, and are not seen, except through glass, unless that is Transparent, too."""
    scene = scenes.materials(SIZE)
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    scene.render.film_transparent = True
    tinted = scenes.material("tinted")
    scenes.surface(tinted, "ShaderNodeBsdfTransparent", Color=(0.3, 0.8, 0.3, 1))
    scenes.plane((1.8, 2.5, 1.6), 1, tinted, (math.radians(90), 0, 0))
    compare_films("transparency", scene)
    empty = rgb(shoot(scene, "transparency", 4))[:4]
    check("transparency_black", float(empty.max()) == 0, f"at most {empty.max():.4f} where there is nothing")
    scene.cycles.film_transparent_glass = True
    compare_films("transparency_glass", scene)


@test
def shadow_catchers() -> None:
    compare_films("shadow_catcher", scenes.catcher(SIZE))
    scene = scenes.catcher(SIZE)
    scenes.ball((-1.5, -1.5, -0.2), bpy.data.materials["red"])
    glass = scenes.material("glass", Base_Color=(1, 1, 1), Roughness=0.0, Transmission_Weight=1.0, IOR=1.45)
    scenes.ball((1.8, -1, 0.5), glass)
    compare_films("shadow_catcher_glass", scene, limit=0.05)


@test
def holdouts() -> None:
    """One by itself, and one by its collection."""
    scene = scenes.catcher(SIZE)
    bpy.data.objects["Plane"].is_shadow_catcher = False
    scenes.ball((-0.8, -1.5, 0.5), bpy.data.materials["red"]).is_holdout = True
    held = bpy.data.collections.new("held")
    scene.collection.children.link(held)
    ball = scenes.ball((1.4, -1, 0.5), bpy.data.materials["white"])
    scene.collection.objects.unlink(ball)
    held.objects.link(ball)
    scene.view_layers[0].layer_collection.children["held"].holdout = True
    compare_films("holdouts", scene, limit=0.04)


@test
def pixel_filter() -> None:
    """An edge between pixels is as soft as in Cycles."""
    scene = scenes.fresh((32, 16))
    white = scenes.material("white")
    scenes.surface(white, "ShaderNodeEmission")
    scenes.plane((2, 0, 0), 4, white)
    scenes.camera((0, 0, 5), (0, 0, 0), type="ORTHO", ortho_scale=3.2)
    for kind, width in (("BLACKMAN_HARRIS", 1.5), ("BLACKMAN_HARRIS", 3), ("GAUSSIAN", 2), ("BOX", 3)):
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = kind, width
        theirs, ours = shoot(scene, "filter", 1024, cycles=True), shoot(scene, "filter", 1024)
        a, b = (planes["Combined.R"].mean(axis=0)[14:18] for planes in (ours, theirs))
        same = float(np.abs(a - b).max()) < 0.005
        check(f"pixel_filter_{kind.lower()}_{width}", same, f"{a.round(3)}, Cycles {b.round(3)}")


@test
def film_exposure() -> None:
    """It multiplies the light, and neither alpha nor other passes."""
    scene = scenes.lamps(SIZE, "AREA")
    scene.render.film_transparent = scene.view_layers[0].use_pass_diffuse_color = True
    scene.cycles.film_exposure = 2.5
    bpy.data.objects["area"].lightgroup = "lamp"
    scene.view_layers[0].lightgroups.add().name = "lamp"
    theirs, ours = shoot(scene, "exposure", 64, cycles=True), shoot(scene, "exposure", 64)
    for name in ("Combined.R", "Combined_lamp.R", "Combined.A", "DiffCol.R"):
        ratio = ours[name].mean() / theirs[name].mean()
        check(f"film_exposure_{name}", abs(ratio - 1) < 0.005, f"ratio {ratio:.4f}")


@test
def backdrop() -> None:
    """A world that the camera sees in another colour than the one in which it lights."""
    scene = scenes.lamps(SIZE)
    tree = scene.world.node_tree
    mix, seen, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "Background", "LightPath"))
    seen.inputs["Color"].default_value = (0.1, 0.4, 0.1, 1)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(tree.nodes["Background"].outputs[0], mix.inputs[1])
    tree.links.new(seen.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["World Output"].inputs["Surface"])
    compare("backdrop", scene, 32, 64)
    scene.world.cycles_visibility.camera = False
    compare("backdrop_hidden", scene, 32, 64)


@test
def nodes_of_worlds() -> None:
    """Nodes of a world that are computed: a gradient, a picture that is adjusted, another one as strength."""

    def scene() -> tuple[Any, Callable, Callable]:
        found = scenes.lamps(SIZE)
        scenes.panorama(1.0, 0.5)
        tree = found.world.node_tree
        return found, lambda kind: tree.nodes.new(f"ShaderNode{kind}"), tree.links.new

    found, node, link = scene()
    background = found.world.node_tree.nodes["Background"]
    place, parts, ramp, mapping = (node(kind) for kind in ("TexCoord", "SeparateXYZ", "ValToRGB", "MapRange"))
    mapping.inputs["From Min"].default_value = -1
    colors = ((0.2, 0.1, 0.05, 1), (0.1, 0.3, 0.9, 1))
    for element, color in zip(ramp.color_ramp.elements, colors):
        element.color = color
    ramp.color_ramp.elements.new(0.52).color = (0.9, 0.8, 0.7, 1)
    link(place.outputs["Generated"], parts.inputs[0])
    link(parts.outputs["Z"], mapping.inputs[0])
    link(mapping.outputs[0], ramp.inputs[0])
    link(ramp.outputs[0], background.inputs["Color"])
    compare("world_gradient", found, 32, 64)
    check("world_gradient_told", not engine().last["lost"], f"{engine().last['lost']}")
    found, node, link = scene()
    background = found.world.node_tree.nodes["Background"]
    mix, hue, curves = (node(kind) for kind in ("Mix", "HueSaturation", "RGBCurve"))
    mix.data_type, mix.blend_type, mix.inputs[0].default_value = "RGBA", "MULTIPLY", 0.8
    mix.inputs[7].default_value = (1, 0.5, 0.2, 1)
    hue.inputs["Hue"].default_value, hue.inputs["Saturation"].default_value = 0.6, 1.4
    curves.mapping.curves[3].points[0].location = (0, 0.1)
    picture = background.inputs["Color"].links[0].from_node
    link(picture.outputs[0], mix.inputs[6])
    link(mix.outputs[2], hue.inputs["Color"])
    link(hue.outputs[0], curves.inputs["Color"])
    link(curves.outputs[0], background.inputs["Color"])
    compare("world_adjusted", found, 32, 64)
    found, node, link = scene()
    background = found.world.node_tree.nodes["Background"]
    picture = background.inputs["Color"].links[0].from_node
    picture.projection = "MIRROR_BALL"
    link(picture.outputs[0], background.inputs["Strength"])
    compare("world_strength", found, 32, 64)


@test
def skies() -> None:
    def at(elevation: float, azimuth: float, **fields: float) -> dict[str, Any]:
        return fields | {"sun_elevation": math.radians(elevation), "sun_rotation": math.radians(azimuth)}

    compare("sky_noon", scenes.sky(SIZE, 0.05, **at(60, 60)), 64, 128)
    compare("sky_evening", scenes.sky(SIZE, 0.2, **at(5, 140)), 64, 128, 0.03)
    air = {
        "altitude": 3000,
        "dust_density": 3,
        "air_density": 2,
        "ozone_density": 4,
        "sun_size": 0.1,
        "sun_intensity": 0.3,
    }
    compare("sky_hazy", scenes.sky(SIZE, 0.1, **at(30, 230, **air)), 64, 128, 0.03)
    compare("sky_plain", scenes.sky(SIZE, 0.1, **at(20, 60, sun_disc=False)), 64, 128, 0.03)
    preetham = {"sky_type": "PREETHAM", "sun_direction": (0.5, -0.5, 0.4), "turbidity": 4}
    compare("sky_preetham", scenes.sky(SIZE, 1, **preetham), 64, 128)


@test
def visibility() -> None:
    """What no ray sees is left out, and a world that the camera alone sees gives no light; the rest is told."""
    scene = scenes.lamps(SIZE, "SUN", "AREA")
    kinds = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
    ball, area = scenes.ball((0, -2, 1), scenes.material("none")), bpy.data.objects["area"]
    for kind in kinds:
        setattr(ball, f"visible_{kind}", False)
        setattr(area, f"visible_{kind}", False)
    rays = scene.world.cycles_visibility
    rays.diffuse = rays.glossy = rays.transmission = rays.scatter = False
    bpy.data.objects["Plane"].scale = (0.4, 0.4, 1)
    bpy.data.objects.remove(bpy.data.objects["Plane.001"])
    compare("visibility", scene, 64, 128)
    check("visibility_none", not engine().last["lost"], f"{engine().last['lost']}")
    for kind in kinds:
        setattr(ball, f"visible_{kind}", kind != "camera")
        setattr(area, f"visible_{kind}", kind != "glossy")
    rays.diffuse = True
    shoot(scene, "visibility", 1)
    lost = "\n".join(engine().last["lost"])
    for words in (
        "'Sphere.003': it is not hidden from rays of the kind camera",
        "'area': it is not hidden from rays of the kind glossy",
        "world 'world': it is not hidden from rays of the kind glossy, transmission, scatter",
    ):
        check(f"visibility_{words}", words in lost, lost)


@test
def live_page() -> None:
    """The button's page, asked as a browser would."""
    scene = scenes.lamps((32, 18), "SUN")
    scene.render.engine = "RAYFRONT"
    from bl_ext.user_default.rayfront.panels import RAYFRONT_OT_live_page as page

    bpy.ops.rayfront.live_page()
    process, folder = page.processes[0]
    said, until = "", time.monotonic() + 60
    while time.monotonic() < until and not said:
        time.sleep(0.2)
        with open(os.path.join(folder, "log.txt"), encoding="utf-8") as log:
            place = re.search(r"http://\S+", log.read())
        if place:
            said = urllib.request.urlopen(place[0], timeout=20).read(4000).decode("utf-8", "replace")
    check("live_page", process.poll() is None and "<html" in said, f"{len(said)} characters of a page")
    page.close()
    check("live_page_closed", process.poll() is not None, "the program has ended")
    preferences = bpy.context.preferences.addons["bl_ext.user_default.rayfront"].preferences
    before, preferences.program = set(os.listdir(tempfile.gettempdir())), "/no/such/program"
    told = attempt(bpy.ops.rayfront.live_page)
    preferences.program = ""
    left = [name for name in set(os.listdir(tempfile.gettempdir())) - before if name.startswith("rayfront_live")]
    check("live_page_fails", "no program" in told and not left, f"{told.splitlines()[0]}; left: {left or 'nothing'}")


class Layout:
    """Stands in for the layout of a panel: notes properties, and fails for those that are not there."""

    def __init__(self, shown: list[tuple[Any, str]]):
        self.__dict__["shown"] = shown

    def __getattr__(self, name: str) -> Callable:
        def call(*values: Any, **_: Any) -> Layout:
            if name in {"prop", "prop_search", "prop_enum", "prop_with_popover", "prop_decorator"}:
                if not hasattr(values[0], values[1]):
                    raise AttributeError(f"{values[0]} has no {values[1]}")
                self.shown.append((values[0], values[1]))
            return Layout(self.shown)

        return call

    def __setattr__(self, name: str, value: Any) -> None:
        """Takes `use_property_split` and the like."""


class Panel:
    """Stands in for a panel that is drawn."""

    def __init__(self, of: Any, shown: list[tuple[Any, str]]):
        self.of, self.layout = of, Layout(shown)

    def __getattr__(self, name: str) -> Any:
        found = inspect.getattr_static(self.of, name)
        return functools.partial(found, self) if inspect.isfunction(found) else getattr(self.of, name)


class Context:
    """Blender's context in the tab of an object."""

    def __init__(self, **fields: Any):
        self.__dict__ |= fields

    def __getattr__(self, name: str) -> Any:
        return getattr(bpy.context, name, None)


@test
def panels() -> None:
    """Each panel of the tabs that matter draws itself, none has settings of EEVEE's alone, and none is missing."""
    scene = scenes.materials((32, 18))
    scene.render.engine = "RAYFRONT"
    lamps = [scenes.lamp(kind, (0, 0, 4)) for kind in ("POINT", "SUN", "SPOT", "AREA")]
    lamps[3].data.shape = "RECTANGLE"
    lens = scenes.camera((0, -7, 2), (0, 0, 0))
    drawn: dict[str, list[str]] = {}
    of_eevee: set[str] = set()

    def draw(tab: str, ob: Any = None, engine: str = "RAYFRONT", **fields: Any) -> None:
        fields |= {"engine": engine, "scene": scene, "view_layer": scene.view_layers[0], "object": ob}
        context = Context(space_data=Context(pin_id=None, use_pin_id=False, context=tab.upper()), **fields)
        for panel in bpy.types.Panel.__subclasses__():
            fits = engine in getattr(panel, "COMPAT_ENGINES", ()) and getattr(panel, "bl_context", "") == tab
            if not fits or panel.bl_space_type != "PROPERTIES" or "custom_props" in panel.__name__:
                continue
            if hasattr(panel, "poll") and not panel.poll(context):
                continue
            shown: list[tuple[Any, str]] = []
            for part in ("draw_header", "draw"):
                with contextlib.suppress(SystemError):  # What asks for the graphics card.
                    if hasattr(panel, part):
                        getattr(panel, part)(Panel(panel, shown), context)
            drawn.setdefault(panel.__name__, []).extend(name for _, name in shown)
            of_eevee.update(f"{panel.__name__} {name}" for data, name in shown if data == scene.eevee)

    for tab in ("render", "output", "view_layer"):
        draw(tab)
    draw("world", world=scene.world)
    for ob in [bpy.data.objects["Cube"], *lamps, lens]:
        draw("object", ob)
    for lamp in lamps:
        draw("data", lamp, light=lamp.data)
    for kind in ("PERSP", "ORTHO", "PANO"):
        lens.data.type = kind
        draw("data", lens, camera=lens.data)
    for kind in ("EQUIRECTANGULAR", "FISHEYE_EQUIDISTANT", "FISHEYE_EQUISOLID"):
        lens.data.panorama_type = kind
        draw("data", lens, camera=lens.data)
    draw("data", bpy.data.objects["Cube"], mesh=bpy.data.objects["Cube"].data)
    cube = bpy.data.objects["Cube"]
    draw("material", cube, material=cube.active_material, material_slot=cube.material_slots[0])
    check("panels_eevee", not of_eevee, f"of EEVEE's alone: {of_eevee or 'none'}")
    for name, words in {
        "RENDER_PT_format": "resolution_x", "RENDER_PT_output": "filepath", "RENDER_PT_frame_range": "frame_end",
        "RENDER_PT_color_management": "view_transform", "VIEWLAYER_PT_layer": "use", "VIEWLAYER_PT_filter": "use_sky",
        "DATA_PT_lens": "shift_x", "DATA_PT_camera": "sensor_width", "DATA_PT_camera_dof": "focus_distance",
        "DATA_PT_camera_dof_aperture": "aperture_fstop", "DATA_PT_EEVEE_light": "energy angle size_y shadow_soft_size",
        "DATA_PT_spot": "spot_blend", "EEVEE_MATERIAL_PT_surface": "", "EEVEE_MATERIAL_PT_volume": "",
        "EEVEE_MATERIAL_PT_context_material": "", "EEVEE_WORLD_PT_surface": "use_nodes", "OBJECT_PT_visibility": "is_holdout",
        "RAYFRONT_PT_sampling": "samples noise seed", "RAYFRONT_PT_light_paths": "clamp caustics",
        "RAYFRONT_PT_film": "film_exposure filter_width film_transparent film_transparent_glass", "RAYFRONT_PT_performance": "threads",
        "RAYFRONT_PT_motion_blur": "use_motion_blur motion_blur_shutter", "RAYFRONT_PT_passes": "use_pass_z",
        "RAYFRONT_PT_light_groups": "", "RAYFRONT_PT_override": "material_override", "RAYFRONT_PT_world": "lightgroup camera",
        "RAYFRONT_PT_object": "is_shadow_catcher visible_camera lightgroup",
        "RAYFRONT_PT_panorama": "latitude_min fisheye_fov fisheye_lens",
    }.items():  # fmt: skip
        missing = set(words.split()) - set(drawn.get(name, []))
        check(f"panel_{name}", name in drawn and not missing, f"without {missing}" if missing else "drawn")
    names = {name for name in drawn if name.startswith("RAYFRONT")}
    drawn.clear()
    for tab in ("render", "view_layer"):
        draw(tab, engine="CYCLES")
    check("panels_of_cycles", not names & set(drawn), f"{len(drawn)} with Cycles, none of them rayfront's")
    scene.render.engine = "CYCLES"
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.rayfront")
    left = [p.__name__ for p in bpy.types.Panel.__subclasses__() if "RAYFRONT" in getattr(p, "COMPAT_ENGINES", ())]
    left = [name for name in left if hasattr(bpy.types, name)]
    check("panels_disabled", not left, f"left of the extension: {left or 'nothing'}")
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.rayfront")


@test
def passes() -> None:
    scene = scenes.materials(SIZE)
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = layer.use_pass_diffuse_color = True
    theirs, ours = shoot(scene, "passes", 64, cycles=True), shoot(scene, "passes", 16)
    for name, limit in (("Depth.Z", 0.02), ("Normal.Z", 0.005), ("Position.X", 0.01), ("DiffCol.R", 0.02)):
        a, b = ours[name], theirs[name]
        median = float(np.median(np.abs(a - b)[(np.abs(a) < 1e9) & (np.abs(b) < 1e9)]))
        check(f"pass_{name}", median < limit, f"median difference {median:.4f}")


@test
def settings() -> None:
    """All settings at once: the program understands what they become."""
    scene = scenes.materials((64, 36))
    mine = scene.rayfront
    mine.noise, mine.max_time, mine.adaptive, mine.seed, mine.clamp, mine.caustics = 2.5, 20.0, True, 7, 8.0, False
    mine.max_depth, mine.diffuse_depth, mine.glossy_depth, mine.transmission_depth, mine.live = 6, 2, 3, 4, False
    mine.keep = os.path.join(FOLDER, "settings")
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    planes = shoot(scene, "settings", 256)
    with open(os.path.join(mine.keep, "said.json"), encoding="utf-8") as file:
        said = json.load(file)
    told = [
        said[key] for key in ("threads", "seed", "max_depth", "diffuse_depth", "glossy_depth", "transmission_depth")
    ]
    check("settings", told == [1, 7, 6, 2, 3, 4] and rgb(planes).mean() > 0.1, f"{told}, {said['samples']} samples")


@test
def light_groups() -> None:
    """A lamp, a world and a glowing ball, each by itself."""
    scene = scenes.lamps(SIZE, "AREA")
    scene.world.lightgroup = "around"
    bpy.data.objects["area"].lightgroup = "lamp"
    glow = scenes.material("glow", Emission_Color=(1, 0.5, 0.2), Emission_Strength=3.0)
    scenes.ball((-1, -1, 0.3), glow, radius=0.3).lightgroup = "ball"
    for name in ("around", "lamp", "ball"):
        scene.view_layers[0].lightgroups.add().name = name
    theirs, ours = shoot(scene, "groups", 128, cycles=True), shoot(scene, "groups", 64)
    for name in ("around", "lamp", "ball"):
        a, b = (planes[f"Combined_{name}.R"].mean() for planes in (ours, theirs))
        check(f"light_group_{name}", abs(a / b - 1) < 0.02, f"ratio {a / b:.4f}")


@test
def denoising() -> None:
    scene = scenes.materials(SIZE)
    scene.rayfront.denoise = True
    planes = shoot(scene, "denoising", 8)
    noisy = np.stack([planes[f"Noisy Image.{c}"] for c in "RGB"], axis=2)
    steps = [float(np.abs(np.diff(p, axis=0)).mean()) for p in (rgb(planes), noisy)]
    check("denoising", steps[0] < 0.8 * steps[1], f"from row to row {steps[0]:.4f}, noisy {steps[1]:.4f}")


@test
def border() -> None:
    scene = scenes.materials(SIZE)
    whole = rgb(shoot(scene, "whole", 4))
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.25, 0.5
    for crop, shape in ((False, (72, 128)), (True, (18, 64))):
        render.use_crop_to_border = crop
        part = rgb(shoot(scene, "border", 4))
        inside = part if crop else part[36:54, 32:96]
        same = part.shape[:2] == shape and np.array_equal(inside, whole[36:54, 32:96])
        check(f"border{'_cropped' if crop else ''}", same, f"{part.shape[1]} x {part.shape[0]}, the same pixels")


@test
def animation() -> None:
    scene = scenes.materials(SIZE)
    scene.frame_end = 3
    still = rgb(shoot(scene, "still", 4))
    scene.render.filepath = os.path.join(FOLDER, "frame_")
    bpy.ops.render.render(animation=True)
    from bl_ext.user_default.rayfront import exr

    def frame(number: int) -> np.ndarray:
        planes = exr.read(f"{scene.render.filepath}{number:04d}.exr")
        return rgb({key.split(".", 1)[1]: plane for key, plane in planes.items()})

    steps = [float(np.abs(frame(n) - frame(1)).mean()) for n in (2, 3)]
    moves = np.array_equal(frame(1), still) and min(steps) > 0.002
    check("animation", moves, f"frame 1 is the still; 2 and 3 differ from 1 by {steps[0]:.4f}, {steps[1]:.4f}")
    strength = scene.world.node_tree.nodes["Background"].inputs["Strength"]
    for number, factor, samples in ((1, 1.2, 4), (3, 3.6, 6)):
        strength.default_value, scene.rayfront.samples = factor, samples
        strength.keyframe_insert("default_value", frame=number)
        scene.rayfront.keyframe_insert("samples", frame=number)
    scene.rayfront.keep = os.path.join(FOLDER, "animation")
    bpy.ops.render.render(animation=True)
    brighter = float(frame(3).mean() / frame(1).mean())
    with open(os.path.join(scene.rayfront.keep, "scene.ron"), encoding="utf-8") as file:
        text = file.read()
    keys = np.array_equal(frame(1), still) and 2.5 < brighter < 3.5 and "samples: 6" in text
    check("animation_keys", keys, f"frame 1 is the still; 3 is {brighter:.2f} times as bright, with {text[:60]}")


@test
def motion_blur() -> None:
    scene = scenes.materials(SIZE)
    scene.frame_set(2)
    camera = scene.camera
    for frame, x in ((1, -0.5), (3, 0.5)):
        camera.location.x = x
        camera.keyframe_insert("location", frame=frame)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.8
    compare("motion_blur", scene, 64, 128, rms=0.06)
    scene.frame_set(2, subframe=0.25)
    bpy.ops.render.render()
    now = scene.frame_current, scene.frame_subframe
    check("motion_blur_frame", now == (2, 0.25), f"at {now} after rendering at (2, 0.25)")


@test
def shutter_positions() -> None:
    """Lamps are those of the shutter's middle, materials those of the frame; what has no blur of its own, has none."""
    for position in ("START", "END"):
        scene = scenes.lamps(SIZE, "SUN")
        sun, color = bpy.data.lights["sun"], scenes.shader(bpy.data.materials["white"]).inputs["Base Color"]
        ball = scenes.ball((-1, -2, 1), scenes.material("red", Base_Color=(0.8, 0.1, 0.1), Specular_IOR_Level=0.0))
        ball.cycles.use_motion_blur = False
        for frame, part in ((1, 0.0), (3, 1.0)):
            sun.energy, ball.location.x, color.default_value[0] = 1 + 4 * part, 2 * part - 1, 0.2 + 0.6 * part
            scene.camera.location.x = 0.5 * part
            for of, what in ((sun, "energy"), (ball, "location"), (color, "default_value"), (scene.camera, "location")):
                of.keyframe_insert(what, frame=frame)
        scene.frame_set(2)
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
        scene.render.motion_blur_position = position
        compare(f"shutter_{position.lower()}", scene, 64, 128)
    lens = scene.camera.data
    for frame, length in ((1, 40), (3, 90)):
        lens.lens = length
        lens.keyframe_insert("lens", frame=frame)
    compare("shutter_zoom", scene, 64, 128)
    scene.cycles.rolling_shutter_type, scene.render.pixel_aspect_x = "TOP", 1.5
    shoot(scene, "shutter_told", 1)
    lost = "\n".join(engine().last["lost"])
    check("shutter_told", "the zoom of a camera" in lost and "Rolling Shutter" in lost, lost)


@test
def bending() -> None:
    """Shape keys and modifiers that move vertices while the shutter is open; what changes their number is told."""
    scene = scenes.lamps(SIZE, "SUN", "AREA")
    red = scenes.material("red", Base_Color=(0.8, 0.1, 0.1), Roughness=1.0, Specular_IOR_Level=0.0)
    ball = scenes.ball((-1, -2, 1), red, 0.6)
    ball.shape_key_add(name="Basis")
    key = ball.shape_key_add(name="long")
    for point in key.data:
        point.co.x *= 2.2
    bpy.ops.mesh.primitive_cube_add(size=0.8, location=(1, -2, 1))
    cube = bpy.context.object
    cube.data.materials.append(red)
    stretch = cube.modifiers.new("stretch", "SIMPLE_DEFORM")
    stretch.deform_method, stretch.deform_axis = "STRETCH", "Z"
    bpy.ops.object.metaball_add(location=(-2.6, -2, 0.6), radius=0.5)
    drop = bpy.context.object.data.elements[0]
    for frame, part in ((1, 0.0), (3, 1.0)):
        key.value, stretch.factor, cube.location.x, drop.radius = part, part, 0.8 + part, 0.4 + 0.4 * part
        for of, what in ((key, "value"), (stretch, "factor"), (cube, "location"), (drop, "radius")):
            of.keyframe_insert(what, frame=frame)
    scenes.link(ball.copy()).location = (2.6, -1, 1)
    scene.frame_set(2)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    compare("bending", scene, 64, 128)
    lost = engine().last["lost"]
    told = len(lost) == 1 and "'Mball': the motion of its vertices" in lost[0]
    check("bending_told", told, f"{lost}")


@test
def scale_zero() -> None:
    """What has no area is not seen, with its material; what is flat is; lamps without a direction are dark."""
    scene = scenes.lamps(SIZE, "AREA")
    scenes.ball((0, -2, 1), scenes.material("alone")).scale = (0, 0, 0)
    scenes.ball((-2, -2, 1), scenes.material("line")).scale = (0, 0, 1)
    scenes.plane((2, -2, 0.01), 1, scenes.material("flat", Base_Color=(0.9, 0.1, 0.1))).scale = (1, 1, 0)
    lamp = scenes.lamp("AREA", (0, 0, 3), energy=500)
    lamp.scale = (1, 1, 0)
    compare("scale_zero", scene, 32, 64, rms=0.06)


@test
def negative_scale() -> None:
    """Cameras look along -Z, mirrored by an odd number of signs, and lamps shine along -Z."""
    for scale in ((-2, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)):
        scene = scenes.lamps(SIZE)
        scenes.panorama(1.0, 0.5)
        scenes.ball((-2, -2, 1), scenes.material("red", Base_Color=(0.9, 0.1, 0.1)))
        scene.camera.scale = scale
        compare(f"camera_scaled_{scale}", scene, 16, 32)
    scene.camera.scale = (-1, 1, 1)
    for frame, x in ((1, -0.5), (3, 0.5)):
        scene.camera.location.x = x
        scene.camera.keyframe_insert("location", frame=frame)
    scene.frame_set(2)
    scene.render.use_motion_blur = True
    compare("camera_mirrored_moves", scene, 32, 64, rms=0.06)
    for kind in ("SUN", "AREA", "SPOT"):
        scene = scenes.lamps(SIZE, kind)
        bpy.data.objects[kind.lower()].scale = (-1, 1, 1)
        compare(f"{kind.lower()}_mirrored", scene, 32, 64)


@test
def stretched_spot() -> None:
    """Cones that a scale makes wider or longer; what makes them elliptic is told."""
    for name, scale in (("wide", (2, 2, 1)), ("long", (1, 1, 1.5))):
        scene = scenes.lamps(SIZE, "SPOT")
        bpy.data.objects["spot"].scale = scale
        compare(f"spot_{name}", scene, 64, 128, 0.03)
        check(f"spot_{name}_told", not engine().last["lost"], f"{engine().last['lost']}")
    bpy.data.objects["spot"].scale = (2, 1, 1)
    shoot(scene, "spot_elliptic", 1)
    check(
        "spot_elliptic", any("a stretched cone" in what for what in engine().last["lost"]), f"{engine().last['lost']}"
    )


@test
def without_cycles() -> None:
    """Without the add-on Cycles, which has some of the properties that are read."""
    scene = scenes.materials((32, 18))
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        scenes.lamp(kind, (0, 0, 4))
    bpy.ops.preferences.addon_disable(module="cycles")
    try:
        scene.render.engine, scene.rayfront.samples = "RAYFRONT", 1
        told = attempt(bpy.ops.render.render)
        check("without_cycles", "FINISHED" in told, told)
        panorama = scene.camera.data
        panorama.type = "PANO"
        if hasattr(panorama, "panorama_type"):
            panorama.panorama_type = "EQUIRECTANGULAR"
        told = attempt(bpy.ops.render.render)
        check("without_cycles_panorama", "FINISHED" in told or "the add-on Cycles" in told, told)
    finally:
        bpy.ops.preferences.addon_enable(module="cycles")


@test
def node_values() -> None:
    """Nodes that count for a map, groups with free inputs, and what goes through nodes that rayfront does not have."""

    def ron(name: str, change: Callable[[Any, Any], None]) -> tuple[str, str]:
        scene = scenes.lamps((32, 18), "POINT")
        of = scenes.material("of")
        scenes.ball((0, -2, 1), of)
        change(scene, of)
        scene.render.engine, scene.rayfront.samples = "RAYFRONT", 1
        scene.rayfront.keep = os.path.join(FOLDER, name)
        bpy.ops.render.render()
        with open(os.path.join(scene.rayfront.keep, "scene.ron"), encoding="utf-8") as file:
            return file.read(), "\n".join(engine().last["lost"])

    def checks(of: Any, to: Any) -> None:
        scenes.node(of, "ShaderNodeTexImage", to).image = scenes.picture("checks", (16, 16), scenes.checker)

    def warm(scene: Any, of: Any) -> None:
        scenes.node(of, "ShaderNodeBlackbody", scenes.shader(of).inputs["Base Color"], Temperature=3000)

    def adjust(scene: Any, of: Any) -> None:
        outer = scenes.node(of, "ShaderNodeHueSaturation", scenes.shader(of).inputs["Base Color"])
        checks(of, scenes.node(of, "ShaderNodeGamma", outer.inputs["Color"]).inputs["Color"])

    def mute(scene: Any, of: Any) -> None:
        off = scenes.node(of, "ShaderNodeGamma", scenes.shader(of).inputs["Base Color"])
        off.mute = True
        checks(of, off.inputs["Color"])

    def around(scene: Any, of: Any) -> None:
        scenes.panorama()
        tree = bpy.context.scene.world.node_tree
        to = tree.nodes["Background"].inputs["Color"]
        curves = tree.nodes.new("ShaderNodeRGBCurve")
        tree.links.new(to.links[0].from_socket, curves.inputs["Color"])
        tree.links.new(curves.outputs[0], to)

    def shaders(scene: Any, of: Any) -> None:
        tree = of.node_tree
        inner = scenes.group(
            tree, "ShaderNodeBsdfPrincipled", tree.nodes["Material Output"].inputs[0],
            Normal=None, Base_Color=None, Roughness=0.25, Coat_Normal=None, Tangent=None, Coat_Weight=1.0, Anisotropic=0.5,
        )  # fmt: skip
        scenes.group(tree, "ShaderNodeTexImage", inner.inputs["Base Color"], Vector=None).node_tree.nodes[
            "Image Texture"
        ].image = scenes.picture("checks", (16, 16), scenes.checker)

    def lights(scene: Any, of: Any) -> None:
        tree = scene.world.node_tree
        to = tree.nodes["World Output"].inputs["Surface"]
        scenes.group(tree, "ShaderNodeBackground", to, Color=(0.1, 0.2, 0.4, 1), Strength=2.0)
        lamp = bpy.data.lights["point"]
        lamp.use_nodes = True
        to = lamp.node_tree.nodes["Light Output"].inputs["Surface"]
        scenes.group(lamp.node_tree, "ShaderNodeEmission", to, Color=(1, 0.5, 0.25, 1), Strength=0.5)

    def inside(scene: Any, of: Any) -> None:
        tree = of.node_tree
        tree.nodes.remove(tree.nodes["Principled BSDF"])
        both = scenes.group(tree, "ShaderNodeAddShader", tree.nodes["Material Output"].inputs["Volume"], Shader=None)
        scenes.group(
            both.node_tree, "ShaderNodeVolumeAbsorption", both.node_tree.nodes["Add Shader"].inputs[1], Density=2
        )

    def switches(scene: Any, of: Any) -> None:
        shader = scenes.shader(of)
        both = scenes.node(of, "ShaderNodeMath", shader.inputs["Metallic"])
        both.use_clamp, both.inputs[1].default_value = True, 0.5
        checks(of, both.inputs[0])
        ramp = scenes.node(of, "ShaderNodeValToRGB", shader.inputs["Roughness"], out="Alpha")
        ramp.color_ramp.elements[0].color = (0, 0, 0, 0.25)
        checks(of, ramp.inputs[0])
        mix = scenes.node(of, "ShaderNodeMix", shader.inputs["Base Color"], out=2)
        mix.data_type, mix.blend_type, mix.clamp_result = "RGBA", "ADD", True
        of.node_tree.links.new(mix.outputs[2], shader.inputs["Base Color"])
        mix.inputs[0].default_value, mix.inputs[6].default_value = 1.0, (0.75, 0.75, 0.75, 1)
        checks(of, mix.inputs[7])

    def wide(scene: Any, of: Any) -> None:
        shader = scenes.shader(of)
        shader.inputs["Subsurface Weight"].default_value = 0.5
        scenes.node(of, "ShaderNodeObjectInfo", shader.inputs["Subsurface Radius"], out="Object Index")
        bpy.data.objects["Sphere.003"].pass_index = 1

    for name, change, words, told in (
        ("black_body", warm, ["base_color: (1.0, 0.849"], "base color above 1"),
        ("adjusted", adjust, ["base_color: Texture("], "Gamma (for Color: its Color goes through unchanged)"),
        ("muted", mute, ["base_color: Texture("], ""),
        ("around", around, ['Environment(image: "world.exr"'], ""),
        ("of_groups", shaders, ["base_color: Texture(", "clearcoat: 1.0"], "Anisotropy without a Tangent"),
        ("of_lights", lights, ["radiance: (0.2, 0.4, 0.8)", "power_w: (60.0, 18.0, 6.0)"], ""),
        ("of_volumes", inside, ["attenuation_distance_m: "], ""),
        (
            "clamped",
            switches,
            [
                "Min(a: Add(a: Add(a: Add(a: Mix(a: 0.0, b: 0.2126, by: Texture(",
                "stops: [(0.0, 0.25), (1.0, 1.0)]",
                "Min(a: Add(a: (0.75",
            ],
            "",
        ),
        ("wide", wide, ["attenuation_distance_m: "], ""),
    ):
        text, lost = ron(name, change)
        missing = [part for part in words if part not in text]
        check(f"node_{name}", not missing and told in lost and bool(told) == bool(lost), f"{missing or words}; {lost}")


@test
def told() -> None:
    """The scene file and the messages after single changes of a scene. RAYFRONT_TOLD chooses some."""
    chosen = os.environ.get("RAYFRONT_TOLD", "").split(",")
    for name, (change, words, messages) in test_told.CASES.items():
        if chosen != [""] and name not in chosen:
            continue
        scene = scenes.lamps((32, 18), "POINT")
        of = scenes.material("of")
        scenes.ball((0, -2, 1), of)
        change(scene, of)
        scene.render.engine, scene.rayfront.samples = "RAYFRONT", 1
        scene.rayfront.keep = os.path.join(FOLDER, name)
        failure = attempt(bpy.ops.render.render)
        lost = "; ".join(engine().last["lost"])
        with open(os.path.join(scene.rayfront.keep, "scene.ron"), encoding="utf-8") as file:
            text = file.read()
        missing = [part for part in words if part not in text] + [part for part in messages if part not in lost]
        holds = "FINISHED" in failure and not missing and bool(messages) == bool(lost)
        check(f"told_{name}", holds, f"{missing or words}; {lost or failure}")


@test
def kinds_of_objects() -> None:
    """Text, metaballs, curves, copies that share a mesh, one of them with a modifier, and instances of nodes."""
    scene = scenes.lamps(SIZE, "SUN")
    bpy.ops.mesh.primitive_plane_add(size=4, location=(0, 0, 0.2))
    modifier = bpy.context.object.modifiers.new("nodes", "NODES")
    kinds = "GeometryNodeInstanceOnPoints", "GeometryNodeMeshCube", "GeometryNodeJoinGeometry"
    first, last, copies, cube, both = scenes.geometry("cubes", *kinds)
    tree = modifier.node_group = first.id_data
    cube.inputs[0].default_value = (0.5, 0.5, 0.5)
    for output, to in (
        (first.outputs[0], copies.inputs["Points"]), (cube.outputs[0], copies.inputs["Instance"]),
        (copies.outputs[0], both.inputs[0]), (first.outputs[0], both.inputs[0]), (both.outputs[0], last.inputs[0]),
    ):  # fmt: skip
        tree.links.new(output, to)
    ball = scenes.ball((0, 0, 2), scenes.material("plain"), 0.3)
    for x in (-1, 1, 2):
        scenes.link(ball.copy()).location.x = x
    other = scenes.link(ball.copy())
    other.location = (-2, 0, 2)
    other.modifiers.new("thicker", "SOLIDIFY").thickness = -0.3
    bpy.ops.object.text_add(location=(0, -2, 0.3))
    bpy.ops.object.metaball_add(location=(2, -2, 0.5))
    bpy.ops.curve.primitive_bezier_circle_add(location=(-2, -2, 1))
    bpy.context.object.data.bevel_depth = 0.1
    scene.rayfront.keep = os.path.join(FOLDER, "kinds")
    compare("kinds", scene, 64, 64)
    with open(os.path.join(FOLDER, "kinds", "model0.glb"), "rb") as file:
        (size,) = struct.unpack_from("<12xI", file.read(16))
        model = json.loads(file.read(size + 4)[4:])
    meshes, nodes = len(model["meshes"]), len(model["nodes"])
    check("copies_share", meshes == nodes - 6, f"{meshes} meshes at {nodes} places")


@test
def object_info() -> None:
    """Copies of one mesh, and instances of a collection, of different colours by the same material."""
    scene = scenes.lamps(SIZE, "SUN")
    by_random, by_color = scenes.material("by random", Roughness=1.0), scenes.material("by color", Roughness=1.0)
    ramp = scenes.node(by_random, "ShaderNodeValToRGB", scenes.shader(by_random).inputs["Base Color"])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.9, 0.1, 0.1, 1), (0.1, 0.1, 0.9, 1)
    scenes.node(by_random, "ShaderNodeObjectInfo", ramp.inputs[0], out="Random")
    scenes.node(by_color, "ShaderNodeObjectInfo", scenes.shader(by_color).inputs["Base Color"], out="Color")
    for of, height in ((by_random, 1.5), (by_color, 2.3)):
        ball = scenes.ball((-3, 0, height), of, 0.35)
        for x in range(-2, 4):
            copy = scenes.link(ball.copy())
            copy.location.x, copy.color = x, (0.5 + x / 10, 0.5 - x / 10, 0.2, 1)
    inner = bpy.data.collections.new("inner")
    cone = scenes.ball((0, 0, 0), by_random, 0.3)
    bpy.context.collection.objects.unlink(cone)
    inner.objects.link(cone)
    for x in range(-3, 4):
        copy = scenes.link(bpy.data.objects.new(f"copy {x}", None))
        copy.instance_type, copy.instance_collection, copy.location = "COLLECTION", inner, (x, -2, 0.3)
    bpy.data.objects["Sphere.005"].name = "Größe"
    compare("object_info", scene, 64, 64, rms=0.03)


@test
def hair() -> None:
    scene = scenes.lamps(SIZE, "SUN")
    curves = bpy.data.hair_curves.new("hair")
    rng = np.random.default_rng(1)
    count, length = 400, 5
    curves.add_curves([length] * count)
    roots = rng.uniform((-2.5, -2, 0), (2.5, 0, 0), (count, 3))
    bends = rng.normal(0, 0.15, (count, 3)) * (1, 1, 0)
    t = np.linspace(0, 1, length)[None, :, None]
    points = roots[:, None] + t * (0, 0, 1.2) + t**2 * bends[:, None]
    curves.points.foreach_set("position", points.astype(np.float32).ravel())
    curves.points.foreach_set("radius", np.full(count * length, 0.02, np.float32))
    curves.materials.append(scenes.material("hair", Base_Color=(0.5, 0.3, 0.1), Roughness=1.0, Specular_IOR_Level=0.0))
    scenes.link(bpy.data.objects.new("hair", curves))
    scene.cycles_curves.shape = "THICK"
    compare("hair", scene, 64, 64, rms=0.06)
    curves.attributes.remove(curves.attributes["radius"])
    compare("hair_without_radius", scene, 64, 64)
    # Bent by time, and all of another material.
    kinds = "GeometryNodeSetPosition", "GeometryNodeInputSceneTime", "ShaderNodeCombineXYZ"
    first, last, place, clock, along = scenes.geometry("bend", *kinds)
    tree = first.id_data
    for output, to in (
        (first.outputs[0], place.inputs["Geometry"]), (place.outputs[0], last.inputs[0]),
        (clock.outputs["Seconds"], along.inputs["X"]), (along.outputs[0], place.inputs["Offset"]),
    ):  # fmt: skip
        tree.links.new(output, to)
    bpy.data.objects["hair"].modifiers.new("bend", "NODES").node_group = tree
    scene.view_layers[0].material_override = scenes.material("over", Base_Color=(0.25, 0.5, 0.75))
    scene.render.engine, scene.rayfront.samples, scene.rayfront.keep = "RAYFRONT", 1, os.path.join(FOLDER, "hair")
    scene.render.use_motion_blur = True
    bpy.ops.render.render()
    with open(os.path.join(FOLDER, "hair", "scene.ron"), encoding="utf-8") as file:
        strands = next(line for line in file if "Strands(" in line)
    check("hair_override", "base_color: (0.25, 0.5, 0.75)" in strands, strands.strip()[:200])
    check(
        "hair_moves",
        any("the motion of its hair" in what for what in engine().last["lost"]),
        f"{engine().last['lost']}",
    )


def attempt(function: Callable) -> str:
    """The message of what a script or a user is told."""
    try:
        return str(function())
    except RuntimeError as error:
        return str(error).strip()


@test
def faults() -> None:
    """Errors are told, and never a picture of something else."""

    def fails(name: str, words: str, change: Callable[[Any], None]) -> None:
        scene = scenes.materials((32, 18))
        scene.render.engine, scene.rayfront.samples = "RAYFRONT", 1
        change(scene)
        told = attempt(bpy.ops.render.render)
        check(f"fault_{name}", words in told, told.splitlines()[0])

    def lose(scene: Any) -> None:
        image = bpy.data.images.new("lost", 8, 8)
        image.source, image.filepath = "FILE", "/nowhere/lost.png"
        scenes.node(
            bpy.data.materials["coat"], "ShaderNodeTexImage", scenes.shader(bpy.data.materials["coat"]).inputs[0]
        ).image = image

    def unset(scene: Any) -> None:
        scenes.node(
            bpy.data.materials["coat"], "ShaderNodeTexImage", scenes.shader(bpy.data.materials["coat"]).inputs[0]
        )

    def program(path: str) -> None:
        bpy.context.preferences.addons["bl_ext.user_default.rayfront"].preferences.program = path

    def no_camera(scene: Any) -> None:
        scene.camera = None

    def strange_world(scene: Any) -> None:
        tree = scene.world.node_tree
        both = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(both.outputs[0], tree.nodes["World Output"].inputs["Surface"])

    def too_large(scene: Any) -> None:
        scene.render.resolution_x = scene.render.resolution_y = 65536

    def large_emission(scene: Any) -> None:
        coat = bpy.data.materials["coat"]
        mixed = test_told.mixes(coat, 8, 6, 7)
        for name in ("Emission Color", "Emission Strength"):
            coat.node_tree.links.new(mixed, scenes.shader(coat).inputs[name])

    def doubled_volumes(scene: Any) -> None:
        coat = bpy.data.materials["coat"]
        found = scenes.node(coat, "ShaderNodeVolumeScatter").outputs[0]
        for _ in range(40):
            both = scenes.node(coat, "ShaderNodeAddShader", coat.node_tree.nodes["Material Output"].inputs["Volume"])
            for socket in both.inputs:
                coat.node_tree.links.new(found, socket)
            found = both.outputs[0]

    fails("large_emission", "'coat': emission: more nodes than a texture can be made of", large_emission)
    fails("doubled_volumes", "'coat': a sum of more than 1000 volumes", doubled_volumes)
    fails("too_large", "use Render Region or a smaller Resolution", too_large)
    fails("texture_missing", "lost", lose)
    fails("texture_unset", "no picture", unset)
    fails("no_camera", "no camera", no_camera)
    fails("no_program", "no program", lambda _: program("/no/such/program"))
    fails("program_fails", "ended with the code 1", lambda _: program("/bin/false"))
    fails("world", "Add Shader", strange_world)


@test
def losses() -> None:
    """What is not carried is told by name."""
    scene = scenes.materials((32, 18))
    coat = bpy.data.materials["coat"]
    scenes.node(coat, "ShaderNodeTexMagic", scenes.shader(coat).inputs["Base Color"])
    scenes.shader(coat).inputs["Coat Tint"].default_value = (1, 0.5, 0.5, 1)
    scenes.lamp("AREA", (0, 0, 5), spread=1.0)
    scenes.link(bpy.data.objects.new("smoke", bpy.data.volumes.new("smoke")))
    bpy.data.objects["mover"].visible_glossy = False
    scenes.lamp("AREA", (0, 0, 4)).data.cycles.is_portal = True
    scenes.lamp("POINT", (0, 0, 4), energy=-10)
    scenes.lamp("SUN", (0, 0, 4), energy=0.1).visible_camera = True
    scene.camera.data.clip_start = 1
    scene.world.cycles_visibility.glossy = False
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    layer = scene.view_layers[0]
    layer.use_pass_mist = True
    scene.collection.children.link(bpy.data.collections.new("indirect_only"))
    layer.layer_collection.children["indirect_only"].indirect_only = True
    bpy.data.objects["Cube"].is_holdout = True
    scenes.link(bpy.data.objects.new("drawing", bpy.data.grease_pencils_v3.new("drawing")))
    scene.render.engine, scene.rayfront.samples = "RAYFRONT", 1
    bpy.ops.render.render()
    lost = "\n".join(engine().last["lost"])
    for words in (
        "'coat': Coat Tint",
        "the node Magic Texture",
        "'area': a spread",
        "'smoke'",
        "'mover': it is not hidden",
        "'area.001': a portal",
        "'point': it takes light away",
        "'sun': the camera does not see it",
        "'camera': Clip Start",
        "not hidden from rays of the kind glossy",
        "the Sun Disc: it gives its light, and is seen in mirrors",
        "the passes Mist",
        "'Cube': a holdout, without Film",
        "'indirect_only': Indirect Only",
    ):
        check(f"loss_{words}", words in lost, next((line for line in lost.splitlines() if words in line), lost))
    check("loss_none", "drawing" not in lost, "none of Grease Pencil, which Blender draws")


@test
def messages() -> None:
    """The program's messages name no options, and settings that do not fit together are told."""
    scene = scenes.materials((32, 18))
    from bl_ext.user_default.rayfront.program import message

    for said, here in (
        ("error: scene.ron:8:3: too dark (`--depth 8`)", "too dark (Light Paths › Total 8)"),
        ("there is no light (add light: Point(power_w: 100), or --env studio)", "there is no light"),
        ("8 meshes (of 9) are black (--double-sided shows both sides)", "8 meshes (of 9) are black"),
    ):
        check("message", message(said) == here, message(said))
    scene.render.engine, scene.rayfront.samples, scene.rayfront.denoise = "RAYFRONT", 1, True
    scene.render.use_motion_blur, scene.rayfront.adaptive, scene.rayfront.max_time = True, True, 1e-5
    told = attempt(bpy.ops.render.render)
    lost = engine().last["lost"]
    check("settings_apart", "FINISHED" in told and any("Adaptive" in what for what in lost), f"{told}, {lost}")


@test
def cancelling() -> None:
    scene = scenes.materials(SIZE)
    scene.render.engine, scene.rayfront.samples = "RAYFRONT", 100000
    begun, plain = time.perf_counter(), engine()._stops
    engine()._stops = lambda self: time.perf_counter() - begun > 2
    try:
        bpy.ops.render.render()
    finally:
        engine()._stops = plain
    took, last = time.perf_counter() - begun, engine().last
    check("cancelling", bool(last.get("cancelled")) and took < 6, f"after 2 s; back after {took:.1f} s")


@test
def live() -> None:
    scene = scenes.materials(SIZE)
    scene.render.engine, scene.rayfront.samples = "RAYFRONT", 64
    bpy.ops.render.render()
    check("live", engine().last["shown"] > 1, f"{engine().last['shown']} pictures on the way")


def main() -> int:
    global FOLDER
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder", nargs="?", default=os.path.join(HOME.name, "pictures"))
    parser.add_argument("--only", help="names of tests, with commas between")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    if options.list:
        print("\n".join(TESTS))
        return 0
    FOLDER = os.path.abspath(options.folder)
    os.makedirs(FOLDER, exist_ok=True)
    extension = os.path.join(HOME.name, "rayfront.zip")
    package.main(os.path.abspath(options.program), extension, [])
    bpy.ops.extensions.package_install_files(filepath=extension, repo="user_default", enable_on_install=True)
    try:
        for name in options.only.split(",") if options.only else TESTS:
            try:
                TESTS[name]()
            except Exception as error:
                check(name, False, f"{type(error).__name__}: {str(error).strip()}")
                if os.environ.get("RAYFRONT_TRACE"):
                    raise
    finally:
        # Without its extensions, or Python would hang at its end.
        bpy.ops.wm.read_factory_settings(use_empty=True)
    print(f"{len(failures)} failed" if failures else "all as it should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
