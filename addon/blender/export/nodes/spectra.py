# SPDX-License-Identifier: GPL-3.0-or-later
"""Blackbody and Wavelength: colours of light."""

from __future__ import annotations

import re
from functools import lru_cache

import bpy
import numpy as np
from numpy.typing import NDArray

from ....streams import source
from ..blackbody import blackbody
from ..graph import Graph
from ..links import Scope
from ..programs import Value, math
from ..working_space import REC_709, from_rec709, working_space
from .mapping import transformed

WAVELENGTH = "nodes/wavelength.glsl"
_TRIPLE = re.compile(r"vec3\(([\d.]+), ([\d.]+), ([\d.]+)\)")
TO_RGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


def read_blackbody(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Blackbody."""
    return colour_of(graph, graph.input(node, "Temperature", scope))


def colour_of(graph: Graph, temperature: Value) -> Value:
    """Of a black body [K], of a luminance of about 1."""
    found = graph.program.emit(
        "blackbody", lambda kelvin: blackbody(kelvin[0]), temperature=temperature
    )
    return found if working_space() == REC_709 else _of_rec709(graph, found)


def read_wavelength(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Wavelength."""
    wavelength = graph.input(node, "Wavelength", scope)
    found = graph.program.emit("wavelength", _colour_of_wavelength, wavelength=wavelength)
    return _of_rec709(graph, found)


def _of_rec709(graph: Graph, colour: Value) -> Value:
    """A colour of linear Rec.709 as one of the file's, not below 0."""
    if working_space() != REC_709:
        rows = np.column_stack([from_rec709(), np.zeros(3)])
        colour = transformed(graph, colour, rows)
    return math("MAXIMUM", colour, 0.0)


@lru_cache(maxsize=1)
def _matching_functions() -> NDArray[np.float64]:
    """(81, 3), as the node's file has them."""
    found = _TRIPLE.findall(source.read(WAVELENGTH, __name__))
    return np.array(found, np.float64)


def _colour_of_wavelength(nanometres: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,), as nodes/wavelength.glsl."""
    table = _matching_functions()
    at = (nanometres[0] - 380.0) / 5.0
    steps = np.arange(len(table))
    xyz = [np.interp(at, steps, column, left=0.0, right=0.0) for column in table.T]
    return np.asarray(TO_RGB @ xyz / 2.52)
