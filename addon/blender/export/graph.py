# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the values of shader node trees."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import RGB, triple
from .camera import View
from .colour_spaces import Space, colour_space_of, decoded
from .links import DEPTH, Scope, source
from .pixels import floats_of
from .programs import Program, Value
from .properties import found_property
from .report import Notes
from .textures import TextureTable
from .working_space import luminance, luminance_weights

# Nodes that change a colour: their Color input stands for it where a constant is wanted.
ADJUSTMENTS = {"HUE_SAT", "BRIGHTCONTRAST", "GAMMA", "CURVE_RGB"}
# Averaging reads every pixel; 4k x 4k takes about half a second and is the most worth waiting for.
MOST_PIXELS = 4096 * 4096
# What Cycles puts where an image is missing.
MAGENTA = (1.0, 0.0, 1.0)
# Nodes from a material's output to what they are made of, one behind the other: each takes a few of
# Python's calls.
DEEPEST = 600
CALLS = 20 * DEEPEST
# Whether sockets of groups and muted nodes convert what passes them: Blender 5.0 ended that.
CONVERTS = bpy.app.version < (5, 0, 0)
NUMBERS = ("VALUE", "INT", "BOOLEAN")  # types of sockets that hold one
# Nodes that tell of surfaces alone.
OF_SURFACES = {"AMBIENT_OCCLUSION", "BEVEL", "BUMP", "DISPLACEMENT", "FRESNEL", "LAYER_WEIGHT"}
OF_SURFACES |= {"LIGHT_FALLOFF", "LIGHT_PATH", "NORMAL_MAP", "TANGENT", "VECTOR_DISPLACEMENT"}
OF_SURFACES |= {"WIREFRAME"}
NUMBERED = re.compile(r"^\d+_")  # what Blender puts before names of nodes that it copies

# What gives the value of one output of a node.
Reader = Callable[["Graph", bpy.types.Node, bpy.types.NodeSocket, Scope], Value]


@dataclass
class Context:
    """What nodes know besides their inputs: of meshes, by number, the attributes of their corners
    that a material asks for; and what is the same at all points."""

    attributes: list[tuple[str, ...]] = field(default_factory=list)  # a kind, and maybe a name
    index: int = 0  # the material's own
    camera: View | None = None
    holders: tuple[bpy.types.bpy_struct, ...] = ()  # of properties: the view layer, scene, world

    def attribute(self, *what: str) -> int:
        """The number of an attribute, such as "uv" of a name."""
        if what not in self.attributes:
            self.attributes.append(what)
        return self.attributes.index(what)

    def of_view(self, name: str) -> NDArray[np.float64]:
        """(4,): a property of the view layer, or of the scene, or the world."""
        return found_property(self.holders, name)


@dataclass
class Graph:
    """A node tree together with the name and the notes of who owns it."""

    tree: bpy.types.NodeTree
    owner: str  # "Material 'Glass'"
    notes: Notes
    readers: Mapping[str, Reader] = field(default_factory=dict)  # by the node's type
    averages: dict[str, RGB | None] = field(default_factory=dict)  # by image name
    context: Context = field(default_factory=Context)
    program: Program = field(default_factory=Program)
    # The world space normal of the smooth surface that displacement makes; None: the mesh's own.
    displaced: Value | None = None
    undisplaced: bool = False  # asked where the surface was before it moved
    volume: str = ""  # asked at places of one, in a "mesh" or of the "world"; "": of a surface
    textures: TextureTable | None = None  # None: of images the mean alone is wanted
    shaders: list[Any] = field(default_factory=list)  # under way, with their scopes
    holder: Any = None  # what Blender frees the tree with
    _known: dict[Any, Value] = field(default_factory=dict)
    _reading: list[Any] = field(default_factory=list)  # outputs under way

    def output(self, kind: str) -> bpy.types.Node | None:
        """Return the active output node of the tree that serves Cycles."""
        found = [node for node in self.tree.nodes if node.type == kind]
        own, shared = (
            [node for node in found if getattr(node, "target", "ALL") == target]
            for target in ("CYCLES", "ALL")
        )
        outputs = own or shared
        active = [node for node in outputs if node.is_active_output]
        return (active or outputs or [None])[0]

    def tell_absent(self, node: bpy.types.Node) -> None:
        """Write down that a texture's image is missing."""
        self.notes.approximated(self.owner, f"'{node.name}'", f"{missing(node)}: magenta")

    def surface(
        self, kind: str
    ) -> tuple[bpy.types.Node | None, bpy.types.NodeSocket | None, Scope]:
        """Return the shader node that is linked to the output's Surface, and its output."""
        output = self.output(kind)
        if output is None:
            return None, None, ()
        return source(output.inputs["Surface"], ())

    def input(
        self, node: bpy.types.Node, name: str, scope: Scope, otherwise: float | None = None
    ) -> Value:
        """The value of an input by its name; `otherwise` if the node has none such, in this Blender
        or with its options; KeyError without that."""
        if otherwise is not None and name not in node.inputs:
            return Value.of(otherwise)
        return self.value(node.inputs[name], scope)

    def value(self, socket: bpy.types.NodeSocket, scope: Scope) -> Value:
        """The value of an input: of what it is linked to, or its own. What no reader knows is
        approximated by a constant, and noted."""
        passed: list[str] = []
        node, end, inner = source(socket, scope, passed)
        if node is None:
            if not hasattr(end, "default_value"):
                return Value.of(0.0)
            found = Value.of(_numbers(end.default_value))
        elif node.type not in self.readers:
            is_number = socket.type in NUMBERS
            return Value.of((value_of if is_number else colour_of)(self, socket, scope))
        else:
            found = self.output_value(node, end, inner)
        types = [end.type, *(reversed(passed) if CONVERTS else ()), socket.type]
        for given, wanted in pairwise(types):
            found = converted(found, given, wanted)
        if found.constant is not None and not np.isfinite(found.constant).all():
            self.notes.approximated(self.owner, socket.name, "it is not a number: 0 is used")
            return Value.of(np.nan_to_num(found.constant, posinf=0.0, neginf=0.0))
        return found

    def beside(
        self, socket: bpy.types.NodeSocket, scope: Scope, width: float
    ) -> tuple[Value, Value, Value]:
        """The value of an input at the point, and so many footprints along and across from it."""
        kept, found = self.program.shift, []
        for shift in ((0.0, 0.0), (width, 0.0), (0.0, width)):
            self.program.shift = shift
            found.append(self.value(socket, scope))
        self.program.shift = kept
        return found[0], found[1], found[2]

    def nothing_in_volume(self, what: str) -> Value:
        """0 for what places in volumes do not know, which is noted."""
        self.notes.approximated(self.owner, f"{what} in a volume", "0 is used")
        return Value.of(0.0)

    def output_value(
        self, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
    ) -> Value:
        """The value of an output of a node that a reader knows."""
        way = tuple(g.as_pointer() for g in scope)
        key = node.as_pointer(), output.identifier, way, self.program.shift
        if key not in self._known:
            if key in self._reading:
                self.notes.approximated(self.owner, f"'{node.name}'", "its links go in a circle: 0")
                return Value.of(0.0)
            if len(self._reading) >= DEEPEST:
                self.notes.approximated(self.owner, f"'{node.name}'", "too far from its output: 0")
                return Value.of(0.0)
            self._reading.append(key)
            if self.volume and node.type in OF_SURFACES:
                read = self.nothing_in_volume(f"'{node.name}'")
            else:
                read = self.readers[node.type](self, node, output, scope)
            self._reading.pop()
            self._known[key] = read
        return self._known[key]


def resolved(
    whose: bpy.types.Material | bpy.types.World | bpy.types.Light,
) -> tuple[bpy.types.NodeTree, Any]:
    """The nodes that Cycles has, and what frees them: from Blender 5.0 on those that are left when
    Blender has put groups, zones, menus, closures, bundles and what is muted aside."""
    if not hasattr(whose, "inline_shader_nodes"):
        return whose.node_tree, None
    with _for_all_renderers(whose) as shared:
        holder = shared.inline_shader_nodes()
    for node in holder.node_tree.nodes:
        node.name = NUMBERED.sub("", node.name)
    return holder.node_tree, holder


@contextmanager
def _for_all_renderers(whose: Any) -> Iterator[Any]:
    """It, or for a while a copy of it of which Cycles' output is that of all renderers: from
    Blender 5.2 on nothing else is left of others."""
    nodes = whose.node_tree.nodes if whose.node_tree else ()
    if bpy.app.version < (5, 2) or all(getattr(x, "target", "ALL") != "CYCLES" for x in nodes):
        yield whose
        return
    copy = whose.copy()
    try:
        for node in copy.node_tree.nodes:
            if hasattr(node, "target"):
                node.target = "ALL" if node.target == "CYCLES" else "EEVEE"
        yield copy
    finally:
        bpy.data.batch_remove((copy,))


def converted(value: Value, given: str, wanted: str) -> Value:
    """A value of one type of socket as Blender makes one of another of it."""
    if wanted in NUMBERS:
        if given == "RGBA":
            return luminance(value)
        if given == "VECTOR":
            return value.part("average")
    return value


def _numbers(value: Any) -> list[float]:
    """A socket's default value."""
    if isinstance(value, (bool, int, float)):
        return [float(value)]
    return [float(number) for number in list(value)[:4]]


@contextmanager
def many_calls() -> Iterator[None]:
    """Where trees as deep as DEEPEST can be read."""
    kept = sys.getrecursionlimit()
    sys.setrecursionlimit(max(kept, CALLS))
    try:
        yield
    finally:
        sys.setrecursionlimit(kept)


def colour_of(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> RGB:
    """Return the constant colour of an input; what is no constant is approximated, and noted."""
    node, end, scope = source(socket, scope)
    if node is None:
        return _as_colour(getattr(end, "default_value", 0.0))
    if node.type in graph.readers:
        known = converted(graph.output_value(node, end, scope), end.type, socket.type)
        if known.is_constant:
            return known.rgb
    found = _upstream_average(graph, node, end, scope)
    if found is None:
        colour, what = _as_colour(socket.default_value), "the input's own value"
    else:
        colour, what = found
    graph.notes.approximated(
        graph.owner, f"{socket.name} from '{node.name}'", f"{what} {colour_text(colour)} is used"
    )
    return colour


def value_of(graph: Graph, socket: bpy.types.NodeSocket, scope: Scope) -> float:
    """Return the constant number of an input; what is no constant is approximated, and noted."""
    node, end, scope = source(socket, scope)
    if node is None:
        return _as_value(getattr(end, "default_value", 0.0))
    if node.type in graph.readers:
        known = converted(graph.output_value(node, end, scope), end.type, socket.type)
        if known.is_constant:
            return known.number
    if node.type == "FRESNEL":
        ior = value_of(graph, node.inputs["IOR"], scope)
        value, what = normal_reflectance(ior), "the reflectance seen head-on,"
    else:
        found = _upstream_average(graph, node, end, scope)
        if found is None:
            value, what = _as_value(socket.default_value), "the input's own value"
        else:
            value, what = _as_value(found[0]), found[1]
    graph.notes.approximated(
        graph.owner, f"{socket.name} from '{node.name}'", f"{what} {value:.4g} is used"
    )
    return value


def normal_reflectance(ior: float) -> float:
    """Return a dielectric's reflectance at normal incidence (Fresnel)."""
    return ((ior - 1.0) / (ior + 1.0)) ** 2 if ior > 0.0 else 1.0


def colour_text(colour: RGB) -> str:
    return "(" + ", ".join(f"{channel:.4g}" for channel in colour) + ")"


def _upstream_average(
    graph: Graph, node: bpy.types.Node, end: bpy.types.NodeSocket, scope: Scope
) -> tuple[RGB, str] | None:
    """Return the mean colour of the image behind `node`, through colour adjustments."""
    for _ in range(DEPTH):
        if node.type in ("TEX_IMAGE", "TEX_ENVIRONMENT"):
            image = node.image
            absent = missing(node)
            if absent:
                if end.name == "Alpha":
                    return _as_colour(1.0), f"{absent}: opaque"
                return MAGENTA, f"{absent}: magenta"
            colour = image_average(graph, image)
            return None if colour is None else (colour, f"the mean of image '{image.name}'")
        if node.type not in ADJUSTMENTS:
            return None
        following, end, scope = source(node.inputs["Color"], scope)
        if following is None:
            return None
        node = following
    return None


def missing(node: bpy.types.Node) -> str:
    """Return what there is none of, an image at all or its file; "" if the image is there."""
    image = node.image
    if image is None:
        return "no image is chosen"
    path = image.filepath_from_user(image_user=node.image_user)
    if image.source in ("SEQUENCE", "MOVIE"):  # whose size Blender tells once they are shown
        there = Path(path).is_file()
    else:
        there = min(image.size) > 0
    return "" if there else f"image '{image.name}' is missing ({path or 'no path'})"


def image_average(graph: Graph, image: bpy.types.Image) -> RGB | None:
    """Return the linear mean colour of an image, None if it is very large or moving."""
    if image.name not in graph.averages:
        graph.averages[image.name] = _read_average(image)
    return graph.averages[image.name]


def _read_average(image: bpy.types.Image) -> RGB | None:
    width, height = image.size
    if not 0 < width * height <= MOST_PIXELS:
        return None
    pixels = floats_of(image).reshape(-1, image.channels)
    if not image.is_float and colour_space_of(image.colorspace_settings) is Space.SRGB:
        pixels = decoded(pixels)
    mean = pixels.mean(axis=0, dtype=np.float64)
    return _as_colour(mean if len(mean) >= 3 else mean[0])


def _as_colour(value: object) -> RGB:
    if isinstance(value, (int, float)):
        return triple([value] * 3)
    return triple(list(value)[:3])  # type: ignore[call-overload]


def _as_value(value: object) -> float:
    """A number, or a colour's luminance, which is how Blender converts one into the other."""
    if isinstance(value, (int, float)):
        return float(value)
    return float(luminance_weights() @ _as_colour(value))
