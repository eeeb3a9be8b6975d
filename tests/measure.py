# SPDX-License-Identifier: GPL-3.0-or-later
"""Render small scenes and compare region means with exact values."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device

SEEDS = 16
# Student's t for a two-sided 95 % interval at 15 degrees of freedom (16 seeds).
T_95 = 2.131
# Settings with which eye rays go through pixels' middles alone.
MIDDLES: dict[str, Any] = {"pixel_filter": "gauss", "pixel_width": 0.0}


@contextmanager
def rendered(device: Device, scene: Scene, **settings: Any) -> Iterator[Renderer]:
    """A renderer that has rendered its passes; released in the end."""
    settings = {
        "width": 32,
        "height": 32,
        "passes": 1,
        "photons": 20000,
        "radius_decay": 1.0,
    } | settings
    renderer = prepare(scene, Settings(**settings), device)
    try:
        while left := renderer.settings.passes - renderer.film.passes:
            renderer.render_passes(left)
        yield renderer
    finally:
        renderer.release()


def render(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    """The images of a scene as Renderer.images() names them."""
    with rendered(device, scene, **settings) as renderer:
        return renderer.images()


def assert_same(found: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    """All of some images are to the bit what they are among others."""
    for name, image in expected.items():
        np.testing.assert_array_equal(found[name], image, err_msg=name)


def not_finite(images: dict[str, Any]) -> int:
    """How many values are not finite; the error is infinite before eight passes, and may be."""
    bad = sum(np.count_nonzero(~np.isfinite(x)) for name, x in images.items() if name != "Error")
    return int(bad + np.count_nonzero(np.isnan(images["Error"])))


def render_clean(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    """The same, and every value of them finite and none of the light negative."""
    images = render(device, scene, **settings)
    device.check()
    assert not_finite(images) == 0 and (images["Error"] >= 0).all()
    assert all(images[name].min() >= 0 for name in ("Combined", "Direct", "Indirect", "Mirror"))
    return images


def fallen(renderer: Renderer) -> Any:
    """The flux [W] that a renderer's last pass deposited on each surface, (surfaces, 3)."""
    assert renderer.photons
    place, deposit = renderer.photons.mapper.deposits.arrays()
    surface = np.abs(place[:, 3]).astype(int) - 1
    count = len(renderer.scene.surfaces)
    flux = [np.bincount(surface, deposit[:, channel], count) for channel in range(3)]
    return np.stack(flux, -1) * renderer.frame.scale**2


def over_seeds(
    device: Device, scene: Scene, measure: Callable[[dict[str, Any]], Any], **settings: Any
) -> Any:
    """`measure` of the images for each of SEEDS seeds, stacked."""
    return np.array(
        [measure(render(device, scene, seed=seed, **settings)) for seed in range(SEEDS)]
    )


def relative_bound(values: Any, reference: Any) -> float:
    """The largest (|mean - reference| + t SE) / |reference|: noise fails an equivalence test."""
    values = np.asarray(values, float).reshape(SEEDS, -1)
    reference = np.asarray(reference, float).ravel()
    error = np.abs(values.mean(axis=0) - reference)
    standard_error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    return float(((error + T_95 * standard_error) / np.abs(reference)).max())


__all__ = [
    "SEEDS",
    "fallen",
    "over_seeds",
    "relative_bound",
    "render",
    "render_clean",
    "rendered",
    "replace",
]
