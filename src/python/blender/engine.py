# SPDX-License-Identifier: MIT OR Apache-2.0
"""The render engine: the scene goes out in `update`, pixels come back in `render`."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
from typing import Any

import bpy
import numpy as np

from . import exr, program
from .export import SCENE, Export, Exported, Moments, folder
from .tev import Viewer

OUTPUT, DENOISED = "out.exr", "out.denoised.exr"
# Blender's passes by rayfront's layers: the flag of the view layer, the pass, its channels and kind, the layer.
PASSES = (
    ("use_pass_z", "Depth", "Z", "VALUE", "depth"),
    ("use_pass_normal", "Normal", "XYZ", "VECTOR", "normal"),
    ("use_pass_position", "Position", "XYZ", "VECTOR", "position"),
    ("use_pass_diffuse_color", "DiffCol", "RGB", "COLOR", "albedo"),
)
# Those that are always there, that Blender draws itself, and a switch of others.
OTHER_PASSES = {"use_pass_combined", "use_pass_grease_pencil", "use_pass_cryptomatte_accurate"}
NOISY = "Noisy Image"
# The depth of what is not hit, in Blender.
FAR = 1e10
# The places of the shutter's time at which moving things are looked at.
MOMENTS = [0.0, 0.25, 0.5, 0.75, 1.0]


class RayfrontEngine(bpy.types.RenderEngine):
    """Renders with the program `rayfront`, as a process of its own: whatever happens to it, Blender goes on."""

    bl_idname = "RAYFRONT"
    bl_label = "rayfront"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False  # The material panels of Cycles and EEVEE.
    bl_use_eevee_viewport = True  # "Material Preview" in the viewport is EEVEE's.

    # How the last picture went, for tests: seconds, and what was not carried over.
    last: dict[str, Any] = {}

    def update_render_passes(self, scene: Any = None, layer: Any = None) -> None:
        """Tells Blender which passes there will be."""
        self.register_pass(scene, layer, "Combined", 4, "RGBA", "COLOR")
        for flag, name, channels, kind, _ in PASSES:
            if getattr(layer, flag):
                self.register_pass(scene, layer, name, len(channels), channels, kind)
        for group in layer.lightgroups:
            self.register_pass(scene, layer, f"Combined_{group.name}", 3, "RGB", "COLOR")
        if scene.rayfront.denoise:
            self.register_pass(scene, layer, NOISY, 3, "RGB", "COLOR")

    def update(self, data: Any = None, depsgraph: Any = None) -> None:
        """Writes the scene. Blender keeps the viewport from being drawn meanwhile, so what is read does not change."""
        self.lost: dict[str, None] = {}
        self.fault: str | None = None
        self.folder: str | None = None
        started = time.perf_counter()
        try:
            keep = depsgraph.scene.rayfront.keep
            self.folder = folder(keep) if keep else tempfile.mkdtemp(prefix="rayfront_")
            self._missing_passes(depsgraph.view_layer_eval)
            self.exported: Exported = Export(depsgraph, self.folder, self._lose).write(self._moments(depsgraph))
            if self.exported.shutter and depsgraph.scene_eval.rayfront.adaptive:
                self._lose("Adaptive, together with motion blur")
        except (ValueError, OSError) as error:
            self.fault = str(error)
        except Exception as error:  # Blender would only print it, and save an empty picture.
            self.fault = f"{type(error).__name__}: {error}"
            if os.environ.get("RAYFRONT_TRACE"):
                raise
        RayfrontEngine.last = {"export_s": time.perf_counter() - started, "lost": list(self.lost)}

    def render(self, depsgraph: Any) -> None:
        """Renders what `update` has written."""
        try:
            for what in self.lost:
                self.report({"WARNING"}, f"rayfront: not carried over: {what}")
            if not self.fault:
                self._render(depsgraph)
        except (ValueError, OSError) as error:
            self.fault = str(error)
        except Exception as error:
            self.fault = f"{type(error).__name__}: {error}"
        finally:
            if self.folder and not depsgraph.scene.rayfront.keep:
                shutil.rmtree(self.folder, ignore_errors=True)
        if self.fault:
            self.report({"ERROR"}, f"rayfront: {self.fault}")

    def _lose(self, what: str) -> None:
        self.lost.setdefault(what)

    def _missing_passes(self, layer: Any) -> None:
        """Tells of passes that are asked for, and are not among those of `update_render_passes`."""
        known = {flag for flag, *_ in PASSES} | OTHER_PASSES
        wanted = [(of, p) for of in (layer, getattr(layer, "cycles", None)) if of for p in of.bl_rna.properties]
        names = [
            prop.name
            for of, prop in wanted
            if prop.identifier.startswith("use_pass_") and prop.identifier not in known and getattr(of, prop.identifier)
        ]
        names += [f"{aov.name} (Shader AOV)" for aov in layer.aovs]
        if names:
            self._lose(f"the passes {', '.join(names)}")

    def _moments(self, depsgraph: Any) -> Moments | None:
        """The shutter, if Blender wants things to be blurred that move."""
        scene, layer = depsgraph.scene, depsgraph.view_layer_eval
        render = depsgraph.scene_eval.render
        if not (render.use_motion_blur and getattr(layer, "use_motion_blur", True)) or render.motion_blur_shutter <= 0:
            return None
        part = render.motion_blur_shutter
        before = {"START": 0.0, "CENTER": part / 2, "END": part}[render.motion_blur_position]
        frame, subframe = scene.frame_current, scene.frame_subframe

        def go_to(moment: float) -> None:
            at = frame + subframe + part * moment - before
            self.frame_set(int(at // 1), at % 1)

        def go_back() -> None:
            self.frame_set(frame, subframe)

        # One frame of the program is one second: the shutter's part of it is at most that.
        return Moments(min(part, 1.0), MOMENTS, go_to, go_back)

    def _stops(self) -> bool:
        return self.test_break()

    def _command(self, depsgraph: Any, viewer: Viewer | None) -> tuple[list[str], tuple[int, int]]:
        """The command line, and the size of what it renders."""
        scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
        mine, render = scene.rayfront, scene.render
        layers = [name for flag, _, _, _, name in PASSES if getattr(layer, flag)]
        command = [program.path(), SCENE, "-o", OUTPUT, "--json", "--progress", "json", "--checkpoint", "off"]
        command += ["--aov", ",".join(layers)] if layers else []
        command += ["--denoise"] if mine.denoise else []
        command += ["--adaptive"] if mine.adaptive and not self.exported.shutter else []
        command += ["--until", f"noise={max(mine.noise, 1e-6):.6f}%"] if mine.noise > 0 else []
        command += ["--max-time", f"{max(mine.max_time, 0.001):.3f}s"] if mine.max_time > 0 else []
        command += ["--threads", str(render.threads)] if render.threads_mode == "FIXED" else []
        command += ["--tev", viewer.address] if viewer else []
        if self.exported.shutter:
            command += ["--frames", "0", "--fps", "1", "--shutter", str(self.exported.shutter), "--overwrite"]
        width, height = self.exported.size
        if not render.use_border:
            return command, (width, height)
        x0, y0 = int(render.border_min_x * width), int(render.border_min_y * height)
        x1, y1 = max(int(render.border_max_x * width), x0 + 1), max(int(render.border_max_y * height), y0 + 1)
        command += ["--crop", f"{x0},{height - y1},{x1},{height - y0}"]
        return command, (x1 - x0, y1 - y0)

    def _render(self, depsgraph: Any) -> None:
        viewer = Viewer() if depsgraph.scene.rayfront.live else None
        try:
            command, size = self._command(depsgraph, viewer)
            with contextlib.suppress(FileNotFoundError):  # That of the last picture, where the scene is kept.
                os.remove(os.path.join(self.folder, DENOISED))
            started = time.perf_counter()
            said = self._run(command, size, depsgraph.view_layer_eval.name, viewer)
            if said is None:
                return
        finally:
            if viewer:
                viewer.close()
        for warning in said.get("warnings", []):
            self.report({"WARNING"}, f"rayfront: {program.message(warning)}")
        RayfrontEngine.last |= {"program_s": time.perf_counter() - started, "warnings": said.get("warnings")}
        started = time.perf_counter()
        self._read(depsgraph, size)
        RayfrontEngine.last["read_s"] = time.perf_counter() - started

    def _run(self, command: list[str], size: tuple[int, int], layer: str, viewer: Viewer | None) -> dict | None:
        """Runs the program, and shows how far it is. Returns what it says at its end; None if the user has cancelled."""
        changes, shown, lines = 0, 0, []
        # Files rather than pipes, which fill up while nobody reads.
        with (
            open(os.path.join(self.folder, "said.json"), "w+b") as out,
            open(os.path.join(self.folder, "log.txt"), "w+b") as log,
            open(log.name, "rb") as progress,
            subprocess.Popen(command, cwd=self.folder, stdout=out, stderr=log, **program.HIDDEN) as process,
        ):
            self.update_stats("", "Loading")
            while process.poll() is None:
                if self._stops():
                    process.terminate()
                    process.wait(20)
                    RayfrontEngine.last["cancelled"] = True
                    return None
                if viewer and viewer.changes != changes and viewer.picture.shape[:2] == size[::-1]:
                    changes, shown = viewer.changes, shown + 1
                    self._show(viewer.picture, layer)
                if viewer:
                    viewer.poll(0.1)
                else:
                    time.sleep(0.02)
                lines += self._progress(progress)
            lines += self._progress(progress)
            out.seek(0)
            said = out.read().decode("utf-8", "replace")
        RayfrontEngine.last["shown"] = shown
        if process.returncode != 0:
            RayfrontEngine.last["log"] = lines
            fault = next((line for line in lines if line.startswith("error")), lines[-1] if lines else "")
            raise ValueError(
                program.message(fault) or f"the program ended with the code {process.returncode}, and said nothing"
            )
        return json.loads(said)

    def _progress(self, log: Any) -> list[str]:
        """Takes in what the program has said of its progress. Returns its other lines."""
        others = []
        for line in log.read().decode("utf-8", "replace").splitlines():
            try:
                told = json.loads(line)
                percent, left = told["percent"], told.get("seconds_left")
            except (ValueError, KeyError, TypeError):
                others.append(line)
                continue
            self.update_progress(percent / 100)
            remaining = f" | {left:.0f} s left" if percent > 0 and left is not None else ""
            self.update_stats("", f"{told.get('samples', 0):.0f} samples{remaining}")
        return others

    def _show(self, picture: np.ndarray, layer: str) -> None:
        height, width = picture.shape[:2]
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., :3] = picture * self.exported.exposure
        result = self.begin_result(0, 0, width, height, layer=layer)
        result.layers[0].passes["Combined"].rect.foreach_set(rgba[::-1].ravel())
        self.update_result(result)
        self.end_result(result, cancel=False, do_merge_results=False)

    def _read(self, depsgraph: Any, size: tuple[int, int]) -> None:
        """Hands the finished picture to Blender. A part's result is as large as the part."""
        width, height = size
        mine = depsgraph.scene_eval.rayfront
        planes = exr.read(os.path.join(self.folder, OUTPUT))
        denoised = os.path.join(self.folder, DENOISED)
        light = planes
        if mine.denoise and os.path.exists(denoised):
            light = exr.read(denoised)
        elif mine.denoise:
            self.report({"WARNING"}, "rayfront: nothing is denoised: that takes two samples of each pixel")
        alpha = light["A"] if depsgraph.scene_eval.render.film_transparent else np.ones((height, width), np.float32)
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer_eval.name)
        passes = result.layers[0].passes

        def put(name: str, *channels: np.ndarray) -> None:
            if name in passes:
                rows = np.stack(channels, axis=2)[::-1]
                passes[name].rect.foreach_set(np.ascontiguousarray(rows, np.float32).ravel())

        exposure = np.float32(self.exported.exposure)
        put("Combined", *(light[c] * exposure for c in "RGB"), alpha)
        put(NOISY, *(planes[c] * exposure for c in "RGB"))
        if "depth.Z" in planes:
            put("Depth", np.where(np.isfinite(planes["depth.Z"]), planes["depth.Z"], FAR))
        for layer, name in (("normal", "Normal"), ("position", "Position")):
            if f"{layer}.X" in planes:
                put(name, planes[f"{layer}.X"], -planes[f"{layer}.Z"], planes[f"{layer}.Y"])
        for group in depsgraph.view_layer_eval.lightgroups:
            dark = np.zeros((height, width), np.float32)
            put(f"Combined_{group.name}", *(planes.get(f"light_{group.name}.{c}", dark) * exposure for c in "RGB"))
        if "albedo.R" in planes:
            put("DiffCol", planes["albedo.R"], planes["albedo.G"], planes["albedo.B"])
        self.end_result(result)
        self.update_progress(1.0)
