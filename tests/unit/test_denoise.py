# SPDX-License-Identifier: GPL-3.0-or-later
"""The mixture of a picture and of what a denoiser makes of it, of pictures whose truth is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import photon_stream_native as native
import pytest
from numpy.typing import NDArray

from addon.photon.film.denoise import REACH, Filter, denoised
from addon.photon.film.error import DARK, box

SHAPE = (64, 96, 3)
NOISE = 0.3  # of a half


def detailed() -> NDArray[np.float32]:
    """Even on the left, a chequerboard on the right, from dark to bright."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    squares = np.where((x > SHAPE[1] // 2) & ((x + y) % 2 == 0), 0.5, 1.0)
    return (squares * np.exp(y / 20.0 - 1.5))[..., None].repeat(3, -1).astype(np.float32)


def specks(truth: NDArray[np.float32], share: float, grain: int) -> Any:
    """A picture and the first half of its passes: noise in proportion to the light, alike over
    squares of `grain` pixels."""
    rng = np.random.default_rng(3)

    def of(part: float) -> Any:
        small = rng.standard_normal((-(-SHAPE[0] // grain), -(-SHAPE[1] // grain), 3))
        large = small.repeat(grain, 0).repeat(grain, 1)[: SHAPE[0], : SHAPE[1]]
        return truth * (1.0 + NOISE * np.sqrt(0.5 / part) * large)

    half, other = of(share), of(1.0 - share)
    plain = share * half + (1.0 - share) * other
    return plain.astype(np.float32), half.astype(np.float32)


def strict(picture: Any, truth: Any) -> float:
    """Strict relMSE."""
    square = np.square(picture - truth, dtype=np.float64)
    return float((square / (truth**2 + (DARK * truth.mean()) ** 2)).mean())


def blurred(picture: Any) -> NDArray[np.float32]:
    return np.stack([box(picture[..., k], 3) for k in range(3)], -1).astype(np.float32)


TRUTH = detailed()
FILTERS: dict[str, Filter] = {
    "perfect": lambda picture: TRUTH.copy(),
    "none": lambda picture: picture.copy(),
    "blur": blurred,
    "black": np.zeros_like,
    "tenth": lambda picture: picture * np.float32(1.1),  # too bright
    "other": lambda picture: np.random.default_rng(9).random(SHAPE, np.float32),
}


@pytest.mark.parametrize("share", [0.5, 0.25])
@pytest.mark.parametrize("grain", [1, 4])
@pytest.mark.parametrize("name", FILTERS)
def test_never_worse(name: str, grain: int, share: float) -> None:
    """Whatever the filter does, and where noise is alike over several pixels, as photons' is."""
    plain, half = specks(TRUTH, share, grain)
    found = denoised(plain, half, share, [FILTERS[name]])
    before, after = strict(plain, TRUTH), strict(found.picture, TRUTH)
    worst = 1.0 + 0.02 * grain  # fewer independent numbers tell the mixture
    assert found.picture.dtype == np.float32 and (found.left >= 0).all() and (found.left <= 1).all()
    assert after < {"perfect": 0.1, "blur": 0.85, "none": 1.0001}.get(name, worst) * before
    left = float((found.left * before).mean())
    assert left == pytest.approx(after, rel=0.3, abs=(0.04 + 0.02 * grain) * before)


@pytest.mark.parametrize("share", [0.5, 0.25])
@pytest.mark.parametrize("grain", [1, 4])
def test_two_filters(grain: int, share: float) -> None:
    """The first one's picture, or that of the mean of both, as halves tell."""
    plain, half = specks(TRUTH, share, grain)
    pairs = [("perfect", "blur"), ("perfect", "tenth"), ("none", "other"), ("blur", "black")]
    for better, worse in pairs:
        one, other = FILTERS[better], FILTERS[worse]
        made = {
            "first": denoised(plain, half, share, [one]),
            "both": denoised(plain, half, share, [lambda x, f=one, g=other: (f(x) + g(x)) / 2.0]),
        }
        for filters, expected in (([one, other], "first"), ([other, one], "both")):
            found = denoised(plain, half, share, filters)
            assert np.allclose(found.picture, made[expected].picture, rtol=1e-6), (better, worse)


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.3, 0.5])
@pytest.mark.parametrize("name", ["chequerboard", "bright"])
def test_what_is_left_is_told(name: str, noise: float) -> None:
    """Where the denoiser's own error is hidden in the noise, too."""
    y, x = np.mgrid[:64, :64]
    truth = np.ones((64, 64, 3), np.float32)
    if name == "chequerboard":
        truth[(x + y) % 2 == 0] = 1.2
    rng = np.random.default_rng(7)
    halves = [truth + noise * rng.standard_normal(truth.shape).astype(np.float32) for _ in "ab"]
    plain = (halves[0] + halves[1]) / np.float32(2.0)
    found = denoised(plain, halves[0], 0.5, [lambda given: np.full_like(given, 1.1)])
    true = np.square(found.picture - truth).mean()
    told = (found.left * np.square(halves[0] - halves[1]).mean(axis=-1) / 4.0).mean()
    assert told == pytest.approx(true, rel=0.3)


def test_each_part_as_much_as_it_gains() -> None:
    """A blur is taken where the picture is even, and left where it has detail."""
    plain, half = specks(TRUTH, 0.5, 1)
    found = denoised(plain, half, 0.5, [blurred])
    sides = slice(0, SHAPE[1] // 2 - 3 * REACH), slice(SHAPE[1] // 2 + 3 * REACH, None)
    even, fine = (
        strict(found.picture[:, side], TRUTH[:, side]) / strict(plain[:, side], TRUTH[:, side])
        for side in sides
    )
    assert even < 0.1 and 0.7 < fine < 1.0
    assert found.left[:, sides[0]].mean() < 0.15 and found.left[:, sides[1]].mean() > 0.6


def test_one_pass_tells_nothing() -> None:
    """So it is denoised whole."""
    plain, _ = specks(TRUTH, 0.5, 1)
    found = denoised(plain, plain, 1.0, [blurred])
    np.testing.assert_array_equal(found.picture, blurred(np.maximum(plain, np.float32(0.0))))
    assert (found.left == 1.0).all()


def test_without_noise_nothing_changes() -> None:
    found = denoised(TRUTH, TRUTH, 0.5, [blurred, blurred])
    assert np.array_equal(found.picture, TRUTH) and (found.left == 1.0).all()


def test_what_does_not_fit_is_named() -> None:
    for share, other, said in ((1.0, TRUTH, "share = 1"), (0.5, TRUTH[:-1].copy(), "other_clean")):
        with pytest.raises(ValueError, match=said):
            native.mix_halves(TRUTH, TRUTH, share, TRUTH, other, unit=1.0, reach=REACH, dark=DARK)


def test_black() -> None:
    black = np.zeros(SHAPE, np.float32)
    found = denoised(black, black, 0.5, [blurred, np.zeros_like])
    assert not found.picture.any() and (found.left == 1.0).all()
