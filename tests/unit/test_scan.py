# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan and Program: prefix sums of any length."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from addon.streams import Device, Program, Scan, StreamError
from tests.unit.glsl_files import write


@pytest.fixture(autouse=True)
def _compute(device: Device) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")


@pytest.mark.parametrize("count", [1, 2, 1023, 1024, 1025, 1024 * 256 + 1, 1_000_000, 1_100_000])
def test_equals_numpy(device: Device, count: int) -> None:
    values = np.random.default_rng(count).integers(0, 1000, count + 7, dtype=np.uint32)
    buffer, scan = device.ctx.buffer(values.tobytes()), Scan(device)
    scan.run(buffer, count)
    sums = device.read(buffer, count + 7).view(np.uint32)
    expected = np.concatenate([[0], np.cumsum(values[: count - 1], dtype=np.uint32)])
    assert np.array_equal(sums[:count], expected)
    assert np.array_equal(sums[count:], values[count:])  # no business of ours
    scan.release()
    buffer.release()


def test_one_scan_for_many_lengths(device: Device) -> None:
    scan = Scan(device)
    for count in (5000, 3, 1024, 5000, 2048, 1):
        buffer = device.ctx.buffer(np.ones(count, np.uint32).tobytes())
        scan.run(buffer, count)
        assert np.array_equal(device.read(buffer, count).view(np.uint32), np.arange(count))
        buffer.release()
    scan.release()


def test_sums_wrap_like_unsigned_numbers(device: Device) -> None:
    values = np.full(3000, 0xC0000000, np.uint32)
    buffer, scan = device.ctx.buffer(values.tobytes()), Scan(device)
    scan.run(buffer, 3000)
    expected = (np.arange(3000, dtype=np.uint64) * 0xC0000000 % (1 << 32)).astype(np.uint32)
    assert np.array_equal(device.read(buffer, 3000).view(np.uint32), expected)


def test_program_error_names_its_line(device: Device, root: Path) -> None:
    write(root, "kernels/bad.glsl", "// one\nvoid main() {\n    nonsense = 1;\n}\n")
    with pytest.raises(StreamError, match=r"^bad: ") as raised:
        Program(device, "bad")._program.program  # which a driver's threads may still make
    device.errors.clear()  # test_device_works_after_a_refusal is about these
    assert re.search(r"kernels/bad\.glsl:3 ?:", str(raised.value))
