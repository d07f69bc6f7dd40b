"""The Python module: the same films as the program's, and rays that meet what they should."""

import base64
import json
import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rayfront

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("RAYFRONT_PROGRAM")

TRIANGLE = (np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], dtype=np.float32), np.array([[0, 1, 2]], dtype=np.uint32))


def ball(**settings):
    return rayfront.World(
        settings={"size": (32, 18), "samples": 4, **settings},
        materials={"red": rayfront.BlinnPhong(diffuse=(0.8, 0.1, 0.1))},
        entities=[
            {"name": "front", "camera": rayfront.Pinhole(vertical_fov_degrees=40),
             "transform": rayfront.LookAt(from_=(0, 1, 4), to=(0, 0, 0))},
            {"name": "far", "camera": rayfront.Pinhole(vertical_fov_degrees=40),
             "transform": {"translate": (0, 0, 40)}},
            {"light": rayfront.Point(power_w=200), "transform": {"translate": (2, 3, 3)}},
            {"shape": rayfront.Sphere(radius_m=1), "material": "red"},
        ],
    )


@pytest.mark.skipif(not PROGRAM, reason="RAYFRONT_PROGRAM names no program")
@pytest.mark.parametrize("scene", ["cornell", "figure_07_refraction_a", "materials"])
def test_films_are_those_of_the_program(scene, tmp_path):
    path = ROOT / "scenes" / f"{scene}.ron"
    command = [PROGRAM, path, "--size", "48x36", "--spp", "2", "--json", "--quiet", "--output", tmp_path / "a.png"]
    told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    world = rayfront.load(path)
    for schedule in ("wavefront", "recursive"):
        assert world.render(size=(48, 36), spp=2, schedule=schedule).film_hash == told["film_hash"]
    assert np.allclose(world.render(size=(48, 36), spp=2).numpy().mean((0, 1)), told["mean"], rtol=1e-5)


@pytest.mark.skipif(not PROGRAM, reason="RAYFRONT_PROGRAM names no program")
def test_parts_are_those_that_the_program_lists():
    path = ROOT / "scenes" / "cornell.ron"
    world = rayfront.load(path)
    for query in (None, "Light", 'Material["w*"]'):
        words = [PROGRAM, "ls", path, *([query] if query else []), "--json"]
        told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)["found"]
        assert world.parts(query) == [(part["name"], part["keys"]) for part in told] and told
    with pytest.raises(ValueError, match="did you mean \"Light\""):
        world.parts("Lihgt")


@pytest.mark.skipif(not PROGRAM, reason="RAYFRONT_PROGRAM names no program")
def test_a_world_is_the_scene_file_that_it_says(tmp_path):
    world = ball()
    path = tmp_path / "ball.ron"
    path.write_text(world.text)
    command = [PROGRAM, path, "--json", "--quiet", "--output", tmp_path / "a.png"]
    told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    assert world.render().film_hash == told["film_hash"] == rayfront.load(path).render().film_hash


def test_images_are_arrays_pictures_and_files(tmp_path):
    image = ball().render(layers=["depth", "normal", "entity"], denoise=True)
    pixels = image.numpy()
    assert pixels.shape == (18, 32, 3) and pixels.dtype == np.float32
    assert pixels[9, 16, 0] > 4 * pixels[9, 16, 1] > 0 and not pixels[0, 0].any()
    assert image.layers["depth"].shape == (18, 32) and image.layers["depth"].dtype == np.float32
    assert image.layers["normal"].shape == (18, 32, 3)
    assert image.layers["entity"].dtype == np.uint32 and image.layers["entity"][9, 16] == 4
    assert set(image.names) == {"entity"} and list(image.names["entity"]) == [4]
    assert ball().render(layers=["material"]).names == {"material": {2: "red"}}
    assert image.denoised.shape == pixels.shape
    assert image._repr_png_().startswith(b"\x89PNG")
    image.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == image._repr_png_()
    image.save(str(tmp_path / "a.exr"))
    assert (tmp_path / "a.exr").stat().st_size > 18 * 32 * 4
    with pytest.raises(OSError, match="must end in .png"):
        image.save(tmp_path / "a.gif")


def test_pictures_are_as_screens_show_them(tmp_path):
    image = ball().render(denoise=True)
    assert np.array_equal(np.asarray(image), image.numpy()) and np.asarray(image, dtype=np.float64).dtype == np.float64
    shown = image.srgb()
    assert shown.shape == (18, 32, 3) and shown.dtype == np.uint8
    # The curve of sRGB, cut off at 1.
    linear = np.clip(image.numpy().astype(np.float64), 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(shown - 255 * curve).max() < 0.51
    assert (image.srgb(denoised=True) != shown).any()
    assert image.exposure == 0
    brighter = ball().render(exposure=1)
    assert brighter.exposure == 1
    chosen = ball().render(exposure="auto").exposure
    assert chosen != 0 and abs(ball().render(exposure=chosen).exposure - chosen) < 1e-6
    assert brighter.film_hash == image.film_hash and brighter.srgb().mean() > shown.mean()
    assert np.array_equal(ball().render(tonemap="clamp").srgb(), shown)
    assert not np.array_equal(ball().render(tonemap="agx").srgb(), shown)
    image.save(tmp_path / "8.png")
    image.save(tmp_path / "16.png", bits=16)
    image.save(tmp_path / "clean.png", denoised=True)
    assert len({(tmp_path / name).read_bytes() for name in ("8.png", "16.png", "clean.png")}) == 3
    for wrong, says in [
        (lambda: image.save(tmp_path / "a.png", bits=12), "8 or 16"),
        (lambda: brighter.srgb(denoised=True), "denoise=True"),
        (lambda: ball().render(tonemap="filmic"), "there are: clamp"),
        (lambda: ball().render(exposure="dark"), '"auto"'),
        (lambda: ball().render(exposure=65), "exposure_ev is 65"),
    ]:
        with pytest.raises(ValueError, match=says):
            wrong()


def test_parts_and_limits_of_a_rendering():
    whole = ball().render()
    part = ball().render(crop=(8, 4, 24, 16))
    assert part.size == [16, 12] and np.array_equal(part.numpy(), whole.numpy()[4:16, 8:24])
    with pytest.raises(ValueError, match="x0 < x1 <= 32"):
        ball().render(crop=(8, 4, 40, 16))
    # Noise that is there after the first pass ends it.
    early = ball().render(spp=512, noise=10.0)
    assert early.samples == 16 and 0 < early.noise < 10
    with pytest.warns(rayfront.SceneWarning, match="a higher spp"):
        assert ball().render(spp=32, noise=1e-9).samples == 32
    mirror = rayfront.load(ROOT / "scenes" / "figure_05_reflections.ron")
    assert mirror.render(size=(32, 24), spp=1, depth=0).film_hash != mirror.render(size=(32, 24), spp=1).film_hash


def test_what_is_not_as_it_was_meant_is_told():
    dark = [
        {"camera": rayfront.Pinhole(vertical_fov_degrees=40), "transform": {"translate": (0, 0, 4)}},
        {"shape": rayfront.Sphere(radius_m=1)},
    ]
    world = rayfront.World(dark, settings={"size": (16, 16), "samples": 1})
    with pytest.warns(rayfront.SceneWarning, match="there is no light"):
        image = world.render()
    assert any("there is no light" in warning for warning in image.warnings)
    findings = world.check()
    assert any("there is no light" in finding.what for finding in findings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ball().render()
    assert ball().check() == []


def test_models_are_read_as_they_are_meant(tmp_path):
    (tmp_path / "model.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    plain = rayfront.load(tmp_path / "model.ply", size=(32, 32))
    assert plain.size == (32, 32)
    images = {
        rayfront.load(tmp_path / "model.ply", size=(32, 32), **how).render(spp=1).srgb().tobytes()
        for how in (
            {},
            {"ground": True},
            {"zoom": 2},
            {"orbit": (30, 10)},
            {"look_at": ((0, 0, 3), (0, 0, 0))},
            {"env": "studio"},
            {"up": "z"},
            {"env": "sky", "env_turn": 90},
            {"env": "sky", "env_strength": 0.5},
            {"background": 0.25},
            {"background": (1, 0.5, 0)},
            {"background": "#c03020"},
        )
    }
    assert len(images) == 12
    # A camera that is added makes room for an image of any shape.
    loaded = rayfront.load(tmp_path / "model.ply")
    upright = loaded.render(size=(16, 64), spp=1)
    assert upright.film_hash == rayfront.load(tmp_path / "model.ply", size=(16, 64)).render(spp=1).film_hash
    assert any("no camera" in note for note in upright.notes) and not upright.warnings
    placed = rayfront.World([{"shape": rayfront.Mesh("model.ply")}], folder=tmp_path)
    with pytest.raises(ValueError, match="no camera"):
        placed.render(size=(8, 8), spp=1)
    for wrong, says in [({"zoom": -1}, "zoom: "), ({"look_at": (1, 2, 3)}, "two points"), ({"orbit": 3}, "two angles")]:
        with pytest.raises(ValueError, match=says):
            rayfront.load(tmp_path / "model.ply", **wrong)
    with pytest.raises(ValueError, match="light_units"):
        rayfront.load(tmp_path / "model.ply", light_units="lumen")
    with pytest.raises(ValueError, match='unknown up "x": use "y" or "z"'):
        rayfront.load(tmp_path / "model.ply", up="x")
    with pytest.raises(ValueError, match="solid_glass: this is for .gltf"):
        rayfront.load(tmp_path / "model.ply", solid_glass=True)
    with pytest.raises(ValueError, match="^set: "):
        rayfront.load(tmp_path / "model.ply", set="Light[")


def test_variables_of_a_scene_file_are_given(tmp_path):
    (tmp_path / "scene.ron").write_text("""(
        variables: {"radius": 1, "paint": 0.5, "visible": false},
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0, 6), to: (0, 0, 0))),
            (light: Area(power_w: 200, size_m: 1, visible: $visible), transform: LookAt(from: (0, 4, 4), to: (0, 0, 0))),
            (shape: Sphere(radius_m: $radius), material: (diffuse: $paint)),
        ],
    )""")

    def hash_of(**var):
        return rayfront.load(tmp_path / "scene.ron", size=(32, 32), var=var).render(spp=1).film_hash

    assert hash_of() == hash_of(radius=1.0, paint="0.5", visible=False) != hash_of(radius=2)
    assert hash_of(paint=(1, 0, 0)) == hash_of(paint=np.array([1.0, 0, 0])) == hash_of(paint="Srgb(1, 0, 0)")
    with pytest.raises(ValueError, match='^var: unknown variable "radios".*did you mean "radius"'):
        hash_of(radios=1)


def test_a_clip_of_a_model_is_chosen(tmp_path):
    times = struct.pack("<2f", 0, 1)
    places = [struct.pack("<6f", 0, 0, 0, *to) for to in ((1, 0, 0), (0, 1, 0))]
    triangle = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    views, binary = [], b""
    for part in (times, *places, triangle):
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(part)})
        binary += part
    kinds = ((0, 2, "SCALAR"), (1, 2, "VEC3"), (2, 2, "VEC3"), (3, 3, "VEC3"))
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    model = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 3}}]}],
        "animations": [
            {"name": name, "samplers": [{"input": 0, "output": at}], "channels": [channel]}
            for at, name in ((1, "right"), (2, "up"))
        ],
        "accessors": [
            {"bufferView": view, "componentType": 5126, "count": count, "type": kind} for view, count, kind in kinds
        ],
        "bufferViews": views,
        "buffers": [
            {"byteLength": len(binary), "uri": "data:application/octet-stream;base64," + base64.b64encode(binary).decode()}
        ],
    }
    path = tmp_path / "clips.gltf"
    path.write_text(json.dumps(model))

    def hash_of(**how):
        look_at = ((0, 0, 5), (0, 0, 0))
        world = rayfront.load(path, time=1, look_at=look_at, size=(32, 32), **how)
        return world.render(spp=1).film_hash

    assert hash_of(animation="up") == hash_of(animation=1) != hash_of(animation="right") == hash_of(animation=0)
    with pytest.raises(ValueError, match='there is no animation "down"; animations: right, up'):
        hash_of(animation="down")


def test_what_is_told_of_a_rendering_counts():
    world = ball()
    assert world.cameras == ["front", "far"] and world.size == (32, 18)
    one = world.render(size=(8, 6), spp=1)
    assert one.size == [8, 6] and one.samples == 1
    assert world.render(seed=1).film_hash != world.render().film_hash
    assert world.render(camera="far").numpy().mean() < world.render(camera="front").numpy().mean() / 10
    assert world.render(threads=1).film_hash == world.render(threads=2).film_hash


def test_meshes_of_arrays_are_seen():
    mesh = rayfront.Mesh(*TRIANGLE)
    world = rayfront.World(
        [
            {"camera": rayfront.Orthographic(height_m=2), "transform": {"translate": (0, 0, 3)}},
            {"shape": mesh, "material": rayfront.BlinnPhong(emission=1, diffuse=0)},
        ],
        settings={"size": (64, 64), "samples": 16},
    )
    # The triangle takes half of the square around it.
    assert abs(world.render().numpy()[..., 0].mean() - 0.5) < 0.02

    class Duck:
        vertices, faces = TRIANGLE

    moved = np.eye(4)
    moved[:3, 3] = 0, 0, 3
    by_matrix = rayfront.World(
        [
            {"camera": rayfront.Orthographic(height_m=2), "transform": moved},
            {"shape": mesh, "material": rayfront.BlinnPhong(emission=1, diffuse=[0, 0, 0])},
        ],
        settings={"size": (64, 64), "samples": 16},
    )
    assert by_matrix.render().film_hash == world.render().film_hash

    again = rayfront.World(
        [
            {"camera": rayfront.Orthographic(height_m=2), "transform": {"translate": (0, 0, 3)}},
            {"shape": rayfront.Mesh(Duck), "material": rayfront.BlinnPhong(emission=1, diffuse=0)},
        ],
        settings={"size": (64, 64), "samples": 16},
    )
    assert again.render().film_hash == world.render().film_hash


def test_colours_of_meshes_multiply_those_of_materials():
    vertices = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]])

    def middle(*arrays, **colors):
        world = rayfront.World(
            settings={"size": (32, 32), "samples": 1},
            materials={"white": rayfront.Principled(base_color=0.8, metallic=0)},
            entities=[
                {"camera": rayfront.Pinhole(vertical_fov_degrees=40), "transform": {"translate": (0, 0, 4)}},
                {"light": rayfront.Sky(elevation_degrees=60)},
                {"shape": rayfront.Mesh(*arrays, **colors), "material": "white"},
            ],
        )
        return world.render(layers="albedo").layers["albedo"][16, [4, 28]]

    of_faces = np.array([[255, 0, 0], [0, 128, 255]], dtype=np.uint8)
    left, right = middle(vertices, faces, colors=of_faces)
    assert np.allclose(left, [0, 0.8 * 0.2158605, 0.8], atol=1e-3) and np.allclose(right, [0.8, 0, 0], atol=1e-3)
    of_vertices = np.full((4, 3), 0.5, dtype=np.float32)
    assert np.allclose(middle(vertices, faces, colors=of_vertices), 0.4, atol=1e-3)
    # What trimesh gives: four channels.
    mesh = SimpleNamespace(vertices=vertices, faces=faces)
    mesh.visual = SimpleNamespace(kind="face", face_colors=np.column_stack([of_faces, [255, 255]]).astype(np.uint8))
    assert np.allclose(middle(mesh), [left, right])
    mesh.visual = SimpleNamespace(kind="texture")
    with pytest.warns(rayfront.SceneWarning, match="texture and the material of the mesh are not used"):
        middle(mesh)
    with pytest.raises(ValueError, match="3 colors for 4 vertices and 2 faces"):
        rayfront.Mesh(vertices, faces, colors=np.ones((3, 3)))
    with pytest.raises(TypeError, match="not int64"):
        rayfront.Mesh(vertices, faces, colors=np.full((4, 3), 200))
    with pytest.raises(ValueError, match="colors must be at least 0"):
        rayfront.Mesh(vertices, faces, colors=np.full((4, 3), np.nan))


def test_cameras_are_matrices():
    """What a pixel's position is, its projection gives back."""
    pose = np.eye(4)
    pose[:3, 3] = 0.5, 1, 4
    world = rayfront.World(
        settings={"size": (64, 48), "samples": 1, "pixel_pattern": rayfront.Center},
        entities=[
            # As a list, and with an error of rounding.
            {"camera": rayfront.Pinhole(vertical_fov_degrees=50), "transform": (pose + 1e-9).tolist()},
            {"light": rayfront.Point(power_w=100), "transform": {"translate": (0, 4, 4)}},
            {"shape": rayfront.Plane(corners=((-9, -9, -1), (9, -9, -1), (9, 9, -2), (-9, 9, -2)))},
        ],
    )
    for crop in (None, (10, 4, 50, 40)):
        image = world.render(layers="position", crop=crop, transport=rayfront.Whitted)
        assert np.allclose(image.pose, pose, atol=1e-6)
        camera = image.layers["position"].reshape(-1, 3) @ image.pose[:3, :3] - image.pose[:3, 3] @ image.pose[:3, :3]
        # Y and Z of pictures go the other way.
        seen = (camera * [1, -1, -1]) @ image.intrinsics.T
        width, height = image.size
        y, x = np.mgrid[:height, :width] + 0.5
        assert np.allclose(seen[:, :2] / seen[:, 2:], np.column_stack([x.ravel(), y.ravel()]), atol=1e-2)


def test_what_memory_does_not_hold_is_an_error():
    """In a process that may have 4 GB, whatever the machine has."""
    code = """
import resource, rayfront
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
world = rayfront.World([{"camera": rayfront.Pinhole(vertical_fov_degrees=40)}, {"shape": rayfront.Sphere(radius_m=1)}])
try:
    world.render(size=(20000, 20000), spp=1)
except MemoryError as error:
    print(error)
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert told.returncode == 0 and "20000x20000" in told.stdout, told


def test_messages_name_arguments(tmp_path):
    dark = rayfront.World(
        settings={"size": (16, 9)},
        entities=[
            {"camera": rayfront.Pinhole(vertical_fov_degrees=40), "transform": {"translate": (0, 0, 4)}},
            {"shape": rayfront.Sphere(radius_m=1)},
        ],
    )
    assert any('or env="studio"' in (found.remedy or "") for found in dark.check())
    (tmp_path / "inner").mkdir()
    (tmp_path / "a.ply").write_text("ply\n")
    (tmp_path / "inner" / "a.ron").write_text('(entities: [(shape: Mesh("../a.ply"))])')
    with pytest.raises(ValueError, match=r"rayfront\.allow_outside\(\) lets a scene refer to it"):
        rayfront.load(tmp_path / "inner" / "a.ron")
    whitted = ball(transport=rayfront.Whitted)
    assert ball(transport=rayfront.Path).render().film_hash == whitted.render(transport="path").film_hash
    with pytest.raises(ValueError, match="unknown transport"):
        whitted.render(transport="paht")


def test_mistakes_in_meshes_name_the_entity():
    good = rayfront.Mesh(*TRIANGLE)
    bad = rayfront.Mesh(TRIANGLE[0], np.array([[0, 1, 7]]))
    with pytest.raises(ValueError, match=r"entities\[1\]: its mesh: a triangle has"):
        rayfront.World([{"shape": good}, {"name": "table", "shape": bad}])


def test_mistakes_are_errors_that_say_what_is_wrong(tmp_path):
    with pytest.raises(ValueError, match=r'^entities\[1\]: .*did you mean "radius_m"') as told:
        rayfront.World([{"name": "eye"}, {"shape": rayfront.Sphere(raduis_m=1)}])
    _, line, mark = str(told.value).split("\n")
    assert line[mark.index("^"):].startswith("raduis_m")
    with pytest.raises(ValueError, match=r"^materials\['red'\]: "):
        rayfront.World(materials={"red": rayfront.Principled(metalic=0)})
    with pytest.raises(ValueError, match="^settings: "):
        rayfront.World(settings={"samples": -1})
    with pytest.raises(FileNotFoundError):
        rayfront.load(tmp_path / "nothing.ron")
    with pytest.raises(ValueError, match="there is no camera"):
        ball().render(camera="left")
    with pytest.raises(ValueError, match="samples is 0: it must be 1 to"):
        ball().render(spp=0)
    with pytest.raises(ValueError, match="unknown layer"):
        ball().render(layers=["dept"])
    with pytest.raises(ValueError, match=r"vertices \[0, 1, 3\], but there are 3"):
        rayfront.World([{"shape": rayfront.Mesh(TRIANGLE[0], [[0, 1, 3]])}])
    with pytest.raises(TypeError):
        rayfront.World([{"shape": object()}])
    with pytest.raises(AttributeError):
        rayfront.nothing


def test_progress_is_told_and_other_threads_go_on():
    parts, counted = [], 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    rayfront.load(ROOT / "scenes" / "materials.ron").render(size=(320, 240), spp=8, progress=parts.append)
    done.set()
    thread.join()
    assert parts == sorted(parts) and 0 <= parts[0] <= parts[-1] <= 1
    assert counted > 10

    def fail(part):
        raise KeyError("enough")

    with pytest.raises(KeyError):
        rayfront.load(ROOT / "scenes" / "materials.ron").render(size=(640, 480), spp=64, progress=fail)


def test_an_interrupt_ends_a_rendering():
    # What a shell runs in the background ignores interrupts.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, signal.raise_signal, [signal.SIGINT])
    timer.start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        rayfront.load(ROOT / "scenes" / "materials.ron").render(size=(1920, 1080), spp=4096)
    signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begun < 20


def test_rays_meet_the_nearest_triangle():
    random = np.random.default_rng(1)
    corners = random.uniform(-1, 1, (200, 3, 3)).astype(np.float32)
    scene = rayfront.Scene(corners.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    origins = random.uniform(-3, 3, (5000, 3)).astype(np.float32)
    directions = random.uniform(-1, 1, (5000, 3)).astype(np.float32) - origins
    hits = scene.closest(origins, directions)
    # Möller and Trumbore, in double precision, of all rays and triangles.
    o, d = (a.astype(np.float64)[:, None] for a in (origins, directions))
    a, b, c = (corners[None, :, i].astype(np.float64) for i in range(3))
    p = np.cross(d, c - a)
    with np.errstate(all="ignore"):
        inverse = 1 / np.einsum("rtk,rtk->rt", np.broadcast_to(b - a, p.shape), p)
        s = o - a
        u = np.einsum("rtk,rtk->rt", s, p) * inverse
        q = np.cross(s, np.broadcast_to(b - a, s.shape))
        v = np.einsum("rtk,rtk->rt", np.broadcast_to(d, q.shape), q) * inverse
        t = np.einsum("rtk,rtk->rt", np.broadcast_to(c - a, q.shape), q) * inverse
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    nearest = t.argmin(1)
    wanted = t[np.arange(len(t)), nearest]
    same = np.isclose(hits.t, wanted, rtol=1e-4) | (np.isinf(hits.t) & np.isinf(wanted))
    # At edges rounding decides.
    assert same.mean() > 0.998
    hit = np.isfinite(wanted) & same
    assert hit.sum() > 1000 and (hits.primitive[hit] == nearest[hit]).mean() > 0.999
    assert (hits.primitive[np.isinf(hits.t)] == -1).all()
    assert (scene.any(origins, directions) == np.isfinite(hits.t)).all()
    assert not scene.any(origins, directions, t_max=hits.t * 0.9).any()
    for options in ({"threads": 1}, {"coherence": "coherent"}, {"coherence": "scattered"}):
        assert all(np.array_equal(a, b) for a, b in zip(hits, scene.closest(origins, directions, **options)))
    alone, many = scene.closest(origins[7], directions[7]), scene.closest(np.tile(origins, (8, 1)), np.tile(directions, (8, 1)))
    assert all(np.array_equal(a, b[7:8]) for a, b in zip(alone, hits))
    assert all(np.array_equal(np.tile(a, 8), b) for a, b in zip(hits, many))


def test_instances_and_spheres_have_numbers():
    builder = rayfront.SceneBuilder()
    triangle, ball = builder.add_mesh(*TRIANGLE), builder.add_spheres([[0, 0, 0, 0.5]])
    moved = np.eye(4)
    moved[0, 3] = 10
    first, second, round_one = builder.place(triangle), builder.place(triangle, moved), builder.place(ball, moved[:3])
    scene = builder.build()
    hits = scene.closest([[0, 0, 5], [10, -0.9, 5], [10, 0, 5], [99, 0, 5]], [0, 0, -1])
    assert hits.instance.tolist() == [first, second, round_one, -1]
    assert hits.shape.tolist() == [triangle, triangle, ball, -1]
    assert np.allclose(hits.t[:3], [5, 5, 4.5])
    # They are padded by what rounding takes.
    assert np.allclose(scene.bounds, [[-1, -1, -0.5], [11, 1, 0.5]], atol=1e-4)
    assert scene.memory_bytes > 0
    with pytest.raises(ValueError, match="has been built"):
        builder.place(triangle)
    with pytest.raises(ValueError, match=re.escape("shape (N, 3)")):
        rayfront.Scene([[0, 0]], [[0, 1, 2]])


def test_slips_are_told():
    scene, builder = rayfront.Scene(*TRIANGLE), rayfront.SceneBuilder()
    shape = builder.add_mesh(*TRIANGLE)
    moved = np.eye(4)
    moved[3, 0] = 10
    for wrong, says in [
        (lambda: rayfront.Scene(TRIANGLE[0]), "vertices and faces"),
        (lambda: rayfront.Scene(TRIANGLE[0], [[0.0, 1.0, 2.0]]), "whole numbers"),
        (lambda: rayfront.Scene(TRIANGLE[0], [[0, 1, 2, 0]]), "only triangles"),
        (lambda: builder.place(shape, moved), "last column"),
        (lambda: builder.place(-1), "add_mesh"),
        (lambda: builder.add_spheres([0, 0, 0, 1]), r"\(N, 4\)"),
        (lambda: scene.any(np.zeros((2, 3)), np.ones((3, 3))), "2 origins and 3 directions"),
        (lambda: scene.any(np.zeros((2, 3)), [1, 1, 1], t_max=[1, 2, 3]), "3 t_max for 2 rays"),
        (lambda: scene.any(np.zeros((2, 1)), [1, 1, 1]), r"\(N, 3\)"),
        (lambda: ball().render(size=64), "a width and a height"),
        (lambda: ball().render(size=(64.5, 36)), "a width and a height"),
        (lambda: ball().render(spp=-1), "spp must be a whole number of at least 0"),
        (lambda: ball().render(spp=2.5), "spp must be a whole number"),
        (lambda: ball().render(camera=0), "camera must be one of"),
        (lambda: ball().render(crop=5), "crop must be"),
    ]:
        with pytest.raises((TypeError, ValueError), match=says):
            wrong()
    empty = scene.closest(np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(empty.t) == 0 and len(scene.any(np.zeros((0, 3)), [0, 0, 1])) == 0


def test_the_guide_is_right(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "src" / "python" / "README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 8
    (tmp_path / "model.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    space = {"origins": np.zeros((4, 3)), "directions": np.ones((4, 3))}
    for block in blocks:
        small = block.replace("model.glb", "model.ply").replace("spp=64", "spp=1").replace("640, 360", "64, 36")
        exec(small.replace('    camera="left",', "    # "), space)
    assert (tmp_path / "model.png").exists() and (tmp_path / "triangle.png").exists()


def test_names_that_scenes_do_not_know_are_refused():
    assert rayfront.Sphere(radius_m=1) is not None and repr(rayfront.Path) == "Path"
    for wrong in ("Wrold", "Shpere", "World2", "sphere"):
        with pytest.raises(AttributeError, match=wrong):
            getattr(rayfront, wrong)
    assert {"Sphere", "Principled", "World"} <= set(dir(rayfront))


def test_one_thread_is_one_thread_from_the_beginning():
    side = 500
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    z = np.random.default_rng(1).random((side, side))
    vertices = np.stack([x, z, y], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (x + side * y)[:-1, :-1].ravel()
    faces = np.concatenate([np.stack([corner, corner + side, corner + 1], 1), np.stack([corner + 1, corner + side, corner + side + 1], 1)])
    world = rayfront.World(
        settings={"size": (8, 8), "samples": 1},
        entities=[
            {"camera": rayfront.Pinhole(vertical_fov_degrees=40), "transform": rayfront.LookAt(from_=(0, 99, 0), to=(250, 0, 250))},
            {"light": rayfront.Point(power_w=1e6), "transform": {"translate": (250, 200, 250)}},
            {"shape": rayfront.Mesh(vertices, faces.astype(np.uint32))},
        ],
    )
    world.render(threads=1)
    wall, cpu = time.perf_counter(), time.process_time()
    world.render(threads=1)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    assert cpu < 1.2 * wall, f"{cpu:.2f} s of CPU time in {wall:.2f} s"
