# SPDX-License-Identifier: GPL-3.0-or-later
"""A world by an image lights by closed forms, and as a world of one radiance if its pixels are
alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import FOUND_BY, Image, Lobe, Material, Scene, environment_light
from addon.photon.stage.environments import solid_angles
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, orthographic, plain_material

SKY = (1.0, 0.5, 0.25)
SETTINGS: dict[str, Any] = {"width": 24, "height": 24}
UP, ACROSS = (0.36, 0.48, -0.8), (0.8, -0.6, 0.0)


def even(radiance: Any, height: int = 8) -> Image:
    pixels = np.broadcast_to(np.float32(radiance), (height, 2 * height, 3))
    return Image("even", np.ascontiguousarray(pixels))


def lit(built: Builder, view: Any, image: Image, material: Material, **options: Any) -> Scene:
    light = environment_light("sky", 0, **options)
    return replace(built.scene(view, [light], [material]), images=(image,))


def ball(material: Material, image: Image, **options: Any) -> Scene:
    """A ball that fills the picture's middle, before nothing."""
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 0.8)
    return lit(Builder().sphere((0, 0, 0), 1.0, subdivisions=5), view, image, material, **options)


def on_ball(image: Any) -> Any:
    return image[6:18, 6:18, :3].mean(axis=(0, 1))


@pytest.mark.parametrize("found_by", [("diffuse", "glossy"), ("chains",), ("glossy", "chains")])
def test_furnace(device: Device, found_by: tuple[str, ...]) -> None:
    """An even image shows what a world of one radiance does: by shadow rays on a diffuse body, by
    rays of a lobe, and by both."""
    if "diffuse" in found_by:
        material, albedo = plain_material("grey", (0.6, 0.4, 0.2)), (0.6, 0.4, 0.2)
    else:
        parameters = {"alpha_x": 0.09, "alpha_y": 0.09, "turn": 0.0, "compensated": 1.0}
        lobe = Lobe("ggx", (1.0, 1.0, 1.0), parameters)
        material, albedo = Material("white", (0.0,) * 3, (lobe,)), (1.0, 1.0, 1.0)
    scene = ball(material, even(SKY), found_by=found_by, up=UP, middle=ACROSS)
    images = render(device, scene, **SETTINGS, passes=100, photons=0)
    np.testing.assert_allclose(on_ball(images["Combined"]), np.multiply(SKY, albedo), 8e-3)


ROUGH = {
    "oren_nayar": {"diffuse_roughness": 1.0},
    "translucent": {},
    "sheen": {"roughness": 0.5},
    "toon": {"size": 0.5, "edge": 0.2},
}


@pytest.mark.thorough("sheen", "toon")
@pytest.mark.parametrize("hidden", [False, True])
@pytest.mark.parametrize("kind", ROUGH)
def test_rays_of_diffuse_lobes(device: Device, kind: str, hidden: bool) -> None:
    """They find no world that is hidden from diffuse rays, as rays of gloss do."""
    material = Material("rough", (0.0,) * 3, (Lobe(kind, (0.8,) * 3, ROUGH[kind]),))
    lost = {"diffuse", "translucent"} if hidden else set()
    found_by = tuple(who for who in FOUND_BY[1:] if who not in lost)
    scene = ball(material, even(SKY), found_by=found_by, up=UP, middle=ACROSS)
    seen = on_ball(render(device, scene, **SETTINGS, passes=4, photons=2000)["Combined"])
    assert (seen > 0.01).any() != hidden and (seen >= 0.0).all()


def hot_pixel(row: int = 5, column: int = 4, height: int = 8) -> tuple[Image, Any]:
    """An image of one bright pixel, and its middle's direction."""
    pixels = np.zeros((height, 2 * height, 3), np.float32)
    pixels[row, column] = np.multiply(SKY, 100.0)
    up, around = np.pi * ((row + 0.5) / height - 0.5), np.pi * (1 - (column + 0.5) / height)
    across = np.cos(up)
    return Image("hot", pixels), (across * np.cos(around), across * np.sin(around), np.sin(up))


def falling(image: Image, normal: Any) -> Any:
    """Irradiance by the image's interpolation, summed over fine cells."""
    height, fine = len(image.pixels), 64
    at = (np.arange(height * fine) + 0.5) / fine - 0.5  # rows, in pixels
    columns = (np.arange(2 * height * fine) + 0.5) / fine - 0.5
    rows_of = _interpolated(np.eye(height), at, wraps=False)
    columns_of = _interpolated(np.eye(2 * height), columns, wraps=True)
    radiance = np.einsum("ar,rcx,bc->abx", rows_of, image.pixels.astype(float), columns_of)
    up = np.pi * ((at + 0.5) / height - 0.5)
    around = 2 * np.pi * (0.5 - (columns + 0.5) / (2 * height))
    cosine = (
        np.cos(up)[:, None] * (np.cos(around) * normal[0] + np.sin(around) * normal[1])
        + np.sin(up)[:, None] * normal[2]
    ).clip(0.0)
    angles = solid_angles(height * fine, 2 * height * fine)
    return np.einsum("abx,ab,a->x", radiance, cosine, angles)


def _interpolated(pixels: Any, at: Any, wraps: bool) -> Any:
    low = np.floor(at).astype(int)
    part = (at - low)[:, None]
    count = len(pixels)
    first, second = (pixels[i % count if wraps else i.clip(0, count - 1)] for i in (low, low + 1))
    return (1 - part) * first + part * second


@pytest.mark.parametrize("by_photons", [False, True])
def test_hot_pixel(device: Device, by_photons: bool) -> None:
    """What one bright pixel brings to a square is its radiance times solid angle and cosine."""
    image, _ = hot_pixel()
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    view = orthographic((0, 0, 3), (1, 0, 0), (0, 1, 0), 0.9)
    scene = lit(Builder().quad(*corners), view, image, plain_material("grey", (0.5,) * 3))
    expected = falling(image, (0.0, 0.0, 1.0))
    if by_photons:
        settings: dict[str, Any] = SETTINGS | {"photons": 250_000, "radius": 0.2}
        with rendered(device, scene, **settings, direct_by_photons=True) as renderer:
            # The square has two sides, and an area of 4.
            both = 4 * (expected + falling(image, (0.0, 0.0, -1.0)))
            np.testing.assert_allclose(fallen(renderer)[0], both, 1e-2)
        return
    images = render(device, scene, **SETTINGS, passes=100, photons=0)
    seen = images["Combined"][..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(seen, expected * 0.5 / np.pi, 5e-3)


def test_it_is_seen_where_it_shines_from(device: Device) -> None:
    """A turned image is seen where its light comes from: a pixel's middle shows the pixel."""
    image, towards = hot_pixel()
    turn = np.stack([ACROSS, np.cross(UP, ACROSS), UP])  # from the world to the image
    direction = np.array(towards) @ turn
    right = np.cross(direction, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    view = orthographic((0, 0, 0), tuple(right), tuple(np.cross(right, direction)), 1e-3)
    scene = lit(Builder(), view, image, plain_material("grey"), up=UP, middle=ACROSS)
    seen = render(device, scene, **SETTINGS, passes=1)["Combined"]
    np.testing.assert_allclose(seen[..., :3].mean(axis=(0, 1)), np.multiply(SKY, 100.0), 1e-3)
