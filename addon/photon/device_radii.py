# SPDX-License-Identifier: GPL-3.0-or-later
"""The radii by compute programs, where photons stay on the device: native/src/radius.rs there.

An H200's host took 12 ms for them by 131072 photons, and 26 by 524288 (cornell_classic, 512x512);
these programs take 0.4, and as long to launch.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..streams import TABLE_WIDTH, Device, Program, Reading
from .deposits import Deposits, step_of

AXES = range(3)
TELLING = 2047  # photons that tell the median radius: tests hold it to 2 % of all photons'


class Limits(NamedTuple):
    """How radii are to be: native/src/radius.rs, Wanted."""

    photons: float
    times: float
    most: float
    pixel: float
    eye: Sequence[float] | None


class DeviceRadii(NamedTuple):
    """Radii of which the host knows little, and that late."""

    table: moderngl.Texture  # as glsl/lib/radius.glsl reads it
    telling: Reading  # the largest, and those at some of the photons: bits of float32

    def told(self) -> tuple[float, float]:
        """The median over the photons, and the largest (waits for the device)."""
        radii = np.frombuffer(self.telling.data(), np.float32)
        largest, some = float(radii[0]), np.sort(radii[1:])
        return float(some[len(some) // 2]) if len(some) else largest, largest


def radii_on_device(
    device: Device, deposits: Deposits, grids: NDArray[np.float32], limits: Limits
) -> DeviceRadii:
    """The radii by deposits that are on the device; `grids` (6, 16) as of native.radius_grids."""
    count, place, deposit = deposits.tables()
    photons = {"place": place, "deposit": deposit}
    cells = grids[:, 4:7].astype(int)
    nodes, corners = cells + 1, 2 * cells + 1
    nodes_a_side, corners_a_side = nodes.prod(axis=1), corners.prod(axis=1)
    all_nodes, all_corners = int(nodes_a_side.sum()), int(corners_a_side.sum())
    rows = -(-(grids.size + all_nodes) // (4 * TABLE_WIDTH))
    step = step_of(count, TELLING)
    samples = -(-count // step)
    sums, told = device.buffer(4 * all_corners), device.buffer(4 * (1 + samples))
    radii = device.buffer(16 * TABLE_WIDTH * rows)
    where: dict[str, Any] = {"grids": [tuple(map(float, row)) for row in grids.reshape(-1, 4)]}

    def run(stem: str, buffers: Sequence[Any], a_side: Any, **uniforms: Any) -> None:
        """With threads for as many elements of each side as the largest has."""
        most = int(a_side.max())
        uniforms |= where | {"most_a_side": most}
        Program(device, stem).run(len(grids) * most, buffers, uniforms=uniforms)

    zero = Program(device, "fill_zero")
    zero.run(all_corners, [sums])
    zero.run(1, [told])
    Program(device, "radius_count").run(count, [sums], photons, uniforms=where | {"most_a_side": 0})
    for axis in AXES:
        run("radius_sum", [sums], corners_a_side // corners[:, axis], axis=axis)
    eye = (*limits.eye, 1.0) if limits.eye is not None else (0.0,) * 4
    run("radius_find", [sums, radii], nodes_a_side, **limits._asdict() | {"eye": eye})
    for axis in AXES:
        run("radius_flatten", [radii], nodes_a_side // nodes[:, axis], axis=axis)
    table: moderngl.Texture = device.texture((TABLE_WIDTH, rows), 4)
    table.write(radii)
    Program(device, "radius_tell").run(
        max(all_nodes, samples),
        [told],
        photons | {"radii": table},
        uniforms={"samples": samples, "step": step, "shrink": 1.0}
        | {"first_node": grids.size, "nodes": all_nodes},
    )
    telling = device.ask(told, 1 + samples)
    for buffer in (sums, radii, told):
        device.put_back(buffer)
    return DeviceRadii(table, telling)
