# SPDX-License-Identifier: GPL-3.0-or-later
"""Where things touch, light falls to a tenth within a radius: error that is blur, not noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.bench.chart.measure import squared_errors
from tests.bench.chart.scenes import SIZE, Reference, read_reference
from tests.stability.table import Measured

from .cycles import open_blend

pytestmark = pytest.mark.blender

NAME = "cornell_classic"
WORST, BLOCK = 20, 8  # blocks, and a block's pixels a side
LEAST, SLOWER = 0.4, 0.1  # powers of the passes: with which error falls, and less than elsewhere


def block_errors(
    device: Device, scene: Scene, reference: Reference, seed: int, counts: Sequence[int]
) -> list[Any]:
    """Strict squared errors of blocks after so many passes."""
    settings = Settings(width=SIZE, height=SIZE, seed=seed, passes=counts[-1])
    renderer, found = prepare(scene, settings, device), []
    n = SIZE // BLOCK
    try:
        for done in range(1, counts[-1] + 1):
            renderer.render_pass()
            if done in counts:
                picture = renderer.images(["Combined"])["Combined"][..., :3]
                errors = squared_errors(picture, reference)
                found.append(errors.reshape(n, BLOCK, n, BLOCK).mean(axis=(1, 3)).ravel())
    finally:
        renderer.release()
    return found


@pytest.mark.stability(75)
@pytest.mark.thorough
def test_error_falls_as_fast_as_elsewhere(device: Device, measured: Measured) -> None:
    """From 16 to 64 passes. Another seed tells which blocks are the worst: the boxes' feet."""
    scene, reference = open_blend(NAME, SIZE), read_reference(NAME)
    (other,) = block_errors(device, scene, reference, 1, [16])
    worst = np.zeros(other.shape, bool)
    worst[np.argsort(other)[-WORST:]] = True
    few, many = block_errors(device, scene, reference, 2, [16, 64])
    there, elsewhere = (
        math.log(few[blocks].mean() / many[blocks].mean(), 4) for blocks in (worst, ~worst)
    )
    measured(
        "share of the squared error after 64 passes there", many[worst].sum() / many.sum(), "%"
    )
    measured("power of the passes elsewhere", elsewhere)
    assert measured("there", there) > LEAST
    if elsewhere - there > SLOWER:
        measured.falls_short("blur at the boxes' feet shrinks with the radius, noise faster")
