# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of a scene: what is refused, what is kept and sent, what memory they take, and their
table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.backends.backend import backend_of
from addon.photon.backends.sizes import TEXEL, Bytes
from addon.photon.errors import SceneError
from addon.photon.memory import Budget
from addon.photon.photons.kept import same_but_view
from addon.photon.scene import Image, Scene, environment_light
from addon.photon.scene.snapshot import INLINE, pack, unpack
from addon.photon.settings import Settings
from addon.photon.stage.environments import environment_table, solid_angles
from addon.streams import Device
from tests.scenes import cornell

SOME = np.random.default_rng(1).random((16, 32, 3)).astype(np.float32)


def with_images(*images: Image, number: int = 0) -> Scene:
    return replace(cornell(), images=images, lights=(environment_light("sky", number),))


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        (SOME.astype(np.float64), r"image 'odd': expected float32.*got float64\[16, 32, 3\]"),
        (SOME[..., 0], r"image 'odd': expected float32.*got float32\[16, 32\]"),
        (SOME[:0], r"image 'odd': expected float32.*got float32\[0, 32, 3\]"),
        (-SOME, "image 'odd': a pixel is not finite or below 0"),
        (np.full_like(SOME, np.inf), "image 'odd': a pixel is not finite or below 0"),
        (np.full_like(SOME, np.nan), "image 'odd': a pixel is not finite or below 0"),
    ],
)
def test_images_that_are_refused(pixels: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        with_images(Image("odd", pixels)).check()


@pytest.mark.parametrize("number", [1, -1, 0.5])
def test_a_light_of_no_image_is_refused(number: Any) -> None:
    with pytest.raises(SceneError, match="light 'sky': "):
        with_images(Image("one", SOME), number=number).check()


def test_files_and_messages_hold_images(tmp_path: Path) -> None:
    assert SOME.nbytes > INLINE
    scene = with_images(Image("one", SOME), Image("two", SOME[:2, :3].copy()), number=1)
    scene.save(tmp_path / "scene.npz")
    for again in (Scene.load(tmp_path / "scene.npz"), unpack(pack(scene))):
        assert same_but_view(scene, again)
    changed = SOME.copy()
    changed[3, 4, 1] += 1e-3
    assert not same_but_view(scene, replace(scene, images=(Image("one", changed), scene.images[1])))


def test_memory_is_told(device: Device) -> None:
    """As a table on the device, and once more on the host while that is made."""
    settings = Settings(8, 8, backend="fragment")
    budget = Budget(with_images(Image("one", SOME)), settings, backend_of(settings, device))
    part = next(part for part in budget.parts() if part.name == "image pixels")
    assert (part.count, part.size) == (512, Bytes(TEXEL * 512, TEXEL * 512))


def test_table() -> None:
    """Each image begins a row of its own; its shares are sums of luminance times solid angle."""
    small = Image("small", np.ones((2, 4, 3), np.float32))
    texels, places = environment_table([small, Image("black", 0 * SOME), Image("one", SOME)])
    assert places == ((0, 4, 2), (1, 32, 16), (2, 32, 16)) and len(texels) == 3 * 4096
    np.testing.assert_allclose(texels[0, :3], 4 * np.pi, rtol=1e-6)
    np.testing.assert_allclose(texels[1:3, 0], [0.5, 1.0], rtol=1e-6)
    np.testing.assert_allclose(texels[3:11, 3], np.tile([0.25, 0.5, 0.75, 1.0], 2), rtol=1e-6)
    assert not texels[4096:8192].any()
    rows = texels[8192 + 1 : 8192 + 17, 0]
    assert (np.diff(rows) > 0).all() and rows[-1] == 1.0
    pixels = texels[8192 + 17 : 8192 + 17 + 512].reshape(16, 32, 4)
    np.testing.assert_array_equal(pixels[..., :3], SOME)
    assert (np.diff(pixels[..., 3]) > 0).all() and (pixels[:, -1, 3] == 1.0).all()


def test_solid_angles() -> None:
    assert solid_angles(7, 12).sum() * 12 == pytest.approx(4 * np.pi)
