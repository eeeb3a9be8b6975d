# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a scene that is rendered as several takes (scene/takes.py), of theirs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..scene.takes import Part, Take
from .picture import FEATURES

Image = NDArray[np.float32]
Images = Mapping[str, Image]  # picture_of's, and Error and Depth
Shot = tuple[Take, Images]
# Of the geometry alone, which all takes of a part share.
SHARED = {"Normal", "Depth", "Mist", *FEATURES}


def composite(
    shots: Sequence[Shot], groups: Sequence[str], is_transparent: bool
) -> dict[str, Image]:
    """The images of all shots together, and `Combined_` and its name of each light group (h, w, 3).

    Sums are of float32. Errors are taken for independent of each other.
    """
    first = shots[0][0].part
    images = _sum(shots, first)
    for group in groups:
        of_group = [shot for shot in shots if shot[0].part == first and shot[0].group == group]
        lit = _sum(of_group, first)["Combined"] if of_group else np.zeros_like(images["Combined"])
        images[group_name(group)] = lit[..., :3]
    return images if first == "all" else _caught(images, shots, is_transparent)


def group_name(group: str) -> str:
    """As Cycles names the pass of a light group."""
    return f"Combined_{group}"


def _sum(shots: Sequence[Shot], part: Part) -> dict[str, Image]:
    """Of a part's takes, their signs heeded."""
    wanted = [shot for shot in shots if shot[0].part == part]
    total = {name: image.copy() for name, image in wanted[0][1].items()}
    alpha = total["Combined"][..., 3:].copy()
    for name in total.keys() - SHARED - {"Error"}:
        total[name][:] = sum(np.float32(take.sign) * images[name] for take, images in wanted)
    total["Combined"][..., 3:] = alpha
    total["Error"] = np.sqrt(sum(np.square(images["Error"]) for _, images in wanted))
    return total


def _caught(
    images: dict[str, Image], shots: Sequence[Shot], is_transparent: bool
) -> dict[str, Image]:
    """What the eye sees of other things than catchers, before what those show: as in Cycles a black
    that is as opaque as they are darker than without the other things, in the mean of the channels;
    before a background that is not transparent as much less of it.

    What is brighter than without them is not shown.
    """
    caught, alone = _sum(shots, "caught"), _sum(shots, "alone")
    combined, there = images["Combined"], caught["Combined"][..., 3:]
    light, all_light = (each["Combined"][..., :3] for each in (caught, alone))
    one = np.ones_like(light)
    share = np.divide(light, all_light, where=all_light != 0.0, out=one.copy())
    opaque = combined[..., 3:]
    covered = np.minimum(opaque + there, 1.0) if is_transparent else np.float32(1.0)
    share = np.where(there > 0.0, covered * share + (1.0 - covered), one)
    left = np.clip(share.mean(axis=-1, keepdims=True), 0.0, 1.0)
    alpha = np.clip((1.0 - opaque) * (1.0 - left) + opaque, 0.0, 1.0)
    if is_transparent:
        combined[..., 3:] = alpha
    else:
        seen = _sum(shots, "behind")["Combined"][..., :3] * (1.0 - alpha)
        for name in {"Combined", "Background"} & images.keys():
            images[name][..., :3] += seen
        of_shadows = _error(caught, alone, share) * seen.mean(axis=-1, keepdims=True)
        images["Error"] = np.hypot(images["Error"], of_shadows)
        combined[..., 3:] = 1.0
    for name in (SHARED - {"Mist"}) & images.keys():
        images[name] = np.where(there > 0.0, caught[name], images[name])
    if "Mist" in images:  # each is as thick as before the background where it shows the other's
        images["Mist"] = np.clip(images["Mist"] + caught["Mist"] - 1.0, 0.0, 1.0)
    return images


def _error(caught: Images, alone: Images, share: Image) -> Image:
    """The relative error of the share of the light that is left, (h, w, 1); 0 while unknown."""
    if not np.isfinite(caught["Error"]).all():
        return np.zeros_like(caught["Error"])
    light = alone["Combined"][..., :3].mean(axis=-1, keepdims=True)
    left = share.mean(axis=-1, keepdims=True)
    both = np.hypot(caught["Error"], left * alone["Error"])
    found: Image = np.divide(both, light, where=light > 0.0, out=np.zeros_like(light))
    return np.minimum(found, np.float32(1.0))
