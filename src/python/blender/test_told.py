# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is told about single things, for `test_blender.py`: a function of each name changes a scene with a ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

import test_scenes as scenes

# The change of a scene by its name, with parts of the scene file, and of what is told.
CASES: dict[str, tuple[Callable[[Any, Any], None], list[str], list[str]]] = {}


def case(ron: list[str], told: list[str]) -> Callable:
    """A change, after which these words are in the scene file, and these are told. Without words, nothing is."""

    def add(function: Callable) -> Callable:
        CASES[function.__name__] = (function, ron, told)
        return function

    return add


def ball(material: str = "of") -> Any:
    """The object with a material."""
    return next(ob for ob in bpy.data.objects if ob.type == "MESH" and material in ob.data.materials)


@case(["emission: (0.0, 0.0, 0.0)"], ["material 'of': Emission Strength below 0"])
def negative_strength(scene: Any, of: Any) -> None:
    scenes.surface(of, "ShaderNodeEmission", Strength=-2.0)


@case([], ["material 'of': Emission Strength below 0"])
def negative_principled(scene: Any, of: Any) -> None:
    scenes.shader(of).inputs["Emission Color"].default_value = (1, 1, 1, 1)
    scenes.shader(of).inputs["Emission Strength"].default_value = -1


@case([], ["triangles, whose vertices are not numbers"])
def vertex_nowhere(scene: Any, of: Any) -> None:
    ball().data.vertices[5].co = (float("nan"), 0, 0)


@case([], ["lamp 'point': Max Bounces 0"])
def lamp_bounces(scene: Any, of: Any) -> None:
    bpy.data.lights["point"].cycles.max_bounces = 0


@case([], ["lamp 'point': mirrors and glass show it, also without Multiple Importance"])
def lamp_without_importance(scene: Any, of: Any) -> None:
    bpy.data.lights["point"].cycles.use_multiple_importance_sampling = False


@case([], [])
def lamp_point_without_importance(scene: Any, of: Any) -> None:
    bpy.data.lights["point"].cycles.use_multiple_importance_sampling = False
    bpy.data.lights["point"].shadow_soft_size = 0


@case([], ["'point': it is not hidden from rays of the kind glossy, transmission"])
def lamp_hidden_from_mirrors(scene: Any, of: Any) -> None:
    bpy.data.objects["point"].visible_glossy = bpy.data.objects["point"].visible_transmission = False


@case([], ["Shadow Terminator"])
def terminator(scene: Any, of: Any) -> None:
    ball().shadow_terminator_geometry_offset = 0.5


@case(["iridescence: "], ["Thin Film on metal"])
def film_on_metal(scene: Any, of: Any) -> None:
    scenes.shader(of).inputs["Metallic"].default_value = 1
    scenes.shader(of).inputs["Thin Film Thickness"].default_value = 400


@case(["iridescence: "], [])
def film_on_plastic(scene: Any, of: Any) -> None:
    scenes.shader(of).inputs["Thin Film Thickness"].default_value = 400


@case(["sheen_color: "], ["Sheen: another model"])
def sheen(scene: Any, of: Any) -> None:
    scenes.shader(of).inputs["Sheen Weight"].default_value = 1


@case(["Noise(kind: Ridged"], ["a Noise Texture of the type Ridged Multifractal", "from 0 to 1, without Distortion"])
def ridges(scene: Any, of: Any) -> None:
    noise = scenes.node(of, "ShaderNodeTexNoise", scenes.shader(of).inputs["Roughness"], Distortion=1.0)
    noise.noise_type = "RIDGED_MULTIFRACTAL"


@case(["Marble("], ["rayfront's own noise, as strong and as fine, bends its bands"])
def bent_waves(scene: Any, of: Any) -> None:
    scenes.node(of, "ShaderNodeTexWave", scenes.shader(of).inputs["Roughness"], Distortion=2.0)


@case(["b: (1.0, 0.0, 0.0)"], ["a Noise Texture: rayfront's own"])
def colored_noise(scene: Any, of: Any) -> None:
    scenes.node(of, "ShaderNodeTexNoise", scenes.shader(of).inputs["Base Color"], "Color")


@case(
    ["radiance: (0.05, 0.05, 0.06)"],
    ["'world': the node Voronoi Texture: the Color of the Background has the plain 0.05, 0.05, 0.06"],
)
def cells_of_world(scene: Any, of: Any) -> None:
    tree = scene.world.node_tree
    cells = tree.nodes.new("ShaderNodeTexVoronoi")
    tree.links.new(cells.outputs["Color"], tree.nodes["Background"].inputs["Color"])


@case(["base_color: (1.0, 1.0, 1.0)", "diffuse_transmission: 0.6"], ["a Subsurface Anisotropy of 0.8"])
def half_subsurface(scene: Any, of: Any) -> None:
    scenes.shader(of).inputs["Subsurface Weight"].default_value = 0.5
    scenes.shader(of).inputs["Subsurface Anisotropy"].default_value = 0.8


@case(["diffuse_transmission: Checker("], ["a Subsurface Weight that is a texture"])
def subsurface_by_checker(scene: Any, of: Any) -> None:
    scenes.node(of, "ShaderNodeTexChecker", scenes.shader(of).inputs["Subsurface Weight"], "Fac")


@case([], [])
def ring_of_reroutes(scene: Any, of: Any) -> None:
    nodes, links = of.node_tree.nodes, of.node_tree.links
    first, second = (nodes.new("NodeReroute") for _ in range(2))
    links.new(first.outputs[0], second.inputs[0])
    links.new(second.outputs[0], first.inputs[0])
    links.new(second.outputs[0], scenes.shader(of).inputs["Roughness"])


@case([], [])
def ring_of_numbers(scene: Any, of: Any) -> None:
    links = of.node_tree.links
    first = scenes.node(of, "ShaderNodeMath", scenes.shader(of).inputs["Roughness"])
    second = scenes.node(of, "ShaderNodeMath", first.inputs[0])
    links.new(first.outputs[0], second.inputs[0])
    links.new(first.outputs[0], second.inputs[1])


def chain(of: Any, operation: str, count: int) -> Any:
    """A chain of Math nodes into Roughness. Returns the input of its first."""
    socket = scenes.shader(of).inputs["Roughness"]
    for _ in range(count):
        math = scenes.node(of, "ShaderNodeMath", socket)
        math.operation, socket = operation, math.inputs[0]
    return socket


@case([], ["the node Math of the operation Sine"])
def chain_on_noise(scene: Any, of: Any) -> None:
    scenes.node(of, "ShaderNodeTexNoise", chain(of, "SINE", 30))


@case([], ["a very long chain of nodes"])
def long_chain(scene: Any, of: Any) -> None:
    scenes.node(of, "ShaderNodeTexNoise", chain(of, "MULTIPLY", 300))


def mixes(of: Any, count: int, *sockets: int) -> Any:
    """A checker behind a row of Mix nodes into Base Color, each of which takes the one before for these inputs.

    Returns the last output.
    """
    found = scenes.node(of, "ShaderNodeTexChecker").outputs["Color"]
    for number in range(count):
        mix = scenes.node(of, "ShaderNodeMix")
        mix.data_type, mix.blend_type = "RGBA", "MULTIPLY" if number % 2 else "ADD"
        for socket in sockets:
            of.node_tree.links.new(found, mix.inputs[socket])
        found = mix.outputs[2]
    of.node_tree.links.new(found, scenes.shader(of).inputs["Base Color"])
    return found


@case(["Checker("], ["'of': more nodes than a texture can be made of"])
def doubled_mixes(scene: Any, of: Any) -> None:
    mixes(of, 40, 6, 7)


@case(["by: 0.5"], [])
def mixes_behind_second_colors(scene: Any, of: Any) -> None:
    mixes(of, 25, 7)


@case([], ["'of': more nodes than a texture can be made of"])
def mixes_behind_factors(scene: Any, of: Any) -> None:
    mixes(of, 12, 0)


@case(["roughness: 0.25"], [])
def doubled_shaders(scene: Any, of: Any) -> None:
    found = scenes.shader(of).outputs[0]
    scenes.shader(of).inputs["Roughness"].default_value = 0.25
    for _ in range(40):
        mix = scenes.surface(of, "ShaderNodeMixShader")
        for socket in (1, 2):
            of.node_tree.links.new(found, mix.inputs[socket])
        found = mix.outputs[0]


@case([], ["'of': a ring or a very long chain of nodes: it is black"])
def long_chain_of_shaders(scene: Any, of: Any) -> None:
    socket = of.node_tree.nodes["Material Output"].inputs["Surface"]
    for _ in range(150):
        socket = scenes.node(of, "ShaderNodeMixShader", socket).inputs[1]


@case(["Subtract(a: 1.0"], [])
def turned_round(scene: Any, of: Any) -> None:
    math = scenes.node(of, "ShaderNodeMath", scenes.shader(of).inputs["Roughness"])
    math.operation = "MULTIPLY_ADD"
    scenes.node(of, "ShaderNodeTexChecker", math.inputs[0], "Fac")
    math.inputs[1].default_value, math.inputs[2].default_value = -1, 1


@case([], ["a number below 0 beside a texture"])
def below_zero(scene: Any, of: Any) -> None:
    math = scenes.node(of, "ShaderNodeMath", scenes.shader(of).inputs["Roughness"])
    math.operation = "MULTIPLY"
    scenes.node(of, "ShaderNodeTexChecker", math.inputs[0], "Fac")
    math.inputs[1].default_value = -1


@case(["Curve("], [])
def stops_in_one_place(scene: Any, of: Any) -> None:
    ramp = scenes.node(of, "ShaderNodeValToRGB", scenes.shader(of).inputs["Base Color"])
    scenes.node(of, "ShaderNodeTexChecker", ramp.inputs[0], "Fac")
    ramp.color_ramp.interpolation = "CONSTANT"
    for position in (0.5, 0.5):
        ramp.color_ramp.elements.new(position)


@case([], ["edge tint above 1"])
def metal_that_reflects_all(scene: Any, of: Any) -> None:
    metal = scenes.surface(of, "ShaderNodeBsdfMetallic")
    metal.fresnel_type = "PHYSICAL_CONDUCTOR"
    metal.inputs["IOR"].default_value, metal.inputs["Extinction"].default_value = (0, 0.5, 1), (0, 2, 3)
