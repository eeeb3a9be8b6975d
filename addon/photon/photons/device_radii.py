# SPDX-License-Identifier: GPL-3.0-or-later
"""The radii by compute programs, where photons stay on the device: native/src/radius there.

A host takes many passes' time for them. It waits here for the boxes that photons lie in alone, to
know how large the grids are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Device, Program, Reading, Table
from ...streams.compute import clear
from ...streams.declaration import declare_tables
from ..kernels.records import RADIUS_GRID
from .deposits import Deposits

AXES = range(3)
SIDES = 6
# As in native/src/radius/grids.rs: photons that tell the box about most of all, and the share that
# lies beyond it on either side of each axis.
ENOUGH, OUTSIDE = 1 << 12, 0.005
# Corners along an axis, at most: of 510 cells, two to spare and one by rounding, all halved.
LONGEST = 2 * 513 + 1
THREADS = 64  # that share a line along x
_ROWS = f"const int THREADS = {THREADS}, MOST_A_THREAD = {-(-LONGEST // THREADS)};"
_GRID = RADIUS_GRID.glsl()
DECLARATIONS = {  # what programs are compiled with
    "radius_box": f"const int MOST_SAMPLED = {ENOUGH};",
    **dict.fromkeys(("radius_count", "radius_sum", "radius_find", "radius_flatten"), _GRID),
    **dict.fromkeys(("radius_sum_rows", "radius_flatten_rows"), _GRID + _ROWS),
    "radius_summary": "\n".join([_GRID, *declare_tables({"radii": Table(RADIUS_GRID)})]),
}
# Gives the grids of native.radius_grids, and the area of the box about them.
Grids = Callable[[], tuple[NDArray[np.float32], float]]
Box = NDArray[np.float32]  # (2, 3) its lowest and its highest corner
SAMPLED = 2047  # photons that tell the median radius: tests hold it to 2 % of all photons'


class Limits(NamedTuple):
    """How radii are to be: native/src/radius/find.rs, Wanted."""

    photons: float
    times: float
    most: float
    pixel: float
    eye: Sequence[float] | None


class DeviceRadii:
    """Radii of which the host knows little, and that late."""

    def __init__(self, device: Device, table: moderngl.Texture, reading: Reading) -> None:
        """`table`: as glsl/lib/radius.glsl reads it; `reading`: the largest, and those at some of
        the photons: bits of float32."""
        self._device, self.on_device, self._reading = device, table, reading

    def summary(self) -> tuple[float, float]:
        """As Found's (waits for the device)."""
        radii = np.frombuffer(self._reading.data(), np.float32)
        largest, middle = float(radii[0]), (len(radii) - 1) // 2
        if len(radii) == 1:
            return largest, largest
        return float(np.partition(radii[1:], middle)[middle]), largest

    @cached_property
    def on_host(self) -> native.RadiusField:
        """As Found's."""
        return native.RadiusField.of_table(self._device.texels(self.on_device), self.summary()[0])

    def release(self) -> None:
        """As Found's."""
        self._device.put_back(self.on_device)


def step_of(count: int, most: int) -> int:
    """From one of a sample of `most` of `count` to the next."""
    return max(1, -(-count // most))


def grids_on_device(
    device: Device, deposits: Deposits, most: int, focus: Box | None = None
) -> Grids:
    """As native.radius_grids by `most` of the deposits on the device, which are not none: asked for
    at once, and waited for when called. They end where a box does, if there is one."""
    count, place, deposit = deposits.tables()
    step = step_of(count, most)
    samples = -(-count // step)
    every = step_of(samples, ENOUGH)
    enough = -(-samples // every)
    buffer = device.buffer(4 * (1 + SIDES) * SIDES)
    _program(device, "radius_box").run(
        enough,
        [buffer],
        {"place": place},
        uniforms={"step": every * step, "beyond": int(enough * OUTSIDE)},
        groups=SIDES,
    )
    photons = {"place": place, "deposit": deposit}
    _program(device, "radius_sides").run(samples, [buffer], photons, uniforms={"step": step})
    reading = device.ask(buffer, (1 + SIDES) * SIDES)
    device.put_back(buffer)

    def grids() -> tuple[NDArray[np.float32], float]:
        faces = np.frombuffer(reading.data(), np.uint32).reshape(1 + SIDES, 2 * len(AXES))
        return native.radius_grids_about(faces if focus is None else _within(faces, focus))

    return grids


def _within(faces: NDArray[np.uint32], focus: Box) -> NDArray[np.uint32]:
    """The parts of boxes that lie in another, as photon_boxes.glsl has boxes."""
    low, high = np.hsplit(faces, 2)
    return np.concatenate(
        [np.minimum(low, ~_ordered(focus[0])), np.minimum(high, _ordered(focus[1]))], axis=1
    )


def _ordered(numbers: NDArray[np.float32]) -> NDArray[np.uint32]:
    """As glsl/lib/ordered.glsl."""
    bits = np.ascontiguousarray(numbers, np.float32).view(np.uint32)
    return np.where(bits >> 31 == 1, ~bits, bits | np.uint32(1 << 31))


def _program(device: Device, stem: str) -> Program:
    return Program(device, stem, DECLARATIONS.get(stem, ""))


def most_lines(sides: Sequence[Sequence[int]], axis: int) -> int:
    """Along an axis, of the side that has the most."""
    return max(math.prod(n) // n[axis] for n in sides)


def radii_on_device(
    device: Device,
    deposits: Deposits,
    grids: NDArray[np.float32],
    limits: Limits,
    shares_lines: bool,
) -> DeviceRadii:
    """The radii by deposits that are on the device; `grids` (6, 16) are of RADIUS_GRID. With
    `shares_lines` threads go along lines together, where waiting for each other costs little."""
    count, place, deposit = deposits.tables()
    photons = {"place": place, "deposit": deposit}
    sides = grids.view(RADIUS_GRID.dtype)["cells"][:, 0].tolist()
    cells = [[int(n) for n in side] for side in sides]  # numpy is slow at so few
    nodes, corners = ([[k * n + 1 for n in side] for side in cells] for k in (1, 2))
    assert max(map(max, corners)) <= LONGEST
    all_nodes, all_corners = (sum(map(math.prod, sides)) for sides in (nodes, corners))
    rows = -(-(grids.size + all_nodes) // (4 * TABLE_WIDTH))
    step = step_of(count, SAMPLED)
    samples = -(-count // step)
    sums, summary = device.buffer(4 * all_corners), device.buffer(4 * (1 + samples))
    radii = device.buffer(16 * TABLE_WIDTH * rows)
    where: dict[str, Any] = {"grids": grids.tobytes()}

    def run(stem: str, buffers: Sequence[Any], a_side: int, each: int = 1, **uniforms: Any) -> None:
        """With `each` threads for so many elements of each side."""
        uniforms |= where | {"most_a_side": a_side}
        _program(device, stem).run(SIDES * a_side * each, buffers, uniforms=uniforms)

    def along(axis: int, stem: str, buffer: Any, sides: Sequence[Sequence[int]]) -> None:
        """One of the two programs that do a thing along lines."""
        if axis == 0 and shares_lines:
            run(f"{stem}_rows", [buffer], most_lines(sides, axis), THREADS)
        else:
            run(stem, [buffer], most_lines(sides, axis), axis=axis)

    clear(device, sums, all_corners)
    clear(device, summary, 1)
    _program(device, "radius_count").run(
        count, [sums], photons, uniforms=where | {"most_a_side": 0}
    )
    for axis in AXES:
        along(axis, "radius_sum", sums, corners)
    eye = (*limits.eye, 1.0) if limits.eye is not None else (0.0,) * 4
    most_nodes = max(map(math.prod, nodes))
    run("radius_find", [sums, radii], most_nodes, **limits._asdict() | {"eye": eye})
    for axis in AXES:
        along(axis, "radius_flatten", radii, nodes)
    table: moderngl.Texture = device.texture((TABLE_WIDTH, rows), 4)
    device.write(table, radii)
    _program(device, "radius_summary").run(
        max(all_nodes, samples),
        [summary],
        photons | {"radii": table},
        uniforms={"samples": samples, "step": step, "radius_scale": 1.0}
        | {"first_node": grids.size, "nodes": all_nodes},
    )
    reading = device.ask(summary, 1 + samples)
    for buffer in (sums, radii, summary):
        device.put_back(buffer)
    return DeviceRadii(device, table, reading)
