# SPDX-License-Identifier: GPL-3.0-or-later
"""The radii by compute programs, where photons stay on the device: native/src/radius.rs there.

An H200's host took 12 ms for them by 131072 photons, and 26 by 524288 (cornell_classic, 512x512);
this takes 1.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..streams import TABLE_WIDTH, Device, Program
from .deposits import Deposits, step_of

AXES = range(3)
SAMPLE = 1 << 14  # as many of the photons tell where nearly all lie, and their median radius


class Limits(NamedTuple):
    """How radii are to be: native/src/radius.rs, Wanted."""

    photons: float
    times: float
    most: float
    pixel: float
    eye: Sequence[float] | None


class DeviceRadii(NamedTuple):
    """What RadiusField tells, see there."""

    table: moderngl.Texture  # as glsl/lib/radius.glsl reads it
    typical: float
    largest: float


def radii_on_device(
    device: Device, deposits: Deposits, grids: NDArray[np.float32], limits: Limits
) -> DeviceRadii:
    """The radii by deposits that are on the device; `grids` (6, 16) as of native.radius_grids."""
    count, place, deposit = deposits.tables()
    cells = grids[:, 4:7].astype(int)
    nodes, corners = cells + 1, 2 * cells + 1
    texels = (grids.size + int(nodes.prod(axis=1).sum())) / 4
    rows = -(-int(texels) // TABLE_WIDTH) + 1
    counted = int(corners.prod(axis=1).sum())
    sums, told = device.buffer(4 * counted), device.buffer(4 * (1 + SAMPLE))
    radii = device.buffer(16 * TABLE_WIDTH * rows)
    photons = {"place": place, "deposit": deposit}
    over: dict[str, Any] = {"grids": [tuple(map(float, row)) for row in grids.reshape(-1, 4)]}

    def run(stem: str, buffers: Sequence[Any], a_side: Any, **uniforms: Any) -> None:
        most = int(a_side.max())
        program = Program(device, stem)
        program.run(6 * most, buffers, uniforms=over | uniforms | {"most_a_side": most})

    zero = Program(device, "fill_zero")
    zero.run(counted, [sums])
    zero.run(1, [told])
    Program(device, "radius_count").run(count, [sums], photons, uniforms=over | {"most_a_side": 0})
    for axis in AXES:
        run("radius_sum", [sums], corners.prod(axis=1) // corners[:, axis], axis=axis)
    eye = (*map(float, limits.eye), 1.0) if limits.eye is not None else (0.0,) * 4
    limited = limits._asdict() | {"eye": eye}
    run("radius_find", [sums, radii], nodes.prod(axis=1), **limited)
    for axis in AXES:
        run("radius_flatten", [radii], nodes.prod(axis=1) // nodes[:, axis], axis=axis)
    table: moderngl.Texture = device.texture((TABLE_WIDTH, rows), 4)
    table.write(radii)
    step, inner = step_of(count, SAMPLE), int(nodes.prod(axis=1).sum())
    samples = -(-count // step)
    Program(device, "radius_tell").run(
        max(inner, samples),
        [told],
        photons | {"radii": table},
        uniforms={"shrink": 1.0, "samples": samples, "step": step, "nodes": inner},
    )
    data = np.frombuffer(told.read(4 * (1 + samples)), np.float32)
    for buffer in (sums, radii, told):
        device.put_back(buffer)
    largest = float(data[0])
    typical = float(np.partition(data[1:], samples // 2)[samples // 2]) if samples else largest
    return DeviceRadii(table, typical, largest)
