# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera makes of edges, discs and directions, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.eye.camera import EyeCamera, rigid_between
from addon.photon.renderer import NO_DEPTH
from addon.photon.scene import Camera, Lens, Motion, Scene
from addon.streams import Device
from tests.filters import below
from tests.measure import MIDDLES, render, rendered
from tests.scenes import Builder, closed_sphere, orthographic, plain_light


def half_plane() -> Scene:
    """One metre a pixel of 16 x 4; what is left of x = 0 is covered."""
    plate = Builder().quad((-90, -90, 0), (0, -90, 0), (0, 90, 0), (-90, 90, 0))
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 16.0)
    window = (-8.0, 8.0, -2.0, 2.0)
    return plate.scene(type(view)(view.kind, view.matrix, window))


@pytest.mark.parametrize(
    ("name", "width"),
    [
        *(("box", width) for width in (1.0, 3.0)),
        *(("gauss", width) for width in (0.01, 1.5)),
        *(("blackman_harris", width) for width in (0.0, 1.5, 4.0)),
    ],
)
def test_an_edge_has_the_filters_spread(device: Device, name: str, width: float) -> None:
    film = {"pixel_filter": name, "pixel_width": width, "transparent": True}
    images = render(device, half_plane(), width=16, height=4, photons=0, passes=512, **film)
    alpha = images["Combined"][..., 3]
    centres = np.arange(16) - 7.5
    if width == 0.0:
        expected = [1.0 if x < 0 else 0.0 for x in centres]
    else:
        expected = [1.0 - below(name, width, x) for x in centres]
    np.testing.assert_allclose(alpha, np.tile(expected, (4, 1)), atol=0.005)


def test_exposure_multiplies_light_alone(device: Device) -> None:
    settings: dict[str, Any] = {"photons": 5000, "passes": 8, "radius": 0.2}
    plain = render(device, closed_sphere(0.5), **settings)
    brighter = render(device, closed_sphere(0.5), exposure=2.5, **settings)
    for name, image in plain.items():
        factor = (
            np.ones(image.shape[2]) if name in ("Depth", "Normal") else np.full(image.shape[2], 2.5)
        )
        if name == "Combined":
            factor[3] = 1.0
        np.testing.assert_allclose(brighter[name], image * factor, rtol=1e-6)


def behind_glass(lens: Lens, distance: float) -> Scene:
    """The half plane so far away, 16 x 4 pixels of a quarter of a metre there."""
    plate = Builder().quad((-90, -90, 0), (0, -90, 0), (0, 90, 0), (-90, 90, 0))
    matrix = np.eye(4)
    matrix[2, 3] = distance
    half = 2.0 / distance
    return plate.scene(Camera("PERSP", matrix, (-half, half, -half / 4, half / 4), lens=lens))


def of_disc(x: Any) -> Any:
    """The share of a unit disc that lies left of x."""
    x = np.clip(x, -1, 1)
    return 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi


def of_square(x: Any) -> Any:
    """Of a square in the unit circle, upright."""
    return np.clip(0.5 + x / math.sqrt(2), 0, 1)


def of_diamond(x: Any) -> Any:
    x = np.clip(x, -1, 1)
    return 0.5 + x - np.sign(x) * x * x / 2


@pytest.mark.stability(74)
@pytest.mark.parametrize(
    ("lens", "left_of", "ratio"),
    [
        (Lens(0.6, 1.0), of_disc, 1.0),
        (Lens(0.6, 9.0, blades=2), of_disc, 1.0),
        (Lens(0.6, 1.0, blades=4), of_square, 1.0),
        (Lens(0.6, 1.0, blades=4, rotation=math.pi / 4, ratio=2.0), of_diamond, 2.0),
    ],
)
def test_circles_of_confusion(device: Device, lens: Lens, left_of: Any, ratio: float) -> None:
    """An edge at another distance than the focus has the aperture's spread, 0.5 %."""
    distance = 3.0
    scene = behind_glass(lens, distance)
    images = render(device, scene, width=16, height=4, photons=0, passes=2048, transparent=True)
    # A ray through p of the focus and l of the lens: at the plate l (1 - distance / focus) + p.
    radius = lens.radius / ratio * abs(1 - distance / lens.focus)
    fine = (np.arange(16 * 64) + 0.5) / (4 * 64) - 2.0
    expected = 1 - left_of(fine / radius).reshape(16, 64).mean(axis=1)
    alpha = images["Combined"][..., 3]
    assert 0.02 < expected[6] < 0.98 or 0.02 < expected[5] < 0.98
    np.testing.assert_allclose(alpha.mean(axis=0), expected, atol=0.005)
    np.testing.assert_allclose(alpha, np.tile(expected, (4, 1)), atol=0.02)


def test_what_is_in_focus_is_sharp(device: Device) -> None:
    settings: dict[str, Any] = {"width": 16, "height": 4, "photons": 0, "transparent": True}
    scene = behind_glass(Lens(0.6, 3.0), 3.0)
    alpha = render(device, scene, passes=64, **settings)["Combined"][..., 3]
    np.testing.assert_allclose(alpha[:, :8], 1.0)
    np.testing.assert_allclose(alpha[:, 8:], 0.0)


def test_photons_are_gathered_behind_a_lens(device: Device) -> None:
    """Splats need places on the screen; both estimators then give the same picture."""
    scene = closed_sphere(0.5)
    scene = replace(scene, camera=replace(scene.camera, lens=Lens(0.1, 1.0)))
    with rendered(device, scene, estimator="splat", radius=0.2) as renderer:
        assert renderer.estimator == "gather"
        assert "photons are gathered: splats know no depth of field" in renderer.warnings
        splat = renderer.images()
    gathered = render(device, scene, estimator="gather", radius=0.2)
    np.testing.assert_array_equal(splat["Combined"], gathered["Combined"])
    indirect = splat["Indirect"].mean()
    assert indirect == pytest.approx(0.5 / math.pi, rel=0.02)  # E_indirect = 1


# Where panoramas look: (x, y) in [-1, 1]^2 of the picture to the direction before the camera.


def equirectangular(x: Any, y: Any) -> Any:
    longitude, latitude = np.pi * x, np.pi / 2 * y
    level = np.cos(latitude)
    return [level * np.sin(longitude), np.sin(latitude), -level * np.cos(longitude)]


def fisheye(x: Any, y: Any, angle: Any) -> Any:
    far = np.hypot(x, y)
    return [np.sin(angle) * x / far, np.sin(angle) * y / far, -np.cos(angle)]


def mirrorball(x: Any, y: Any) -> Any:
    """The view along -Z, reflected by the ball's side that faces it, as the ball's image shows it:
    what is behind the ball is at its rim, and what the camera looks at in the middle."""
    z = np.sqrt(np.maximum(0, 1 - x * x - y * y))
    return [2 * z * x, 2 * z * y, 1 - 2 * z * z]


PANORAMAS: dict[str, Any] = {
    "EQUIRECTANGULAR": (
        {
            "longitude_min": -math.pi,
            "longitude_max": math.pi,
            "latitude_min": -math.pi / 2,
            "latitude_max": math.pi / 2,
        },
        equirectangular,
    ),
    "FISHEYE_EQUIDISTANT": (
        {"fisheye_fov": 4.0},
        lambda x, y: fisheye(x, y, 2.0 * np.hypot(x, y)),
    ),
    "FISHEYE_EQUISOLID": (
        {"fisheye_lens": 10.0, "fisheye_fov": 3.0, "sensor_width": 30.0, "sensor_height": 20.0},
        lambda x, y: fisheye(
            15 * x, 10 * y, 2 * np.arcsin(np.minimum(1, np.hypot(15 * x, 10 * y) / 20))
        ),
    ),
    "MIRRORBALL": ({}, mirrorball),
}


@pytest.mark.parametrize("kind", PANORAMAS)
def test_panoramas_look_where_they_say(device: Device, kind: str) -> None:
    """From within a sphere: its normals, depth, which is the distance along the ray, and the
    photons that land on it."""
    parameters, direction = PANORAMAS[kind]
    matrix = np.eye(4)
    matrix[:3, :3] = [[0, 0, -1], [1, 0, 0], [0, -1, 0]]
    view = Camera(kind, matrix, (0.0, 1.0, 0.0, 1.0), parameters=parameters)
    scene = replace(closed_sphere(0.5), camera=view)
    images = render(device, scene, width=48, height=32, photons=30000, **MIDDLES)
    x, y = np.meshgrid((np.arange(48) + 0.5) / 24 - 1, (np.arange(32) + 0.5) / 16 - 1)
    inside = (np.hypot(x, y) <= 1) | (kind == "EQUIRECTANGULAR")
    if kind == "FISHEYE_EQUISOLID":
        inside = np.hypot(15 * x, 10 * y) <= 20 * math.sin(0.75)
    towards = np.stack(direction(x, y), -1) @ matrix[:3, :3].T
    assert inside.mean() > 0.5
    np.testing.assert_allclose(images["Normal"][inside], -towards[inside], atol=2e-3)
    np.testing.assert_allclose(images["Depth"][inside], 1.0, atol=2e-3)
    assert (images["Depth"][~inside] == NO_DEPTH).all()
    assert (images["Combined"][~inside] == (0, 0, 0, 1)).all()
    assert images["Indirect"][inside, 0].mean() == pytest.approx(0.5 / math.pi, rel=0.02)


@pytest.mark.parametrize("lens", [None, Lens(0.2, 1.0)])
def test_how_wide_a_panorama_sees_a_pixel(
    device: Device, monkeypatch: pytest.MonkeyPatch, lens: Lens | None
) -> None:
    """By the middles of two, whatever the seed, the filter, the first pass or the lens."""
    found: list[float] = []
    footprint = EyeCamera.footprint

    def noted(self: EyeCamera) -> Any:
        width, eye = footprint(self)
        found.append(width)
        return width, eye

    monkeypatch.setattr(EyeCamera, "footprint", noted)
    parameters, _ = PANORAMAS["EQUIRECTANGULAR"]
    view = Camera(
        "EQUIRECTANGULAR", np.eye(4), (0.0, 1.0, 0.0, 1.0), parameters=parameters, lens=lens
    )
    scene = replace(closed_sphere(0.5), camera=view)
    for seed, name in ((0, "box"), (1, "gauss"), (2, "blackman_harris")):
        film = {"pixel_filter": name, "pixel_width": 2.0, "seed": seed, "first_pass": 3 * seed}
        render(device, scene, width=64, height=32, photons=1000, **film)
    np.testing.assert_allclose(found, 2.0 * math.pi / 64.0, rtol=0.01)


def test_cameras_turn_evenly() -> None:
    """A quarter of a rotation about one axis, and of half a turn, whose axis has two signs."""
    for degrees in (0.0, 90.0, 180.0):
        matrices = np.stack([np.eye(4)] * 2)
        matrices[1, :3, :3] = about_x(degrees)
        matrices[1, :3, 3] = 4.0, 0.0, -2.0
        quarter = rigid_between(matrices, 0.25)
        np.testing.assert_allclose(quarter[:3, 3], (1.0, 0.0, -0.5))
        signs = [about_x(sign * degrees / 4) for sign in (1, -1)[: 1 + (degrees == 180)]]
        assert min(np.abs(quarter[:3, :3] - turned).max() for turned in signs) < 1e-12
        np.testing.assert_allclose(rigid_between(matrices, 1.0), matrices[1], atol=1e-12)


def about_x(degrees: float) -> Any:
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])


@pytest.mark.stability(74)
@pytest.mark.thorough("splat")
@pytest.mark.parametrize("estimator", ["splat", "gather"])
def test_an_edge_passes_by(device: Device, estimator: str) -> None:
    """A camera that goes by four pixels: the edge's light is a ramp, by photons as well."""
    scene = half_plane()
    matrices = np.stack([scene.camera.matrix] * 2)
    matrices[1, 0, 3] += 4.0
    light = plain_light("lamp", "POINT", (-30, 0, 40), (1e5,) * 3)
    scene = replace(scene, camera=replace(scene.camera, motion=Motion(matrices)), lights=(light,))
    settings: dict[str, Any] = {"width": 16, "height": 4, "passes": 256, "transparent": True}
    settings |= {"direct_by_photons": True, "photons": 4000, "radius": 8.0}
    images = render(device, scene, estimator=estimator, **settings)
    expected = 1 - np.clip((np.arange(-8, 8, 1 / 64) + 4 + 1 / 128) / 4, 0, 1)
    expected = expected.reshape(16, 64).mean(axis=1)
    np.testing.assert_allclose(images["Combined"][..., 3].mean(axis=0), expected, atol=0.015)
    light = images["Combined"][..., 0].mean(axis=0)
    np.testing.assert_allclose(light[4:8] / light[2], expected[4:8], atol=0.06)
