# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings and panels."""

import os
import shutil
import subprocess
import tempfile

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from . import program
from .export import SCENE, Export

LOG = "log.txt"
# Panels of EEVEE's alone.
OTHERS = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes"}


class RayfrontPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension."""

    bl_idname = __package__

    program: StringProperty(
        name="Program", subtype="FILE_PATH", description="The program rayfront; without one, that of the extension"
    )

    def draw(self, context) -> None:
        self.layout.prop(self, "program")


class RayfrontSettings(bpy.types.PropertyGroup):
    """Settings of a scene."""

    samples: IntProperty(
        name="Samples", default=64, min=1, max=4194304, description="Samples per pixel; best a power of two"
    )
    noise: FloatProperty(
        name="Noise Threshold", default=0.0, min=0.0, max=100.0, subtype="PERCENTAGE",
        description="Ends earlier, once the noise is below this part of the picture's brightness; 0: never",
    )  # fmt: skip
    max_time: FloatProperty(name="Time Limit", default=0.0, min=0.0, unit="TIME_ABSOLUTE", description="0: none")
    adaptive: BoolProperty(name="Adaptive", description="More samples where they reduce the error most")
    denoise: BoolProperty(name="Denoise", description="The pass Noisy Image keeps the picture as it was")
    seed: IntProperty(name="Seed", min=0, description="Another number gives other, equally valid noise")
    max_depth: IntProperty(name="Total", default=12, min=0, max=1000)
    diffuse_depth: IntProperty(name="Diffuse", default=12, min=0, max=1000)
    glossy_depth: IntProperty(name="Glossy", default=12, min=0, max=1000)
    transmission_depth: IntProperty(name="Transmission", default=12, min=0, max=1000)
    clamp: FloatProperty(
        name="Clamp", default=0.0, min=0.0, description="Cuts off what paths bring beyond this radiance; 0: nothing"
    )
    caustics: BoolProperty(name="Caustics", default=True, description="The light of glass and mirrors, by photons")
    live: BoolProperty(name="Show While Rendering", default=True)
    keep: StringProperty(
        name="Keep Scene in", subtype="DIR_PATH", description="A folder for the scene of the last picture"
    )


class RAYFRONT_OT_live_page(bpy.types.Operator):
    """Shows the scene on rayfront's page, where it renders as you look around. Modifiers are as in the viewport"""

    bl_idname = "rayfront.live_page"
    bl_label = "Open the Live Page"

    processes = []

    def execute(self, context) -> set:
        lost = []
        folder = tempfile.mkdtemp(prefix="rayfront_live_")
        try:
            Export(context.evaluated_depsgraph_get(), folder, lost.append).write(None)
            command = [program.path(), "view", SCENE]
            with open(os.path.join(folder, LOG), "wb") as log:  # It says where its page is.
                process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, **program.HIDDEN)
            self.processes.append((process, folder))
        except (ValueError, OSError) as error:
            self.report({"ERROR"}, f"rayfront: {error}")
            return {"CANCELLED"}
        for what in lost:
            self.report({"WARNING"}, f"rayfront: not carried over: {what}")
        return {"FINISHED"}

    @classmethod
    def close(cls) -> None:
        """Ends all pages."""
        for process, folder in cls.processes:
            process.terminate()
            process.wait(20)
            shutil.rmtree(folder, ignore_errors=True)
        cls.processes.clear()


class RenderPanel(bpy.types.Panel):
    """A panel of the tab Render."""

    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    COMPAT_ENGINES = {"RAYFRONT"}
    names: tuple = ()

    @classmethod
    def poll(cls, context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        for name in self.names:
            self.layout.prop(context.scene.rayfront, name)


class RAYFRONT_PT_sampling(RenderPanel):
    """How much work goes into a picture."""

    bl_label = "Sampling"
    names = ("samples", "noise", "max_time", "adaptive", "denoise", "seed")

    def draw(self, context) -> None:
        super().draw(context)
        self.layout.operator("rayfront.live_page", icon="URL")


class RAYFRONT_PT_light_paths(RenderPanel):
    """How far light is followed."""

    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}
    names = ("max_depth", "diffuse_depth", "glossy_depth", "transmission_depth", "clamp", "caustics")


class RAYFRONT_PT_film(RenderPanel):
    """What the picture shows, and where the scene stays."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}
    names = ("live", "keep")

    def draw(self, context) -> None:
        super().draw(context)
        self.layout.prop(context.scene.render, "film_transparent", text="Transparent")
        self.layout.prop(context.scene.render, "filter_size", text="Filter Width")


class RAYFRONT_PT_passes(bpy.types.Panel):
    """The passes that rayfront has, in the tab View Layer."""

    bl_label = "Passes"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "view_layer"
    COMPAT_ENGINES = {"RAYFRONT"}

    @classmethod
    def poll(cls, context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context) -> None:
        self.layout.use_property_split = True
        for name in ("use_pass_z", "use_pass_normal", "use_pass_position", "use_pass_diffuse_color"):
            self.layout.prop(context.view_layer, name)


CLASSES = (
    RayfrontPreferences,
    RayfrontSettings,
    RAYFRONT_OT_live_page,
    RAYFRONT_PT_sampling,
    RAYFRONT_PT_light_paths,
    RAYFRONT_PT_film,
    RAYFRONT_PT_passes,
)


def of_any_engine():
    """Blender's own panels that fit any engine: those of EEVEE, without what is its alone."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", set())
        if engines & {"BLENDER_RENDER", "BLENDER_EEVEE_NEXT"} and panel.__name__ not in OTHERS:
            yield panel


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rayfront = bpy.props.PointerProperty(type=RayfrontSettings)
    for panel in of_any_engine():
        panel.COMPAT_ENGINES.add("RAYFRONT")


def unregister() -> None:
    RAYFRONT_OT_live_page.close()
    for panel in of_any_engine():
        panel.COMPAT_ENGINES.discard("RAYFRONT")
    del bpy.types.Scene.rayfront
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
