# SPDX-License-Identifier: MIT OR Apache-2.0
"""Light that a rough dielectric above black reflects, by rayfront, by Cycles, and by a walk over its microfacets.

    python test_rims.py PROGRAM

The walk is neither's: light goes from facet to facet of GGX's distribution (Heitz and others 2016), and is reflected at
each by Fresnel's equations, or by Schlick's approximation. With facets of perfect mirrors all of it comes back.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Vector

import exr

INDEX = 1.5
rng = np.random.default_rng(7)


def fresnel(cosine: np.ndarray) -> np.ndarray:
    refracted = np.sqrt(1 - (1 - cosine**2) / INDEX**2)
    across = (cosine - INDEX * refracted) / (cosine + INDEX * refracted)
    along = (INDEX * cosine - refracted) / (INDEX * cosine + refracted)
    return (across**2 + along**2) / 2


def schlick(cosine: np.ndarray) -> np.ndarray:
    straight = ((INDEX - 1) / (INDEX + 1)) ** 2
    return straight + (1 - straight) * (1 - cosine) ** 5


def smith(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """Smith's Λ of directions away from the surface; −1 − Λ(−w) of those towards it."""
    cosine = np.clip(cosine, -1 + 1e-9, 1 - 1e-9)
    slope = alpha**2 * (1 - cosine**2) / cosine**2
    found = (np.sqrt(1 + slope) - 1) / 2
    return np.where(cosine > 0, found, -1 - found)


def walk(degrees: float, alpha: float, reflectance: Callable, count: int = 400_000) -> tuple[float, float]:
    """The part of the light that comes back after one bounce, and after any number."""
    angle = math.radians(degrees)
    ray = np.tile((-math.sin(angle), 0.0, -math.cos(angle)), (count, 1))
    depth = np.ones(count)  # The part of the facets that lie below: heights are uniform.
    weight, once, whole = np.ones(count), 0.0, 0.0
    widths = np.array((alpha, alpha, 1.0))
    for bounce in range(60):
        shadowing = smith(ray[:, 2], alpha)
        chance, up = rng.random(len(ray)), ray[:, 2] > 0
        free = np.zeros(len(ray))
        free[up] = depth[up] ** shadowing[up]
        leaves = up & (chance > 1 - free)
        whole += weight[leaves].sum() / count
        if bounce == 1:
            once = whole
        ray, depth, weight = ray[~leaves], depth[~leaves], weight[~leaves]
        if not len(ray):
            break
        depth = np.clip(depth * (1 - chance[~leaves]) ** (-1 / shadowing[~leaves]), 0, 1)
        # A visible facet: uniform reflections on a hemisphere that is stretched (Dupuy and Benyoub 2023).
        towards = -ray * widths
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        z = (1 - rng.random(len(ray))) * (1 + towards[:, 2]) - towards[:, 2]
        turn, radius = 2 * np.pi * rng.random(len(ray)), np.sqrt(np.maximum(1 - z * z, 0))
        facet = (np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1) + towards) * widths
        facet /= np.linalg.norm(facet, axis=1, keepdims=True)
        cosine = np.clip(-(ray * facet).sum(axis=1), 0, 1)
        weight = weight * reflectance(cosine)
        ray = ray + 2 * cosine[:, None] * facet
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    return once, whole


def by_rayfront(
    program: str, folder: str, degrees: float, roughness: float, base: float = 0, sun: float | None = None
) -> float:
    """A plane, seen from an angle, in light from everywhere or from a sun at another angle, opposite."""
    x, y = 5 * math.sin(math.radians(degrees)), 5 * math.cos(math.radians(degrees))
    light = "(light: Environment(radiance: 1))"
    if sun is not None:
        at = (-math.sin(math.radians(sun)), math.cos(math.radians(sun)), 0)
        light = f"(light: Directional(irradiance: 1), transform: LookAt(from: {at}, to: (0, 0, 0), up: (0, 0, -1)))"
    with open(os.path.join(folder, "rim.ron"), "w", encoding="utf-8") as out:
        out.write(f"""(settings: (size: (8, 8), samples: 1024, transport: Path, max_depth: 0, sharing: Off), entities: [
            (camera: Orthographic(height_m: 0.01), transform: LookAt(from: ({x}, {y}, 0), to: (0, 0, 0), up: (0, 0, -1))),
            {light},
            (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
             material: Principled(base_color: {base}, metallic: 0, roughness: {roughness}, ior: {INDEX}))])""")
    command = [program, "rim.ron", "-o", "rim.exr", "--quiet", "--json"]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return float(exr.read(os.path.join(folder, "rim.exr"))["G"].mean())


def by_cycles(folder: str, degrees: float, roughness: float, base: float = 0, sun: float | None = None) -> float:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 1024, 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 8
    material = bpy.data.materials.new("black")
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (base, base, base, 1)
    inputs["Roughness"].default_value, inputs["IOR"].default_value = roughness, INDEX
    bpy.ops.mesh.primitive_plane_add(size=18)
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale, scene.camera = "ORTHO", 0.01, camera
    camera.location = Vector((math.sin(math.radians(degrees)), 0, math.cos(math.radians(degrees)))) * 5
    camera.rotation_euler = camera.location.to_track_quat("Z", "Y").to_euler()
    scene.world = bpy.data.worlds.new("white")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1) if sun is None else (0, 0, 0, 1)
    if sun is not None:
        lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        bpy.context.collection.objects.link(lamp)
        lamp.data.energy, lamp.data.angle = 1.0, 0.0
        lamp.rotation_euler = (
            Vector((-math.sin(math.radians(sun)), 0, math.cos(math.radians(sun)))).to_track_quat("Z", "Y").to_euler()
        )
    image = scene.render.image_settings
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    scene.render.filepath = os.path.join(folder, "rim_cycles.exr")
    bpy.ops.render.render(write_still=True)
    return float(exr.read(scene.render.filepath)["ViewLayer.Combined.G"].mean())


def main(program: str) -> None:
    white = walk(75, 0.36, np.ones_like, 100_000)[1]
    assert abs(white - 1) < 1e-3, f"mirrors lose light: {white}"
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for roughness in (0.3, 0.6):
            for degrees in (0, 30, 50, 60, 70, 80, 85):
                alpha = roughness**2
                once, whole = walk(degrees, alpha, fresnel)
                row = [whole, once, walk(degrees, alpha, schlick)[0]]
                row += [by_rayfront(program, folder, degrees, roughness), by_cycles(folder, degrees, roughness)]
                rows.append(f"| {roughness} | {degrees}° | " + " | ".join(f"{value:.4f}" for value in row) + " |")
        print("A base colour of 0.5, a roughness of 0.3: light over irradiance, from 75° to 20° and from 20° to 75°")
        for name, by in (
            ("rayfront", lambda *a: by_rayfront(program, folder, *a)),
            ("Cycles", lambda *a: by_cycles(folder, *a)),
        ):
            ways = [by(a, 0.3, 0.5, b) / math.cos(math.radians(b)) for a, b in ((75, 20), (20, 75))]
            print(f"{name}: {ways[0]:.4f} {ways[1]:.4f}")
    print("| roughness | angle | walk | its first bounce | the same by Schlick | rayfront | Cycles |")
    print("\n".join(["|---|---|---|---|---|---|---|"] + rows))


if __name__ == "__main__":
    main(os.path.abspath(sys.argv[1]))
