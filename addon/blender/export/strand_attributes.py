# SPDX-License-Identifier: GPL-3.0-or-later
"""Export what programs ask of hair and point clouds, as Cycles knows it."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from .attributes import as_number, padded
from .hair import colour_of_hair, uv_of_hair
from .hashes import WHOLE, hashed
from .nodes.attributes import COLOUR, FACTOR, GENERATED, NAMED, STRAND, UNDISPLACED, UV
from .strands import TYPES, Strands, read_numbers

Floats = NDArray[np.float64]


def strand_attribute(
    what: tuple[str, ...], strands: Strands, obj: bpy.types.Object
) -> NDArray[np.float32]:
    """An attribute of a kind at triangles' corners (T, 3, 4); 0 if there is none such."""
    found: Floats | None = None
    if what[0] == STRAND:
        found = _own(what[1], strands)
    elif what[0] == GENERATED:
        found = _generated(strands, obj)
    elif what[0] == UNDISPLACED:
        found = strands.vertices[strands.triangles].astype(np.float64)
    elif obj.type == "MESH":  # it has grown on it
        name = what[1] if len(what) > 1 else ""
        if what[0] == UV or (what[0] in (NAMED, FACTOR) and name in obj.data.uv_layers):
            uv = uv_of_hair(obj, name)
            found = None if uv is None else strands.of_curves(uv)
        elif what[0] in (NAMED, FACTOR, COLOUR):
            colour = colour_of_hair(obj, name)
            found = None if colour is None else strands.of_curves(colour)
    elif what[0] in (NAMED, FACTOR, COLOUR, UV):
        found = _named(what[1] or (_first_uv(obj) if what[0] == UV else ""), strands, obj)
    if found is not None and what[0] == FACTOR:
        found = as_number(found)
    if found is None and what[0] not in (NAMED, FACTOR, UV):
        return np.zeros((len(strands.triangles), 3, 4), np.float32)
    return padded(found, len(strands.triangles))


def _named(name: str, strands: Strands, obj: bpy.types.Object) -> Floats | None:
    attribute = obj.data.attributes.get(name)
    if attribute is None or attribute.data_type not in TYPES:
        return None
    of_value, width = TYPES[attribute.data_type]
    values = read_numbers(obj.data, name, of_value, len(attribute.data) * width).reshape(-1, width)
    match attribute.domain:
        case "POINT":
            return strands.along(values)
        case "CURVE":
            return strands.of_curves(values)
    return None


def _first_uv(obj: bpy.types.Object) -> str:
    """Curves have no UV maps: the first two numbers of each are taken for one."""
    of_curves = (x for x in obj.data.attributes if x.domain == "CURVE")
    return next((str(x.name) for x in of_curves if x.data_type == "FLOAT2"), "")


def _own(name: str, strands: Strands) -> Floats | None:
    """What Hair Info and Point Info tell."""
    firsts, points = strands.firsts, strands.points
    match name:
        case "Is Strand":
            return np.ones((len(strands.triangles), 3, 1))
        case "Thickness":
            return strands.along(2.0 * strands.radii[:, None])
        case "Radius":
            return strands.along(strands.radii[:, None])
        case "Position":
            return strands.of_curves(points[firsts[:-1]])
        case "Random":
            numbers = hashed(np.arange(len(firsts) - 1))
            return strands.of_curves(numbers[:, None] / WHOLE)
    ways = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    ways[firsts[:-1][np.diff(firsts) > 0]] = 0.0
    ends = np.concatenate([[0.0], ways.cumsum()])
    lengths = ends[firsts[1:]] - ends[firsts[:-1]]
    if name == "Length":
        return strands.of_curves(lengths[:, None])
    if name == "Intercept":
        owner = np.repeat(np.arange(len(lengths)), np.diff(firsts))
        way = ends[1:] - ends[firsts[:-1]][owner]
        shares = np.divide(way, lengths[owner], out=np.zeros_like(way), where=way > 0.0)
        return strands.along(shares[:, None])
    return None


def _generated(strands: Strands, obj: bpy.types.Object) -> Floats:
    """Of hair that has grown on a mesh by its root, by Cycles' formula; else the place itself."""
    if obj.type != "MESH":
        return strands.vertices[strands.triangles].astype(np.float64)
    size = np.array(obj.data.texspace_size, np.float64)
    middle = np.array(obj.data.texspace_location, np.float64)
    scale = np.divide(0.5, size, out=np.zeros_like(size), where=size != 0.0)
    roots = strands.points[strands.firsts[:-1]]
    return strands.of_curves(roots * scale - (middle * scale - 0.5))
