# SPDX-License-Identifier: GPL-3.0-or-later
"""Color Ramp, RGB, Vector and Float Curves: tables of as many rows as Cycles has."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..graph import Graph
from ..links import Scope
from ..programs import ONE, Table, Value, mix

ROWS = 257  # Cycles divides the range by 256


def read_ramp(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Color Ramp; the table holds alpha, too."""
    ramp = node.color_ramp
    rows = np.array([ramp.evaluate(i / (ROWS - 1))[:] for i in range(ROWS)], np.float64)
    smooth = Value.of(float(ramp.interpolation != "CONSTANT"))
    at = graph.value(node.inputs[0], scope)
    if at.is_constant and bpy.app.version >= (5, 0, 0):  # Blender folds it, as it is on stops, too
        found = Value.of(np.array(ramp.evaluate(at.number)[:], np.float64))
        return found.part("w") if output.name == "Alpha" else found
    found = graph.program.emit(
        "ramp", looked_up, at=at, rows=Table(rows), interpolates=smooth, extends=Value.of(0.0)
    )
    if rows.min() >= 0.0 and rows.max() <= 1.0:
        found = found.as_unit()
    return found.part("w") if output.name == "Alpha" else found


def read_curves(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read RGB or Vector Curves: of colours, the common curve and then the channel's."""
    factor, colour = (graph.value(socket, scope) for socket in node.inputs)
    is_rgb = node.type == "CURVE_RGB"
    low, high = domain(node.mapping, 4 if is_rgb else 3)
    node.mapping.initialize()
    curves, evaluate = node.mapping.curves, node.mapping.evaluate
    rows = np.ones((ROWS, 4))
    for row, at in zip(rows, np.linspace(low, high, ROWS), strict=True):
        common = evaluate(curves[3], at) if is_rgb else at
        row[:3] = [evaluate(curve, common) for curve in curves[:3]]
    found = graph.program.emit(
        "curves", looked_up_by_channel, at=(colour - low) / (high - low), **_table(node, rows)
    )
    return mix(colour, found, factor)


def read_float_curve(
    graph: Graph, node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> Value:
    """Read Float Curve."""
    factor, number = (graph.value(socket, scope) for socket in node.inputs)
    low, high = domain(node.mapping, 1)
    node.mapping.initialize()
    curve, evaluate = node.mapping.curves[0], node.mapping.evaluate
    numbers = [evaluate(curve, at) for at in np.linspace(low, high, ROWS)]
    rows = np.repeat(np.array(numbers)[:, None], 4, axis=1)
    at = (number - low) / (high - low)
    found = graph.program.emit("ramp", looked_up, at=at, interpolates=ONE, **_table(node, rows))
    return mix(number, found, factor)


def _table(node: bpy.types.Node, rows: NDArray[np.float64]) -> dict[str, Value | Table]:
    extends = Value.of(float(node.mapping.extend == "EXTRAPOLATED"))
    return {"rows": Table(rows), "extends": extends}


def domain(mapping: bpy.types.CurveMapping, count: int) -> tuple[float, float]:
    """Where the first so many of its curves have points: from the lowest x to the highest."""
    ends = [(curve.points[0].location.x, curve.points[-1].location.x) for curve in mapping.curves]
    low, high = min(a for a, _ in ends[:count]), max(b for _, b in ends[:count])
    return low, high


def looked_up(
    at: NDArray[np.float64], rows: NDArray[np.float64], how: NDArray[np.float64]
) -> NDArray[np.float64]:
    """As glsl/lib/rows.glsl, of a constant."""
    steps = len(rows) - 1
    f = float(np.clip(np.nan_to_num(at[0]), 0.0, 1.0)) * steps
    if how[0] <= 0.0:
        return rows[int(f)]
    i = min(int(f), steps - 1)
    if how[1] > 0.0 and abs(at[0] - 0.5) > 0.5:
        f = float(at[0]) * steps
    found: NDArray[np.float64] = rows[i] + (f - i) * (rows[i + 1] - rows[i])
    return found


def looked_up_by_channel(
    at: NDArray[np.float64], rows: NDArray[np.float64], extends: NDArray[np.float64]
) -> list[float]:
    """As glsl/nodes/curves.glsl, of a constant."""
    how = np.array((1.0, extends[0]))
    return [float(looked_up(at[i : i + 1], rows, how)[i]) for i in range(3)]
