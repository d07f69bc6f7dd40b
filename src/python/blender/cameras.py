# SPDX-License-Identifier: MIT OR Apache-2.0
"""Blender's camera as one of rayfront's."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
from mathutils import Matrix

from .images import write_png
from .ron import Ron, form, unscaled


def camera(depsgraph: Any, size: tuple[int, int], folder: str, warn: Callable[[str], None]) -> tuple[Ron, Matrix]:
    """The camera of the scene for an image of this size, and its place in Blender's world."""
    scene = depsgraph.scene
    ob = scene.camera.evaluated_get(depsgraph)
    data, render = ob.data, scene.render
    place = unscaled(ob.matrix_world)
    if render.use_multiview:
        warn("stereoscopy: the left or only camera is used")
    aspect = (render.pixel_aspect_x, render.pixel_aspect_y)
    p = ob.calc_matrix_camera(depsgraph, x=size[0], y=size[1], scale_x=aspect[0], scale_y=aspect[1])
    # Blender's own values cut hardly anything off.
    if data.clip_start > 0.101 or data.clip_end < 99.9:
        warn(f"camera {ob.name!r}: Clip Start and End: it also sees what is nearer or farther")
    if data.type == "PERSP":
        return _perspective(ob, data, p, size, folder, warn, depsgraph), place
    if data.dof.use_dof:
        warn("depth of field of a camera that is not one of perspective")
    if data.type == "ORTHO":
        if abs(p[1][1] / p[0][0] * size[1] / size[0] - 1) > 1e-3:
            warn("pixels that are not square")
        # A shift is a movement within the plane of the image.
        moved = place @ Matrix.Translation((-p[0][3] / p[0][0], -p[1][3] / p[1][1], 0))
        return form("Orthographic", height_m=2 / p[1][1]), moved
    if data.type != "PANO":
        raise ValueError(f"the camera is of the type {data.type.title()}, which rayfront does not have")
    return _panorama(data, size, warn), place


def _perspective(ob: Any, data: Any, p: Matrix, size: tuple[int, int], folder: str, warn: Any, depsgraph: Any) -> Ron:
    width, height = size
    shift = (p[0][2] / 2, p[1][2] / 2)
    square = abs(p[1][1] / p[0][0] * height / width - 1) < 1e-3
    dof = data.dof
    if not square:
        if dof.use_dof:
            warn("depth of field with pixels that are not square")
        fx, fy = p[0][0] * width / 2, p[1][1] * height / 2
        centre = {"cx": width * (0.5 - shift[0]), "cy": height * (0.5 + shift[1])}
        return form("Intrinsics", fx=fx, fy=fy, **centre, size=size)
    longer = 2 * data.lens / (p[0][0] if width >= height else p[1][1])
    fields: dict[str, Any] = {"focal_length_mm": data.lens, "sensor_width_mm": longer}
    if max(map(abs, shift)) > 1e-6:
        fields["shift"] = shift
    if dof.use_dof:
        distance = dof.focus_distance
        if dof.focus_object:
            target = dof.focus_object.evaluated_get(depsgraph).matrix_world.translation
            distance = -(unscaled(ob.matrix_world).inverted() @ target).z
        fields["focus_distance_m"] = max(distance, 1e-3)
        widening = 1.0
        if dof.aperture_blades >= 3 or abs(dof.aperture_ratio - 1) > 1e-3:
            fields["aperture"] = "aperture.png"
            widening = _aperture(dof, os.path.join(folder, "aperture.png"))
        fields["f_stop"] = max(dof.aperture_fstop / widening, 0.01)
    return form("Photographic", **fields)


def _aperture(dof: Any, path: str, size: int = 256) -> float:
    """Draws the opening of the lens. Returns how many times as wide as the lens the picture is."""
    widening = max(1.0, 1 / dof.aperture_ratio)
    y, x = np.mgrid[0:size, 0:size]
    x, y = ((2 * (v + 0.5) / size - 1) * widening for v in (x, -y + size - 1))
    x = x * dof.aperture_ratio
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    edge = np.ones_like(radius)
    if dof.aperture_blades >= 3:
        # A regular polygon, one corner of which is at the angle of the rotation.
        part = 2 * math.pi / dof.aperture_blades
        edge = math.cos(part / 2) / np.cos((angle - dof.aperture_rotation) % part - part / 2)
    write_png(path, np.repeat((radius <= edge).astype(np.float32)[..., None], 3, axis=2))
    return widening


def panorama(data: Any) -> Any:
    """What has the fields of a camera's panorama: in old versions Cycles. None without that add-on."""
    return data if hasattr(data, "panorama_type") else getattr(data, "cycles", None)


def _panorama(data: Any, size: tuple[int, int], warn: Callable[[str], None]) -> Ron:
    of = panorama(data)
    if of is None:
        raise ValueError("the camera is a panorama, of which Blender knows with the add-on Cycles only")
    kind = of.panorama_type
    if kind == "EQUIRECTANGULAR":
        across, up = of.longitude_max - of.longitude_min, of.latitude_max - of.latitude_min
        level = max(abs(of.longitude_max + of.longitude_min), abs(of.latitude_max + of.latitude_min)) < 1e-4
        if level and across > 0 and up > 0:
            return form("Panorama", horizontal_degrees=math.degrees(across), vertical_degrees=math.degrees(up))
        raise ValueError("the camera is a panorama whose middle is not straight ahead, which rayfront does not have")
    if kind == "FISHEYE_EQUIDISTANT":
        if size[0] != size[1]:
            warn("a Fisheye Equidistant in a picture that is not square: its disc is round here, Cycles stretches it")
        return form("Fisheye", fov_degrees=math.degrees(of.fisheye_fov), mapping=Ron("Equidistant"))
    if kind == "FISHEYE_EQUISOLID":
        return _equisolid(data, of, size, warn)
    raise ValueError(
        f"the camera is a panorama of the type {kind.replace('_', ' ').title()}, which rayfront does not have"
    )


def _equisolid(data: Any, of: Any, size: tuple[int, int], warn: Callable[[str], None]) -> Ron:
    """At the angle t to the axis, the lens throws 2 · lens · sin(t / 2) from the middle of the sensor."""
    width, height = size
    is_upright = data.sensor_fit == "VERTICAL" or data.sensor_fit == "AUTO" and height > width
    side = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    millimetres = side / (height if is_upright else width)  # Of a pixel.
    rim = millimetres * min(size) / (4 * of.fisheye_lens) if of.fisheye_lens else math.inf
    if rim > 1:
        raise ValueError("the lens of the camera's fisheye sees all around within the picture: lengthen it")
    half, edge = 2 * math.asin(rim), of.fisheye_fov / 2
    corner = millimetres * math.hypot(*size) / (4 * of.fisheye_lens)
    is_circular = abs(half - edge) < 0.02
    if not is_circular and math.sin(min(edge, math.pi) / 2) < min(corner, 1.0):
        warn(
            f"the Field of View of the fisheye, {math.degrees(2 * edge):.0f} degrees: it sees to the picture's corners"
        )
    return form("Fisheye", fov_degrees=math.degrees(2 * half), mapping=Ron("Equisolid"), circular=is_circular)
