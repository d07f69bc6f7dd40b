# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders scenes in Blender's Python module with rayfront and with Cycles, and compares: see README.md.

    python test_blender.py PROGRAM [FOLDER] [--only NAMES] [--list]

PROGRAM is packed as an extension and installed as a user would, in a folder for this test alone. FOLDER keeps the
pictures. Exits with 1 if something is not as it should be.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import time
from typing import Any, Callable

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
HOME = tempfile.TemporaryDirectory(prefix="rayfront_test_")
os.environ["BLENDER_USER_RESOURCES"] = HOME.name

import bpy  # noqa: E402  (after its folder is known)
import numpy as np  # noqa: E402

import package  # noqa: E402
import test_looks  # noqa: E402
import test_scenes as scenes  # noqa: E402

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
    return picture[:height, :width].reshape(height // side, side, width // side, side, 3).mean(axis=(1, 3))


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
    compare("four_lamps", scenes.lamps(SIZE, "POINT", "SUN", "AREA", "SPOT"), 256, 512, 0.003)


@test
def each_lamp() -> None:
    for kind in ("POINT", "SUN", "AREA", "SPOT"):
        compare(f"lamp_{kind.lower()}", scenes.lamps(SIZE, kind), 128, 256, 0.005)


@test
def grey_world() -> None:
    compare("grey_world", scenes.lamps(SIZE), 128, 256, 0.003)


@test
def materials() -> None:
    compare("materials", scenes.materials(SIZE), 256, 512, rms=0.08)


@test
def looks() -> None:
    for name, (_, limit) in test_looks.LOOKS.items():
        if not ONLY_LOOKS or name in ONLY_LOOKS:
            compare(f"look_{name}", test_looks.scene(name), 64, 128, limit, rms=0.06)


ONLY_LOOKS = [name for name in os.environ.get("RAYFRONT_LOOKS", "").split(",") if name]


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
