# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures of images: what they store, and how often images are read."""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export import pixels, textures
from addon.blender.export.textures import KEPT_PIXELS
from addon.photon.errors import SceneError

from .image_files import write_exr, write_png
from .image_panels import SPAN, load, noise, quad, textured

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("nothing_kept")]


def exported(export: Any, image: bpy.types.Image | None, **settings: Any) -> tuple[Any, list[str]]:
    """The first texture of an image on a panel, and what is not exact."""
    for obj in [o for o in bpy.data.objects if o.type == "MESH"]:
        bpy.data.objects.remove(obj)
    quad(textured(image, **settings)[0], (0, 0), SPAN)
    scene, report = export()
    return scene.textures, [str(x) for x in report.entries if x.status != "exact"]


@pytest.mark.stability(71)
def test_texels_that_are_not_finite(export, tmp_path) -> None:
    some = noise(np.float32, 4)
    some[0, 1, 0], some[1, 2, 3], some[0, 3, 2] = np.nan, np.inf, 1e30
    textures_, lost = exported(export, load(write_exr(tmp_path / "odd.exr", some)))
    (texture,) = textures_
    assert not texture.pixels[0, 1].any() and not texture.pixels[1, 2].any()
    assert texture.pixels.dtype == np.float32  # half numbers do not reach that far
    np.testing.assert_allclose(texture.pixels[0, 3], some[0, 3], rtol=1e-6)
    assert len(lost) == 1 and "2 are not finite" in lost[0]


@pytest.mark.stability(71)
def test_no_memory_to_read(export, tmp_path, monkeypatch) -> None:
    image = load(write_png(tmp_path / "large.png", noise(np.uint8, 3)))
    monkeypatch.setattr(pixels, "free_host_memory", lambda: 100)
    with pytest.raises(SceneError, match=r"image 'large.png' of 4x2 pixels needs .* are free"):
        exported(export, image)


def test_pixels_are_read_once(export, tmp_path, monkeypatch) -> None:
    """Until the file, the image or how it is read changes; what is painted is always read."""
    reads: list[str] = []
    read = textures.read_pixels

    def counted(image: Any, *options: Any) -> Any:
        reads.append(image.name)
        return read(image, *options)

    monkeypatch.setattr(textures, "read_pixels", counted)
    path = write_png(tmp_path / "a.png", noise(np.uint8, 3))
    image = load(path)

    def pixels_now(**settings: Any) -> NDArray[Any]:
        ((texture, *_), _) = exported(export, image, **settings)
        return texture.pixels

    first = pixels_now()
    assert pixels_now() is first and pixels_now(interpolation="Cubic") is first
    assert len(reads) == 1 and not image.has_data  # Blender need not hold it, too
    write_png(path, noise(np.uint8, 3))
    image.reload()
    assert not np.array_equal(pixels_now(), first) and len(reads) == 2
    image.colorspace_settings.name = "Non-Color"
    pixels_now()
    image.pack()
    packed = pixels_now()
    assert len(reads) == 4 and pixels_now() is packed and len(reads) == 4
    image.pixels[0] = 0.0
    assert pixels_now()[0, 0, 0] == 0 and pixels_now()[0, 0, 0] == 0 and len(reads) == 6


def test_kept_pixels_have_bounds() -> None:
    kept = textures.Kept(room=100)
    for number in range(5):
        kept.keep(number, pixels.Stored(np.zeros((4, 10, 1), np.uint8), False, 0, False, False))
        assert kept.get(0) if number < 2 else True
    assert [number for number in range(5) if kept.get(number)] == [3, 4]


@pytest.mark.thorough
def test_a_large_image_is_read_quickly(export) -> None:
    """4096 x 4096 of bytes, and again of what was kept."""
    image = bpy.data.images.new("large", 4096, 4096)
    image.generated_type = "COLOR_GRID"
    exported(export, image)
    KEPT_PIXELS.clear()
    start = time.perf_counter()
    exported(export, image)
    between = time.perf_counter()
    exported(export, image)
    assert between - start < 1.0 and time.perf_counter() - between < 0.2
