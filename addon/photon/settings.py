# SPDX-License-Identifier: GPL-3.0-or-later
"""Every choice that a render takes besides its scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from .errors import SettingsError

Estimator = Literal["auto", "splat", "gather"]
BackendName = Literal["auto", "fragment", "compute", "native"]
Filter = Literal["constant", "cone", "gaussian", "epanechnikov"]
PixelFilter = Literal["box", "gauss", "blackman_harris"]
SplatShape = Literal["triangle", "quad", "point"]
Region = tuple[int, int, int, int]
Mist = tuple[float, float, float]

# That tell the error: after fewer it is often estimated much too large.
FEWEST_PASSES = 8
FEWEST_PHOTONS, MOST_PHOTONS = 1 << 12, 1 << 22  # a pass, unless the user says


# One of them builds a kernel for its filter.
FILTER_DEFINES = tuple(f"FILTER_{name.upper()}" for name in get_args(Filter))
PIXEL_FILTER_DEFINES = tuple(f"PIXEL_{name.upper()}" for name in get_args(PixelFilter))
# [widths] from a pixel's middle to where rays go through it.
_REACHES: dict[PixelFilter, float] = {"box": 0.5, "gauss": 1.5, "blackman_harris": 1.0}


def filter_define(settings: Settings) -> dict[str, int | float]:
    """The define that builds a kernel for the settings' filter."""
    return {f"FILTER_{settings.filter.upper()}": 1}


def pixel_filter_define(settings: Settings) -> dict[str, int | float]:
    """The define that builds a kernel for their pixel filter."""
    return {f"PIXEL_{settings.pixel_filter.upper()}": 1}


@dataclass(frozen=True)
class Settings:
    """A render's settings; `check` states their ranges.

    The picture depends on every field but `backend`, `estimator` and `splat_shape`, which choose
    among ways to compute the same one.
    """

    width: int = 512  # [px] of the whole frame
    height: int = 512
    region: Region | None = None  # (x0, y0, x1, y1) [px] rendered, from the bottom left
    passes: int = 16
    first_pass: int = 0  # ranges of passes can be rendered apart and merged
    photons: int | None = None  # emitted a pass, all lights together; None: three a pixel
    radius: float = 0.0  # [m] of the first pass; 0: from the photons' density
    radius_decay: float = 2.0 / 3.0  # alpha of Knaus & Zwicker 2011; 1 keeps the radius
    seed: int = 0
    estimator: Estimator = "auto"
    backend: BackendName = "auto"  # who traces, sorts and sums: backends/backend.py
    filter: Filter = "epanechnikov"
    splat_shape: SplatShape = "quad"
    photon_bounces: int = 64  # scattering events a photon path may have
    mirror_depth: int = 12  # secondary rays a chain may have
    transparent_depth: int = 8  # transparent surfaces that a ray may pass, besides
    volume_bounces: int = 0  # by which media scatter light that they have scattered once
    boundary_correction: bool = True  # cut discs, and divide by their share on the surface
    direct_by_photons: bool = False  # store first hits too and trace no shadow rays
    transparent: bool = False  # the world leaves alpha 0
    illuminance: bool = False  # an image of it, too
    # The same of mist: how near it begins, over which distance it grows thick [m]; to which power.
    mist: Mist | None = None
    denoise: bool = False  # what is noise in Combined, by OpenImageDenoise
    denoising_data: bool = False  # images of what denoisers go by, too
    caustics: bool = False  # an image of them, too
    pixel_filter: PixelFilter = "box"
    pixel_width: float = 1.0  # [px] of other filters than the box, in Blender's sense
    exposure: float = 1.0  # times the picture
    # The most light of one sample, straight from lights and by way of other surfaces, in the mean
    # of the channels [W/(m^2 sr)]; 0: as much as there is. What photons bring is not limited.
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0
    device_index: int = 0  # which EGL device
    time_limit: float = 0.0  # [s]; 0: none
    noise_threshold: float = 0.0  # relative error, noise and bias, that ends the render; 0: none
    min_passes: int = FEWEST_PASSES  # before noise_threshold may
    caller_bytes: int = 0  # that the caller will take for the picture, for the look at memory

    def check(self) -> None:
        """Raise SettingsError naming the first field that is out of its range."""
        for name, low, high in (
            ("width", 1, 16384),
            ("height", 1, 16384),
            ("passes", 1, 1 << 24),
            ("first_pass", 0, 1 << 24),
            ("photons", 0, 1 << 24),
            ("radius", 0.0, 1e18),
            ("radius_decay", 0.01, 1.0),
            ("seed", 0, (1 << 32) - 1),
            ("photon_bounces", 1, 1024),
            ("mirror_depth", 0, 1024),
            ("transparent_depth", 0, 1024),
            ("volume_bounces", 0, 1024),
            ("pixel_width", 0.0, 1e3),
            ("exposure", 0.0, 1e6),
            ("clamp_direct", 0.0, 1e38),
            ("clamp_indirect", 0.0, 1e38),
            ("device_index", 0, 255),
            ("time_limit", 0.0, math.inf),
            ("noise_threshold", 0.0, math.inf),
            ("min_passes", FEWEST_PASSES, 1 << 24),
            ("caller_bytes", 0, 1 << 62),
        ):
            value = getattr(self, name)
            if value is None and name == "photons":
                continue
            if not low <= value <= high:  # also refuses NaN
                raise SettingsError(f"{name} = {value} is outside [{low}, {high}]")
            if isinstance(low, int) and not isinstance(value, int):
                raise SettingsError(f"{name} = {value!r} is not a whole number")
        for name, kind in (
            ("estimator", Estimator),
            ("backend", BackendName),
            ("filter", Filter),
            ("splat_shape", SplatShape),
            ("pixel_filter", PixelFilter),
        ):
            if getattr(self, name) not in get_args(kind):
                raise SettingsError(
                    f"{name} = {getattr(self, name)!r} is none of {', '.join(get_args(kind))}"
                )
        if self.mist is not None:
            begin, depth, power = self.mist
            if not (0.0 <= begin <= 1e18 and 0.0 <= depth <= 1e18 and 0.01 <= power <= 100.0):
                raise SettingsError(
                    f"mist = {self.mist} is outside [0, 1e18], its power [0.01, 100]"
                )
        x0, y0, x1, y1 = self.frame_region
        if not (0 <= x0 < x1 <= self.width and 0 <= y0 < y1 <= self.height):
            raise SettingsError(
                f"region = {self.region} is empty or outside {self.width}x{self.height}"
            )

    @property
    def photons_a_pass(self) -> int:
        """The photons of a pass. By themselves three for each pixel of the frame, within limits.

        At equal time fewer leave more error, and more take longer for a first picture.
        """
        if self.photons is not None:
            return self.photons
        return min(max(3 * self.width * self.height, FEWEST_PHOTONS), MOST_PHOTONS)

    @property
    def pixel_filter_width(self) -> float:
        """The pixel filter's width [px], in Blender's sense."""
        return 1.0 if self.pixel_filter == "box" else self.pixel_width

    @property
    def pixel_filter_reach(self) -> float:
        """How far from a pixel's middle its eye rays may go [px]."""
        return _REACHES[self.pixel_filter] * self.pixel_filter_width

    @property
    def frame_region(self) -> Region:
        """The rendered pixels (x0, y0, x1, y1)."""
        return self.region or (0, 0, self.width, self.height)
