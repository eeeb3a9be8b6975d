# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings.check: the range of every field."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import pytest

from addon.photon.errors import SettingsError
from addon.photon.settings import Settings

# (field, smallest, largest, values outside)
RANGES: list[tuple[str, Any, Any, tuple[Any, ...]]] = [
    ("width", 1, 16384, (0, -1, 16385)),
    ("height", 1, 16384, (0, -1, 16385)),
    ("passes", 1, 1 << 24, (0, -1, (1 << 24) + 1)),
    ("first_pass", 0, 1 << 24, (-1, (1 << 24) + 1)),
    ("photons", 0, 1 << 24, (-1, (1 << 24) + 1)),
    ("radius", 0.0, 1e9, (-1e-9, -math.inf)),
    ("radius_decay", 0.01, 1.0, (0.0, 0.009, 1.001)),
    ("seed", 0, (1 << 32) - 1, (-1, 1 << 32)),
    ("photon_bounces", 1, 1024, (0, 1025)),
    ("mirror_depth", 0, 1024, (-1, 1025)),
    ("transparent_depth", 0, 1024, (-1, 1025)),
    ("volume_bounces", 0, 1024, (-1, 1025)),
    ("pixel_width", 0.0, 1e3, (-0.1, 1001.0)),
    ("exposure", 0.0, 1e6, (-0.1, math.inf)),
    ("clamp_direct", 0.0, 1e38, (-0.1, math.inf)),
    ("clamp_indirect", 0.0, 1e38, (-0.1, math.inf)),
    ("device_index", 0, 255, (-1, 256)),
    ("time_limit", 0.0, 1e9, (-0.1,)),
    ("noise_threshold", 0.0, 1e9, (-0.1,)),
    ("min_passes", 8, 1 << 24, (7, (1 << 24) + 1)),
    ("caller_bytes", 0, 1 << 62, (-1, (1 << 62) + 1)),
]
CHOICES: dict[str, tuple[str, ...]] = {
    "estimator": ("auto", "splat", "gather"),
    "backend": ("auto", "fragment", "compute", "native"),
    "filter": ("constant", "cone", "gaussian", "epanechnikov"),
    "pixel_filter": ("box", "gauss", "blackman_harris"),
    "splat_shape": ("triangle", "quad", "point"),
}
SWITCHES = {"boundary_correction", "direct_by_photons", "transparent", "illuminance", "caustics"}
SWITCHES |= {"denoise", "denoising_data"}


def test_defaults_are_in_range() -> None:
    Settings().check()


def test_every_field_is_in_a_test_here() -> None:
    covered = {row[0] for row in RANGES} | CHOICES.keys() | SWITCHES | {"region", "mist"}
    assert {field.name for field in fields(Settings)} == covered


@pytest.mark.parametrize(("name", "low", "high", "bad"), RANGES)
def test_ranges(name: str, low: Any, high: Any, bad: tuple[Any, ...]) -> None:
    for value in (low, high):
        Settings(**{name: value}).check()
    for value in bad:
        with pytest.raises(SettingsError, match=rf"^{name} = {value} is outside \["):
            Settings(**{name: value}).check()


@pytest.mark.parametrize("name", [row[0] for row in RANGES])
def test_not_a_number(name: str) -> None:
    with pytest.raises(SettingsError, match=f"^{name} = nan is outside"):
        Settings(**{name: math.nan}).check()


@pytest.mark.parametrize("name", CHOICES)
def test_choices(name: str) -> None:
    for value in CHOICES[name]:
        Settings(**{name: value}).check()
    with pytest.raises(SettingsError, match=f"^{name} = 'Auto' is none of {CHOICES[name][0]}, "):
        Settings(**{name: "Auto"}).check()


@pytest.mark.parametrize("region", [(0, 0, 10, 20), (9, 19, 10, 20), (3, 4, 5, 6)])
def test_region(region: tuple[int, int, int, int]) -> None:
    settings = Settings(width=10, height=20, region=region)
    settings.check()
    assert settings.frame_region == region
    assert Settings(width=10, height=20).frame_region == (0, 0, 10, 20)


@pytest.mark.parametrize(
    "region", [(0, 0, 11, 20), (0, 0, 10, 21), (-1, 0, 10, 20), (5, 5, 5, 6), (6, 5, 5, 6)]
)
def test_region_outside_the_frame(region: tuple[int, int, int, int]) -> None:
    with pytest.raises(SettingsError, match=r"region = \(.* is empty or outside 10x20"):
        Settings(width=10, height=20, region=region).check()


def test_mist() -> None:
    Settings(mist=(0.0, 0.0, 2.0)).check()
    for bad in ((-1.0, 10.0, 1.0), (0.0, math.nan, 1.0), (0.0, 10.0, 0.0), (0.0, 1e30, 1.0)):
        with pytest.raises(SettingsError, match=r"^mist = \(.* is outside \[0, 1e18\]"):
            Settings(mist=bad).check()


@pytest.mark.parametrize("name", ["width", "height", "passes", "photons", "seed", "first_pass"])
def test_whole_numbers(name: str) -> None:
    with pytest.raises(SettingsError, match=name):
        Settings(**{name: 10.5}).check()


@pytest.mark.parametrize(
    ("size", "photons"), [(16, 4096), (64, 12288), (512, 786432), (4096, 1 << 22)]
)
def test_three_photons_a_pixel(size: int, photons: int) -> None:
    assert Settings(width=size, height=size).photons_a_pass == photons
    assert Settings(width=size, height=size, photons=7).photons_a_pass == 7
    assert Settings(photons=0).photons_a_pass == 0
