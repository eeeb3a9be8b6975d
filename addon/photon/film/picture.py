# SPDX-License-Identifier: GPL-3.0-or-later
"""From the film's means to the images that Blender names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import in_blocks
from .film import Images

FILM_IMAGES = ("direct", "indirect", "background", "normal", "combined")
MIRROR_IMAGES = ("mirror", "mirror_indirect")  # only of scenes with mirrors or lobes
EMISSION_IMAGES = ("emission",)  # only of scenes with emitters that can be seen
PARTS = ("Direct", "Indirect", "Mirror", "Emission", "Background")
LEAST_COVERAGE = 0.02  # a mean below it is noise: dividing by it would make fireflies


def picture_of(means: Images) -> dict[str, NDArray[np.float32]]:
    """The images by Blender's names, float32, row 0 at the bottom.

    Combined (h, w, 4) premultiplied RGBA; PARTS and Normal (h, w, 3).
    Combined is the sum of the five light passes.
    """
    shape = means["direct"].shape[:2]
    images = {"Combined": np.empty((*shape, 4), np.float32)}
    images |= {name: np.empty((*shape, 3), np.float32) for name in (*PARTS, "Normal")}

    def work(rows: slice) -> None:
        for name, image in _rows_of({name: mean[rows] for name, mean in means.items()}).items():
            images[name][rows] = image

    in_blocks(shape, work)
    return images


def _rows_of(means: Images) -> dict[str, NDArray[np.float64]]:
    """As picture_of."""
    mirror, mirror_indirect = mirror_images(means)
    shape = (*means["direct"].shape[:2], 3)
    parts = {
        "Direct": means["direct"][..., :3],
        "Indirect": _uncovered(means["indirect"], means["direct"][..., 3:]),
        "Mirror": mirror[..., :3] + _uncovered(mirror_indirect, mirror[..., 3:]),
        "Emission": means["emission"][..., :3] if "emission" in means else np.zeros(shape),
        "Background": means["background"][..., :3],
    }
    alpha = np.clip(means["background"][..., 3:], 0.0, 1.0)
    combined = np.concatenate([sum(parts.values()), alpha], axis=-1)
    return {"Combined": combined, **parts, "Normal": means["normal"][..., :3]}


def mirror_images(means: Mapping[str, NDArray[Any]]) -> tuple[NDArray[Any], NDArray[Any]]:
    """MIRROR_IMAGES; zeros for a scene without mirrors."""
    none = np.zeros_like(means["direct"])
    return means.get("mirror", none), means.get("mirror_indirect", none)


def _uncovered(indirect: NDArray[np.float64], weight: Any) -> NDArray[np.float64]:
    """Mean indirect light over mean coverage (its alpha, of `weight`): without boundary bias."""
    coverage = np.maximum(indirect[..., 3:], LEAST_COVERAGE * weight)
    return np.divide(
        indirect[..., :3] * weight,
        coverage,
        where=coverage > 0,
        out=np.zeros_like(indirect[..., :3]),
    )
