# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings and panels."""

import os
import shutil
import subprocess
import tempfile

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from . import program
from .cameras import panorama
from .export import SCENE, Export

LOG = "log.txt"
# Panels that have EEVEE in their names, or an equivalent of these, and fit any engine.
FITTING = {
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_displacement",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_MATERIAL_PT_viewport_settings",
    "EEVEE_MATERIAL_PT_volume",
    "EEVEE_WORLD_PT_surface",
    "EEVEE_WORLD_PT_volume",
    "NODE_DATA_PT_EEVEE_light",
}
# Panels of EEVEE's or Workbench's alone: by their whole names, or a part.
OTHERS = {"DATA_PT_light", "NODE_DATA_PT_light", "VIEWLAYER_PT_layer_passes", "VIEW3D_PT_shading_render_pass"}
PARTS = ("eevee", "lightprobe")


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
        lost: dict[str, None] = {}
        folder = tempfile.mkdtemp(prefix="rayfront_live_")
        try:
            Export(context.evaluated_depsgraph_get(), folder, lost.setdefault).write(None)
            command = [program.path(), "view", SCENE]
            with open(os.path.join(folder, LOG), "wb") as log:  # It says where its page is.
                process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, **program.HIDDEN)
            self.processes.append((process, folder))
        except Exception as error:
            shutil.rmtree(folder, ignore_errors=True)
            if not isinstance(error, (ValueError, OSError)):
                raise
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


class EnginePanel:
    """A panel that is there with this engine."""

    bl_space_type, bl_region_type = "PROPERTIES", "WINDOW"
    COMPAT_ENGINES = {"RAYFRONT"}

    @classmethod
    def poll(cls, context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def columns(self):
        """The panel's layout, with names to the left of values, which nothing animates."""
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        return self.layout


class RenderPanel(EnginePanel):
    """A panel of the tab Render, with settings of this engine."""

    bl_context = "render"
    names: tuple = ()

    def draw(self, context) -> None:
        layout = RenderPanel.columns(self)
        for name in self.names:
            layout.prop(context.scene.rayfront, name)


class RAYFRONT_PT_sampling(RenderPanel, bpy.types.Panel):
    """How much work goes into a picture."""

    bl_label = "Sampling"
    names = ("samples", "noise", "max_time", "adaptive", "denoise", "seed")

    def draw(self, context) -> None:
        RenderPanel.draw(self, context)
        self.layout.operator("rayfront.live_page", icon="URL")


class RAYFRONT_PT_light_paths(RenderPanel, bpy.types.Panel):
    """How far light is followed."""

    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}
    names = ("max_depth", "diffuse_depth", "glossy_depth", "transmission_depth", "clamp", "caustics")


class RAYFRONT_PT_film(RenderPanel, bpy.types.Panel):
    """What the picture shows, and where the scene stays."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}
    names = ("live", "keep")

    def draw(self, context) -> None:
        RenderPanel.draw(self, context)
        layout, render, cycles = self.layout, context.scene.render, getattr(context.scene, "cycles", None)
        if cycles:
            layout.prop(cycles, "film_exposure", text="Exposure")
            layout.prop(cycles, "pixel_filter_type", text="Pixel Filter")
            if cycles.pixel_filter_type != "BOX":
                layout.prop(cycles, "filter_width", text="Filter Width")
        else:
            layout.prop(render, "filter_size", text="Filter Width")
        layout.prop(render, "film_transparent", text="Transparent")
        if cycles:
            column = layout.column()
            column.active = render.film_transparent
            column.prop(cycles, "film_transparent_glass", text="Transparent Glass")


class RAYFRONT_PT_motion_blur(EnginePanel, bpy.types.Panel):
    """When the shutter is open."""

    bl_label, bl_context = "Motion Blur", "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context) -> None:
        layout, render = EnginePanel.columns(self), context.scene.render
        layout.active = render.use_motion_blur
        layout.prop(render, "motion_blur_position", text="Position")
        layout.prop(render, "motion_blur_shutter")


class RAYFRONT_PT_performance(EnginePanel, bpy.types.Panel):
    """How many threads work."""

    bl_label, bl_context = "Performance", "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context) -> None:
        layout, render = EnginePanel.columns(self), context.scene.render
        layout.prop(render, "threads_mode")
        column = layout.column()
        column.enabled = render.threads_mode == "FIXED"
        column.prop(render, "threads")


class RAYFRONT_PT_passes(EnginePanel, bpy.types.Panel):
    """The passes that rayfront has, in the tab View Layer."""

    bl_label, bl_context = "Passes", "view_layer"

    def draw(self, context) -> None:
        layout = EnginePanel.columns(self)
        for name in ("use_pass_z", "use_pass_normal", "use_pass_position", "use_pass_diffuse_color"):
            layout.prop(context.view_layer, name)


class RAYFRONT_PT_light_groups(EnginePanel, bpy.types.Panel):
    """The light groups of the view layer."""

    bl_label, bl_context, bl_parent_id = "Light Groups", "view_layer", "RAYFRONT_PT_passes"

    def draw(self, context) -> None:
        layer, row = context.view_layer, self.layout.row()
        row.column().template_list(
            "UI_UL_list", "lightgroups", layer, "lightgroups", layer, "active_lightgroup_index", rows=3
        )
        column = row.column(align=True)
        column.operator("scene.view_layer_add_lightgroup", icon="ADD", text="")
        column.operator("scene.view_layer_remove_lightgroup", icon="REMOVE", text="")
        column.operator("scene.view_layer_add_used_lightgroups", icon="FILE_REFRESH", text="")


class RAYFRONT_PT_override(EnginePanel, bpy.types.Panel):
    """What replaces all materials, or the world."""

    bl_label, bl_context = "Override", "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context) -> None:
        layout = EnginePanel.columns(self)
        for name in ("material_override", "world_override"):
            if hasattr(context.view_layer, name):
                layout.prop(context.view_layer, name)


class RAYFRONT_PT_object(EnginePanel, bpy.types.Panel):
    """What Blender's panel Visibility shows with Cycles alone."""

    bl_label, bl_context, bl_parent_id = "Film and Light", "object", "OBJECT_PT_visibility"

    def draw(self, context) -> None:
        layout, ob = EnginePanel.columns(self), context.object
        if ob.type == "LIGHT":
            layout.prop(ob, "visible_camera", text="Camera")
        else:
            layout.prop(ob, "is_shadow_catcher")
        layout.prop_search(ob, "lightgroup", context.view_layer, "lightgroups", text="Light Group")


class RAYFRONT_PT_world(EnginePanel, bpy.types.Panel):
    """What Blender shows of a world with Cycles alone."""

    bl_label, bl_context = "Settings", "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context) -> bool:
        return bool(context.world) and context.engine in cls.COMPAT_ENGINES

    def draw(self, context) -> None:
        layout, world = EnginePanel.columns(self), context.world
        if hasattr(world, "cycles_visibility"):
            layout.prop(world.cycles_visibility, "camera")
        layout.prop_search(world, "lightgroup", context.view_layer, "lightgroups", text="Light Group")


class RAYFRONT_PT_panorama(EnginePanel, bpy.types.Panel):
    """The fields of panoramas and fisheyes, which Blender shows with Cycles alone."""

    bl_label, bl_context, bl_parent_id = "Panorama", "data", "DATA_PT_lens"

    @classmethod
    def poll(cls, context) -> bool:
        return bool(context.camera) and context.camera.type == "PANO" and context.engine in cls.COMPAT_ENGINES

    def draw(self, context) -> None:
        layout = EnginePanel.columns(self)
        data = panorama(context.camera)
        if data is None:
            layout.label(text="Panoramas need the add-on Cycles", icon="ERROR")
            return
        layout.prop(data, "panorama_type")
        if data.panorama_type == "EQUIRECTANGULAR":
            names = ("latitude_min", "latitude_max", "longitude_min", "longitude_max")
        else:
            names = ("fisheye_lens", "fisheye_fov") if data.panorama_type == "FISHEYE_EQUISOLID" else ("fisheye_fov",)
        for name in names:
            layout.prop(data, name)


CLASSES = (
    RayfrontPreferences,
    RayfrontSettings,
    RAYFRONT_OT_live_page,
    RAYFRONT_PT_sampling,
    RAYFRONT_PT_light_paths,
    RAYFRONT_PT_film,
    RAYFRONT_PT_motion_blur,
    RAYFRONT_PT_performance,
    RAYFRONT_PT_passes,
    RAYFRONT_PT_light_groups,
    RAYFRONT_PT_override,
    RAYFRONT_PT_object,
    RAYFRONT_PT_world,
    RAYFRONT_PT_panorama,
)


def of_any_engine():
    """Blender's own panels that fit any engine: those of EEVEE, without what is its alone and the panels within that."""
    panels = {panel.__name__: panel for panel in bpy.types.Panel.__subclasses__()}

    def fits(name: str) -> bool:
        if name in OTHERS or (name not in FITTING and any(part in name.lower() for part in PARTS)):
            return False
        parent = getattr(panels.get(name), "bl_parent_id", "")
        return not parent or fits(parent)

    for name, panel in panels.items():
        if not issubclass(panel, EnginePanel) and fits(name):
            engines = getattr(panel, "COMPAT_ENGINES", None)  # Other extensions may have what cannot be added to.
            if isinstance(engines, set) and engines & {"BLENDER_RENDER", "BLENDER_EEVEE_NEXT", "BLENDER_EEVEE"}:
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
