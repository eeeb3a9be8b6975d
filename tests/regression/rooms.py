# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms against runs of Cycles, by the means of blocks, with no factor between the two."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from addon.photon.scene import Scene
from addon.streams import Device
from tests.measure import render
from tests.stability.table import Measured

from .blocks import Difference, Mask, block_means, compare_means
from .make_glossy_references import noise

MEDIAN, HIGH = 0.01, 0.03  # relative, of blocks; HIGH at their 95th percentile
PHOTONS = 65536


def compare_room(
    device: Device, scene: Scene, reference: Any, size: int, passes: int, keep: Mask | None = None
) -> Difference:
    """Between a picture of so many passes and block means of Cycles', all of them or some."""
    images = render(
        device,
        scene,
        width=size,
        height=size,
        passes=passes,
        photons=PHOTONS,
        radius_decay=2 / 3,
        mirror_depth=32,
    )
    keep = np.ones(reference.shape[:2], bool) if keep is None else keep
    return compare_means(block_means(images["Combined"][..., :3]), reference, keep)


def assert_alike(name: str, found: Difference, measured: Measured) -> None:
    print(f"\n{name}: median {found.median:.2%}, 95th {found.high:.2%}, mean {found.bias:.2%}")
    assert measured("blocks against Cycles' in the median", found.median, "%") <= MEDIAN
    assert measured("at the 95th percentile", found.high, "%") <= HIGH
    assert abs(found.bias) <= MEDIAN / 2


def assert_quiet(runs: Mapping[str, Any], names: Collection[str]) -> None:
    """Runs of Cycles tell the noise of their mean: a third of what is asked of us at most."""
    assert set(runs) == set(names)
    for name, values in runs.items():
        found = noise(values)
        high = np.percentile(found, 95)
        print(f"\n{name}: {len(values)} runs, {np.median(found):.2%}, {high:.2%}")
        assert len(values) >= 4 and np.isfinite(found).all()
        assert np.median(found) <= MEDIAN / 3
        assert high <= HIGH / 3
