# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes make of every direction, as an image: Blender itself evaluates them, by Cycles in a
process of its own (world_script.py), once for each graph and its values."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .graph import MAGENTA, missing
from .links import Scope, source
from .made_nodes import made
from .pixels import rgba_floats
from .working_space import working_space

WIDTH, MOST_WIDTH = 1024, 4096  # [px] of what is evaluated: as much as its largest image
FINE_WIDTH = 2048  # as much where more than FINE of the picture are details of a pixel or two
FINE = 0.02
TIMEOUT = 120.0  # [s]
KEPT = 16  # images of graphs that were evaluated last: of one there may be four
HAVE_THEIR_OWN = ("NORMAL", "RGB", "VALUE")  # types of nodes whose first output has a value
# Types of nodes whose values depend on more than a direction.
UNSUITED = {"CAMERA", "LIGHT_PATH", "SCRIPT", "UVALONGSTROKE"}
# What surfaces have; a world gets no more of it than Cycles gives it, 0 mostly.
OF_SURFACES = {
    "AMBIENT_OCCLUSION",
    "ATTRIBUTE",
    "BEVEL",
    "HAIR_INFO",
    "OBJECT_INFO",
    "PARTICLE_INFO",
    "POINT_INFO",
    "UVMAP",
    "VERTEX_COLOR",
    "VOLUME_INFO",
    "WIREFRAME",
}
# Of Texture Coordinate, where world_coordinates.py has nothing that stands in for them.
UNSUITED_OUTPUTS = {"Camera", "Window"}

_kept: OrderedDict[str, NDArray[np.float32]] = OrderedDict()


class Unsuited(Exception):
    """Nodes cannot be evaluated; the text says which, or why."""


def evaluate(
    node: bpy.types.Node,
    output: bpy.types.NodeSocket,
    scope: Scope,
    changes: Mapping[str, Any] | None = None,
    stand_in: StandIn | None = None,
    least: int = WIDTH,
    tell: Tell | None = None,
    tell_negative: Callable[[], object] = lambda: None,
) -> Any:
    """The radiance or colour of an output in every direction, float32 (height, width, 3), as an
    Environment Texture has it; `changes`: of the node's properties; `stand_in`: for some nodes;
    `least`: pixels across; `tell`: of images that are missing; `tell_negative`: that some of it
    would be below 0, where it is 0. Raises Unsuited."""
    with tempfile.TemporaryDirectory() as folder:
        graph = _Description(Path(folder), stand_in, tell)
        graph.add(node, output, scope)
        nodes = graph.nodes
        nodes[-1]["properties"].update(changes or {})
        given = {
            "nodes": nodes,
            "is_shader": output.type == "SHADER",
            "space": working_space(),
            "width": min(max([least, *graph.widths]), MOST_WIDTH) // 2 * 2,
        }
        key = json.dumps(given, sort_keys=True).replace(json.dumps(folder)[1:-1], "")
        if key in _kept:
            _kept.move_to_end(key)
        else:
            pixels = _evaluated(given, Path(folder))
            if given["width"] < FINE_WIDTH and is_fine(np.maximum(pixels, np.float32(0.0))):
                given["width"] = FINE_WIDTH
                pixels = _evaluated(given, Path(folder))
            _kept[key] = pixels
            if len(_kept) > KEPT:
                _kept.popitem(last=False)
        found = _kept[key]
        if found.min() >= 0.0:
            return found
        tell_negative()
        return np.maximum(found, np.float32(0.0))


def is_fine(pixels: NDArray[np.float32]) -> bool:
    """Whether a picture (height, width, 3), as it is shown, has details of a pixel or two, such as
    stars: there may be others between them."""
    grey = pixels.mean(axis=-1)
    shown = grey / (grey + np.float32(grey.mean(dtype=np.float64) or 1.0))
    height, width = shown.shape
    pairs = shown[: height // 2 * 2, : width // 2 * 2].reshape(height // 2, 2, width // 2, 2)
    detail = np.abs(pairs - pairs.mean(axis=(1, 3), keepdims=True)).mean()
    return bool(detail > FINE * shown.mean())


def _evaluated(given: dict[str, Any], folder: Path) -> NDArray[np.float32]:
    description, output = folder / "nodes.json", folder / "world.npy"
    description.write_text(json.dumps(given), encoding="utf-8")
    script = str(Path(__file__).with_name("world_script.py"))
    if bpy.app.binary_path:
        options = ["--background", "--factory-startup", "--python-exit-code", "1"]
        command = [bpy.app.binary_path, *options, "--python", script, "--"]
    else:  # bpy as a module
        command = [sys.executable, script]
    try:
        done = subprocess.run(
            [*command, str(description), str(output)],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Unsuited(f"Blender could not evaluate it: {error}") from None
    if done.returncode or not output.is_file():
        last = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
        raise Unsuited(f"Blender could not evaluate it: {' '.join(last)}")
    pixels: NDArray[np.float32] = np.nan_to_num(np.load(output), nan=0.0, posinf=0.0, neginf=0.0)
    return pixels


# What takes a node's place for one of its outputs, or feeds the vector of a texture that nothing
# feeds, for None: nodes as _Description has them, whose links' numbers begin with theirs; the last
# one's output is linked. None: nothing does.
StandIn = Callable[[bpy.types.Node, bpy.types.NodeSocket | None], list[dict[str, Any]] | None]
Tell = Callable[[bpy.types.Node], object]


class _Description:
    """A graph as JSON, without groups, reroutes and names: values, and links by number."""

    def __init__(self, folder: Path, stand_in: StandIn | None, tell: Tell | None) -> None:
        """`folder`: where pixels go that no file has."""
        self._stand_in, self._tell = stand_in, tell
        self.nodes: list[dict[str, Any]] = []
        self.widths: list[int] = []  # of its images [px]
        self._folder = folder
        self._numbers: dict[tuple[int, ...], int] = {}

    def add(
        self, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
    ) -> tuple[int, int]:
        """A node after those that feed it; its number, and its output's."""
        if node.type in ("TEX_IMAGE", "TEX_ENVIRONMENT") and missing(node):
            return self._put([self._absent(node, output)])
        if self._stand_in and (others := self._stand_in(node, output)):
            return self._put(others)
        key = (node.as_pointer(), *(group.as_pointer() for group in scope))
        if key in self._numbers:
            return self._numbers[key], _index(node.outputs, output)
        camera = node.type == "TEX_COORD" and output.name in UNSUITED_OUTPUTS
        of_layer = getattr(node, "attribute_type", "") == "VIEW_LAYER"
        if node.type in UNSUITED or camera or of_layer:
            raise Unsuited(f"'{node.name}' tells more than a direction")
        values: dict[int, Any] = {}
        links: dict[int, list[int]] = {}
        for index, socket in enumerate(node.inputs):
            feeding, end, inner = source(socket, scope)
            if feeding is not None:
                links[index] = [*self.add(feeding, end, inner)]
            elif others := self._fed_by(node, socket):
                links[index] = [*self._put(others)]
            elif hasattr(end, "default_value") and hasattr(socket, "default_value"):
                values[index] = _fitting(_plain(end.default_value), socket)
        described = {
            "kind": node.bl_idname,
            "properties": _properties(node, bpy.types.Node),
            "values": values,
            "told": _told_by(node),
            "links": links,
            "output": _index(node.outputs, output),
            **self._more(node),
        }
        self.nodes.append(described)
        self._numbers[key] = len(self.nodes) - 1
        return self._numbers[key], described["output"]

    def _absent(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> dict[str, Any]:
        """What is there in place of an image that is missing."""
        if self._tell:
            self._tell(node)
        if output.name == "Alpha":
            return made("ShaderNodeMath", values={0: 1.0, 1: 0.0}, operation="ADD")
        return made("ShaderNodeCombineXYZ", values=dict(enumerate(MAGENTA)))

    def _fed_by(
        self, node: bpy.types.Node, socket: bpy.types.NodeSocket
    ) -> list[dict[str, Any]] | None:
        """What stands in for nothing that feeds a texture's vector."""
        if self._stand_in and node.type.startswith("TEX_") and socket.name == "Vector":
            return self._stand_in(node, None)
        return None

    def _put(self, others: list[dict[str, Any]]) -> tuple[int, int]:
        """Nodes in place of others, as `add`."""
        first = len(self.nodes)
        for node in others:
            links = {index: [first + at, end] for index, (at, end) in node["links"].items()}
            self.nodes.append({**node, "links": links})
        return len(self.nodes) - 1, self.nodes[-1]["output"]

    def _more(self, node: bpy.types.Node) -> dict[str, Any]:
        more: dict[str, Any] = {}
        for name, property in node.bl_rna.properties.items():
            if name in bpy.types.Node.bl_rna.properties or property.type != "POINTER":
                continue
            value = getattr(node, name)
            if name == "color_ramp":
                more["ramp"] = _ramp(value)
            elif name == "mapping" and isinstance(value, bpy.types.CurveMapping):
                more["curves"] = _curves(value)
            elif name == "image" and value is not None:
                more["image"] = self._image(value, node)
            elif isinstance(value, bpy.types.ID) and not isinstance(value, bpy.types.NodeTree):
                raise Unsuited(f"'{node.name}' refers to '{value.name}'")
        return more

    def _image(self, image: bpy.types.Image, node: bpy.types.Node) -> dict[str, Any]:
        if image.source not in ("FILE", "GENERATED"):
            raise Unsuited(f"image '{image.name}' of '{node.name}' is moving or tiled")
        described = {"colours": image.colorspace_settings.name, "alpha": image.alpha_mode}
        self.widths.append(image.size[0])
        path = Path(image.filepath_from_user())
        is_file = image.source == "FILE" and not image.packed_file and not image.is_dirty
        if is_file and path.is_file():
            changed = path.stat().st_mtime_ns
            return {**described, "path": str(path.resolve()), "changed": changed}
        whole = rgba_floats(image)
        name = f"{hashlib.blake2b(whole.tobytes(), digest_size=16).hexdigest()}.npy"
        np.save(self._folder / name, whole)
        return {**described, "pixels": str(self._folder / name), "is_float": image.is_float}


def _properties(owner: Any, base: Any = None) -> dict[str, Any]:
    """The plain values of an RNA struct that its base does not have."""
    without = base.bl_rna.properties if base else ()
    return {
        name: _plain(getattr(owner, name))
        for name, property in owner.bl_rna.properties.items()
        if name not in without
        and not property.is_readonly
        and property.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING")
    }


def _told_by(node: bpy.types.Node) -> dict[int, Any]:
    """What a node without inputs of that kind has for its outputs."""
    if node.type not in HAVE_THEIR_OWN:
        return {}
    return {index: _plain(output.default_value) for index, output in enumerate(node.outputs[:1])}


def _ramp(ramp: bpy.types.ColorRamp) -> dict[str, Any]:
    names = ("color_mode", "interpolation", "hue_interpolation")
    elements = [[element.position, _plain(element.color)] for element in ramp.elements]
    return {**{name: getattr(ramp, name) for name in names}, "elements": elements}


def _curves(mapping: bpy.types.CurveMapping) -> dict[str, Any]:
    curves = [
        [[_plain(point.location), point.handle_type] for point in curve.points]
        for curve in mapping.curves
    ]
    return {"properties": _properties(mapping), "curves": curves}


def _plain(value: Any) -> Any:
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, set):  # of flags
        return sorted(value)
    return [float(item) for item in value]


def _fitting(value: Any, socket: bpy.types.NodeSocket) -> Any:
    """A group's value as the socket inside holds it."""
    wanted = _plain(socket.default_value)
    if isinstance(wanted, list):
        numbers = [*value] if isinstance(value, list) else [float(value)] * 3
        return [*numbers, 1.0][: len(wanted)]
    return sum(value[:3]) / 3.0 if isinstance(value, list) else value


def _index(sockets: Any, socket: bpy.types.NodeSocket) -> int:
    return next(index for index, each in enumerate(sockets) if each == socket)
