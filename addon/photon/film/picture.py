# SPDX-License-Identifier: GPL-3.0-or-later
"""From the film's means to the images that Blender names."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blocks import in_blocks
from .film import Images, Statistics

FILM_IMAGES = ("direct", "indirect", "background", "normal", "combined")
MIRROR_IMAGES = ("mirror", "mirror_indirect")  # only of scenes with mirrors or lobes
EMISSION_IMAGES = ("emission",)  # only of scenes with emitters that can be seen
ILLUMINANCE_IMAGES = ("illuminance",)  # where it is asked for
MIST_IMAGES = ("mist",)  # the same; its alphas are what mist leaves
CAUSTIC_IMAGES = ("caustics", "mirror_caustics")  # where they are asked for; in mirrors
FEATURE_IMAGES = ("albedo", "normal_shown")  # of what denoisers go by, where they are asked for
# Of what a picture is made from, where it is denoised: half of the passes apart.
HALVED_IMAGES = ("combined", "indirect", "mirror_indirect")
# And those of the whole film by whose coverage halves are divided.
OF_HALVES = ("direct", "indirect", *MIRROR_IMAGES)
PARTS = ("Direct", "Indirect", "Mirror", "Emission", "Background")
FEATURES = {"Denoising Albedo": "albedo", "Denoising Normal": "normal_shown"}  # by Cycles' names
# That are there if the film has these.
OPTIONAL = {
    "Illuminance": "illuminance",
    "Mist": "mist",
    "Caustics": "caustics",
    **FEATURES,
}
CHANNELS = {
    "Combined": 4,
    **dict.fromkeys((*PARTS, "Caustics", "Normal", *FEATURES), 3),
    "Illuminance": 1,
    "Mist": 1,
}
# Film images that all pictures are made of, as far as there are any, and what else those named are.
OF_ALL = ("direct", "indirect", "background", *MIRROR_IMAGES, *EMISSION_IMAGES, "combined", "blur")
MADE_OF = {"Normal": "normal", "Illuminance": "illuminance", "Mist": "mist", **FEATURES}
LEAST_COVERAGE = 0.1  # a mean below it is mostly noise: dividing by it would make fireflies


def images_for(wanted: Collection[str]) -> frozenset[str]:
    """The film's images that a picture with `wanted`, and its error, are made of."""
    own = {image for name, image in MADE_OF.items() if name in wanted}
    return frozenset((*OF_ALL, *own, *(CAUSTIC_IMAGES if "Caustics" in wanted else ())))


def picture_of(
    means: Images, wanted: Collection[str] = tuple(CHANNELS)
) -> dict[str, NDArray[np.float32]]:
    """The images by Blender's names, those of `wanted`, float32, row 0 at the bottom.

    Combined (h, w, 4) premultiplied RGBA; PARTS and Normal (h, w, 3);
    Illuminance (h, w, 1) [lx], if it is there, of diffuse surfaces that the eye sees directly;
    Mist (h, w, 1), if it is, from 0 where there is none to 1, as before the background;
    Caustics (h, w, 3), if they are, the part of Combined that photons brought by way of lobes that
    are not diffuse; FEATURES (h, w, 3), if they are, of the first that is no mirror.
    Combined is the sum of the five light passes.
    """
    shape = means["direct"].shape[:2]
    images = {
        name: np.empty((*shape, channels), np.float32)
        for name, channels in CHANNELS.items()
        if name in wanted and (name not in OPTIONAL or OPTIONAL[name] in means)
    }

    def work(rows: slice) -> None:
        made = _rows_of({name: mean[rows] for name, mean in means.items()}, images.keys())
        for name, image in images.items():
            image[rows] = made[name]

    in_blocks(shape, work)
    return images


def exposed(
    images: Mapping[str, NDArray[np.float32]], exposure: float
) -> dict[str, NDArray[np.float32]]:
    """Images with their light multiplied: not Normal, nor alpha."""
    made = dict(images)
    for name in {"Combined", *PARTS, "Caustics", "Error"} & images.keys():
        made[name] = images[name].copy()
        made[name][..., :3] *= np.float32(exposure)
    return made


def _rows_of(means: Images, wanted: Collection[str]) -> dict[str, NDArray[np.float64]]:
    """As picture_of: of the images that are not Combined, those that are wanted."""
    direct, background = means["direct"], means["background"]
    parts = {
        "Direct": direct[..., :3],
        "Indirect": _uncovered(means["indirect"], direct[..., 3:]),
        "Background": background[..., :3],
    }
    if "mirror" in means:
        mirror, indirect = means["mirror"], means["mirror_indirect"]
        parts["Mirror"] = mirror[..., :3] + _uncovered(indirect, mirror[..., 3:])
    if "emission" in means:
        parts["Emission"] = means["emission"][..., :3]
    combined = np.empty_like(direct)
    # In this order, whichever there are: floats do not add up in any.
    first, *others = (parts[name] for name in PARTS if name in parts)
    np.add(first, others[0], out=combined[..., :3])
    for part in others[1:]:
        combined[..., :3] += part
    np.clip(background[..., 3], 0.0, 1.0, out=combined[..., 3])
    images = {"Combined": combined, **parts}
    if "Normal" in wanted:
        images["Normal"] = means["normal"][..., :3]
    images |= {
        name: np.zeros_like(direct[..., :3]) for name in PARTS if name in wanted - parts.keys()
    }
    if "Illuminance" in wanted and "illuminance" in means:
        images["Illuminance"] = illuminance_of(means["illuminance"])
    if "Mist" in wanted and "mist" in means:
        images["Mist"] = mist_of(means["mist"])
    if "Caustics" in wanted and "caustics" in means:
        images["Caustics"] = caustics_of(means)
    for name, mean in FEATURES.items():
        if mean in means:
            images[name] = means[mean][..., :3]
    return images


def halved_images(names: Collection[str], noisy_emission: bool) -> list[str]:
    """Those of a film's images of which half of the passes is kept apart, where it is denoised.
    Emission is among them, to be taken off before, unless it is noisy: a denoiser smears a bright
    lamp over what is dark beside it."""
    halved = HALVED_IMAGES if noisy_emission else (*HALVED_IMAGES, *EMISSION_IMAGES)
    return [name for name in halved if name in names]


def first_half(statistics: Statistics) -> NDArray[np.float32]:
    """Combined (h, w, 3) of the passes of the first half, with the whole's coverage: quotients of
    halves would not average to the quotient of the whole. Without emission, if that is halved."""
    means, halves = statistics.means, statistics.halves
    light = halves["combined"][..., :3]
    if "emission" in halves:
        light = light - halves["emission"][..., :3]
    made = light.astype(np.float32)
    weights = {"indirect": means["direct"][..., 3:], "mirror_indirect": mirror_images(means)[0]}

    def work(rows: slice) -> None:
        for name in (each for each in weights if each in halves):  # sets have an order a process
            weight = weights[name][rows, :, -1:]
            covered = np.maximum(means[name][rows, :, 3:], LEAST_COVERAGE * weight)
            times = np.divide(weight, covered, where=covered > 0, out=np.ones_like(weight))
            made[rows] += halves[name][rows, :, :3] * (times - 1.0)

    in_blocks(made.shape, work)
    return made


def caustics_of(means: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
    """(h, w, 3) of CAUSTIC_IMAGES: as much of indirect light, over the same coverage."""
    mirror, mirror_indirect = mirror_images(means)
    covers = means["direct"][..., 3:], mirror[..., 3:]
    found = np.zeros((*mirror.shape[:2], 3))
    for name, whole, weight in zip(
        CAUSTIC_IMAGES, (means["indirect"], mirror_indirect), covers, strict=True
    ):
        if name in means:
            part = np.concatenate([means[name][..., :3], whole[..., 3:]], axis=-1)
            found += _uncovered(part, weight)
    return found


def illuminance_of(mean: NDArray[Any]) -> NDArray[Any]:
    """(h, w, 1) [lx] of records.ILLUMINANCE_SEEN, over the part of a pixel that shows surfaces."""
    direct, indirect, there, covered = np.moveaxis(mean, -1, 0)
    shown = np.divide(direct, there, where=there > 0, out=np.zeros_like(there))
    covered = np.maximum(covered, LEAST_COVERAGE * there)
    light = np.maximum(indirect, 0.0)
    photons = np.divide(light, covered, where=there > 0, out=np.zeros_like(there))
    lux: NDArray[Any] = (shown + photons)[..., None]
    return lux


def mist_of(mean: NDArray[Any]) -> NDArray[Any]:
    """(h, w, 1) of MIST_IMAGES."""
    thick: NDArray[Any] = np.clip(1.0 - mean[..., 3:], 0.0, 1.0)
    return thick


def mirror_images(means: Mapping[str, NDArray[Any]]) -> tuple[NDArray[Any], NDArray[Any]]:
    """MIRROR_IMAGES; zeros for a scene without mirrors."""
    none = np.zeros_like(means["direct"])
    return means.get("mirror", none), means.get("mirror_indirect", none)


def _uncovered(indirect: NDArray[np.float64], weight: Any) -> NDArray[np.float64]:
    """Mean indirect light over mean coverage (its alpha, of `weight`): without boundary bias. A
    tilted filter counts photons far off as less than nothing: what they leave of none is none."""
    coverage = np.maximum(indirect[..., 3:], LEAST_COVERAGE * weight)
    return np.divide(
        np.maximum(indirect[..., :3], 0.0) * weight,
        coverage,
        where=coverage > 0,
        out=np.zeros_like(indirect[..., :3]),
    )
