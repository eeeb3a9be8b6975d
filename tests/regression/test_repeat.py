# SPDX-License-Identifier: GPL-3.0-or-later
"""The same seed gives the same bits; parts of a render are the whole's."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.backends import backend as backend_module
from addon.photon.film.film import Statistics, merged
from addon.photon.film.picture import picture_of
from addon.photon.film.strips import strips_of
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device
from tests.measure import render
from tests.scenes import cornell
from tests.stability.table import Measured

REPOSITORY = Path(__file__).resolve().parents[2]
PASSES = 5
CHOICES = {"width": 48, "height": 40, "passes": PASSES, "photons": 8000, "radius_decay": 2 / 3}
PARTS = ("Direct", "Indirect", "Mirror", "Background", "Combined")
WAYS = [
    ("native", "gather"),
    ("native", "splat"),
    ("fragment", "splat"),
    ("fragment", "gather"),
    ("compute", "gather"),
]
# The others have each backend and each estimator.
TWICE = pytest.mark.thorough("native-splat", "fragment-gather")

Images = dict[str, Any]


def picture(device: Device, **settings: Any) -> Images:
    """A scene with everything in it: a coloured room, a mirror sphere, broad lobes."""
    return render(device, cornell(mirror=True, lobe=True), **CHOICES | settings)


def statistics(device: Device, **settings: Any) -> Statistics:
    """What the film of that picture holds."""
    renderer = prepare(cornell(mirror=True, lobe=True), Settings(**CHOICES | settings), device)
    try:
        for _ in range(renderer.settings.passes):
            renderer.render_pass()
        return renderer.film.statistics()
    finally:
        renderer.release()


def digest(images: Images) -> str:
    """A hash of every bit of every pass."""
    found = hashlib.sha256()
    for name in sorted(images):
        found.update(name.encode() + images[name].tobytes())
    return found.hexdigest()


@pytest.mark.stability(45)
@TWICE
@pytest.mark.parametrize(("backend", "estimator"), WAYS)
def test_two_renders_of_a_seed_are_equal(device: Device, backend: str, estimator: str) -> None:
    first, second = (picture(device, backend=backend, estimator=estimator) for _ in range(2))
    for name in first:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)
    assert max(first[name].max() for name in ("Indirect", "Mirror")) > 0


@pytest.mark.stability(45)
@TWICE
@pytest.mark.parametrize(("backend", "estimator"), WAYS)
def test_two_processes_render_a_seed_equally(device: Device, backend: str, estimator: str) -> None:
    code = (
        "from addon.streams import Device\n"
        "from tests.regression.test_repeat import digest, picture\n"
        f"print(digest(picture(Device(), backend={backend!r}, estimator={estimator!r})))"
    )
    # A hash seed of its own: an order that comes from a set or dict must not show.
    environment = os.environ | {"PYTHONHASHSEED": "12345"}
    other = subprocess.run(
        [sys.executable, "-c", code],
        cwd=REPOSITORY,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert other.returncode == 0, other.stderr
    assert other.stdout.split()[-1] == digest(picture(device, backend=backend, estimator=estimator))


@pytest.mark.stability(55)
@TWICE
@pytest.mark.parametrize(("backend", "estimator"), WAYS)
def test_a_border_render_is_the_crop_of_the_whole(
    device: Device,
    backend: str,
    estimator: str,
    measured: Measured,
) -> None:
    ways = {"backend": backend, "estimator": estimator, "passes": 2}
    whole = picture(device, **ways)
    for x0, y0, x1, y1 in ((7, 5, 30, 33), (0, 0, 1, 1), (47, 39, 48, 40), (0, 11, 48, 12)):
        part = picture(device, region=(x0, y0, x1, y1), **ways)
        for name, image in part.items():
            differ = np.count_nonzero(image != whole[name][y0:y1, x0:x1])
            assert measured("crop's values that differ", differ) == 0, (name, x0, y0)


# Each kind of strips by splats and by gathering, each backend with two kinds or more.
@pytest.mark.thorough(
    *(f"{kind}-fragment-splat" for kind in ("even", "rows", "by photons")),
    *(f"{kind}-native-splat" for kind in ("transparent", "border")),
    *(f"{kind}-compute-gather" for kind in ("even", "border", "by photons")),
    "fragment-gather",
)
@pytest.mark.parametrize(("backend", "estimator"), WAYS)
@pytest.mark.parametrize(
    ("pixels", "settings"),
    [
        (48 * 7, {}),  # six strips of seven rows, the last ones overlapping
        (48 * 20, {"transparent": True, "seed": 7}),
        (1, {"region": (7, 5, 30, 18)}),  # a row each
        (23 * 4, {"region": (7, 5, 30, 33), "boundary_correction": False}),
        (48 * 13, {"direct_by_photons": True, "mirror_depth": 2}),
    ],
    ids=["even", "transparent", "rows", "border", "by photons"],
)
def test_strips_are_the_whole(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    backend: str,
    estimator: str,
    pixels: int,
    settings: Images,
) -> None:
    """What is rendered strip by strip has the bits of what is rendered at once."""
    ways = {"backend": backend, "estimator": estimator, "passes": 8} | settings
    whole = picture(device, **ways)
    for name in ("STRIP_PIXELS", "GPU_STRIP_PIXELS"):
        monkeypatch.setattr(backend_module, name, pixels)
    assert len(strips_of(Settings(**CHOICES | ways).frame_region, pixels)) > 1
    part = picture(device, **ways)
    for name, image in whole.items():
        if name == "Error" and not device.is_software:  # found there, by sums in another order
            np.testing.assert_allclose(part[name], image, rtol=2e-6, err_msg=name)
        else:
            np.testing.assert_array_equal(part[name], image, err_msg=name)
    assert np.isfinite(whole["Error"]).all() and whole["Mirror"].max() > 0


def test_seeds_differ(device: Device) -> None:
    first, second = (picture(device, seed=seed) for seed in (1, 2))
    for name in ("Direct", "Indirect", "Mirror"):
        assert (first[name] != second[name]).any(), name
    # Yet they are pictures of the same scene.
    assert first["Combined"].mean() == pytest.approx(second["Combined"].mean(), rel=0.05)


@pytest.mark.parametrize("split", [1, 3])
def test_ranges_of_passes_merge_to_the_whole(device: Device, split: int) -> None:
    """What films hold are means over passes, so they merge; the picture is made of the whole."""
    whole = statistics(device)
    first = statistics(device, passes=split)
    second = statistics(device, first_pass=split, passes=PASSES - split)
    both = merged([first, second])
    for name, mean in whole.means.items():
        # Relative to what was summed: the blur is a small difference.
        scale = np.abs(mean).max()
        np.testing.assert_allclose(both.means[name], mean, rtol=1e-6, atol=1e-7 * scale)
    pictures = picture_of(both.means), picture_of(whole.means)
    for name in pictures[0]:
        np.testing.assert_allclose(*(p[name] for p in pictures), rtol=1e-5, err_msg=name)


def test_passes_differ(device: Device) -> None:
    """Passes that repeated each other's random numbers would pass every test above."""
    first, second = (picture(device, passes=1, first_pass=i) for i in (0, 1))
    for name in ("Indirect", "Mirror"):
        there = (first[name] > 0) | (second[name] > 0)
        assert there.mean() > 0.02 and (first[name] != second[name])[there].mean() > 0.2, name


def test_settings_hold_a_whole_seed(device: Device) -> None:
    """All 32 bits of the seed count."""
    low, high = (digest(picture(device, passes=1, seed=seed)) for seed in (1, 1 + (1 << 31)))
    assert low != high
    Settings(seed=(1 << 32) - 1).check()
