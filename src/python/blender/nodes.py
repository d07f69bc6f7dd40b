# SPDX-License-Identifier: MIT OR Apache-2.0
"""Node trees as a renderer reads them: from an input to the node behind it, through reroutes and groups."""

from __future__ import annotations

from typing import Any, NamedTuple

# Sockets of three numbers.
WIDE = {"RGBA", "VECTOR", "ROTATION"}
# The parts of red, green and blue in the number that Cycles makes of a colour.
LUMINANCE = (0.2126, 0.7152, 0.0722)

# Output nodes that count.
TARGETS = ("CYCLES", "ALL")


class Input(NamedTuple):
    """An input of a node. `groups` are the group nodes that it lies within, the innermost last."""

    socket: Any
    groups: tuple = ()

    @property
    def value(self) -> Any:
        """The value that it has when nothing is linked: a number or a tuple. A colour has no alpha.

        If it takes what comes into a group, and nothing does, that is the value of the group's input.
        """
        end = self._end()
        socket = (end if isinstance(end, Input) else self).socket
        value = getattr(socket, "default_value", None)
        if not hasattr(value, "__len__") or isinstance(value, str):
            is_spread = self.socket.type in WIDE and isinstance(value, (int, float))
            return (value,) * 3 if is_spread else value
        value = tuple(value)[:3]
        if self.socket.type in WIDE:
            return value
        return sum(c * weight for c, weight in zip(value, weights(socket)))

    def source(self) -> Output | None:
        """The output that feeds it, or None."""
        end = self._end()
        return end if isinstance(end, Output) else None

    def _end(self) -> Output | Input:
        """Follows the links, to an output or to the input whose value counts."""
        socket, groups, seen = self.socket, self.groups, set()
        while socket.is_linked and not socket.links[0].is_muted:
            if not socket.links[0].is_valid or (socket.as_pointer(), groups) in seen:
                return self  # A ring of reroutes.
            seen.add((socket.as_pointer(), groups))
            output = socket.links[0].from_socket
            node = output.node
            if node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.mute:
                # What it passes on, as in Blender.
                through = next((link.from_socket for link in node.internal_links if link.to_socket == output), None)
                if through is None:
                    return self
                socket = through
            elif node.type == "GROUP" and node.node_tree:
                inner = next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
                found = inner and next((i for i in inner.inputs if i.identifier == output.identifier), None)
                if not found:
                    return self
                socket, groups = found, groups + (node,)
            elif node.type == "GROUP_INPUT" and groups:
                socket = next(i for i in groups[-1].inputs if i.identifier == output.identifier)
                groups = groups[:-1]
            else:
                return Output(output, groups)
        return Input(socket, groups)


def weights(socket: Any) -> tuple[float, ...]:
    """The parts of a socket's three values in the number that Cycles makes of them."""
    return LUMINANCE if socket.type == "RGBA" else (1 / 3, 1 / 3, 1 / 3)


class Output(NamedTuple):
    """An output of a node."""

    socket: Any
    groups: tuple = ()

    @property
    def node(self) -> Any:
        return self.socket.node

    @property
    def type(self) -> str:
        return self.socket.node.type

    def input(self, name: str | int) -> Input:
        """An input of the same node."""
        return Input(self.node.inputs[name], self.groups)

    def has(self, name: str) -> bool:
        """True for an input that is in use: modes of a node take inputs away."""
        found = self.node.inputs.get(name)
        return found is not None and found.enabled

    def inputs(self) -> list[Input]:
        """The inputs of the same node that are in use."""
        return [Input(socket, self.groups) for socket in self.node.inputs if socket.enabled]


def leads_to(source: Output | None, kinds: set[str]) -> bool:
    """True if colours come into an output from a node of one of these kinds."""
    pending, seen = [source], set()
    while pending:
        part = pending.pop()
        if part is None or part in seen:
            continue
        if part.type in kinds:
            return True
        seen.add(part)
        pending += [i.source() for i in adjusted(part)]
    return False


def adjusted(source: Output) -> list[Input]:
    """The inputs of an output's node that it changes: colours, else numbers. Factors and coordinates are none."""
    inputs = [] if source.type.startswith("TEX_") else source.inputs()
    colors = [i for i in inputs if i.socket.type == "RGBA"]
    return colors or [i for i in inputs if i.socket.type == "VALUE" and not i.socket.name.startswith("Fac")]


def surface(tree: Any, kind: str, socket: str) -> Output | None:
    """The shader of a tree's output node as Cycles chooses it: its own, else one for all; the active one, else the first."""
    outputs = [n for n in tree.nodes if n.type == kind and n.target in TARGETS]
    outputs.sort(key=lambda n: (TARGETS.index(n.target), not n.is_active_output))
    return Input(outputs[0].inputs[socket]).source() if outputs else None
