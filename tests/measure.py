# SPDX-License-Identifier: GPL-3.0-or-later
"""Render small scenes and compare region means with exact values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device

SEEDS = 16
# Student's t for a two-sided 95 % interval at 15 degrees of freedom (16 seeds).
T_95 = 2.131


def render(device: Device, scene: Scene, **settings: Any) -> dict[str, Any]:
    """The images of a scene as Renderer.images() names them."""
    settings = {
        "width": 32,
        "height": 32,
        "passes": 1,
        "photons": 20000,
        "radius_shrink": 1.0,
    } | settings
    renderer = Renderer(scene, Settings(**settings), device)
    try:
        for _ in range(renderer.settings.passes):
            renderer.render_pass()
        return renderer.images()
    finally:
        renderer.release()


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


__all__ = ["SEEDS", "over_seeds", "relative_bound", "render", "replace"]
