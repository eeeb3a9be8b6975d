# SPDX-License-Identifier: GPL-3.0-or-later
"""Illuminance by closed forms, whatever a surface reflects; and its false colours."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.film.false_colour import CLASSES, false_colour, limits
from addon.photon.film.picture_file import write_picture
from addon.photon.jobs.lux import illuminance, main
from addon.photon.scene import Light, Material, Scene, world_light
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, cornell, orthographic, plain_light, plain_material

LUX = 683.0
WEIGHTS = (0.2126, 0.7152, 0.0722)
SETTINGS: dict[str, Any] = {"width": 16, "height": 16, "illuminance": True}
DARK = plain_material("dark", (0.02, 0.001, 0.3))
BACKENDS = ["native", "fragment"]


def lux_of(irradiance: Any) -> float:
    return LUX * float(np.dot(irradiance, WEIGHTS))


def floor(material: Material, *lights: Light) -> Scene:
    """A square metre about the origin is in the picture."""
    built = Builder().quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0))
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 0.02)
    return built.scene(view, lights, [material])


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("radius", [0.0, 0.5])
def test_a_lamp_above_a_floor(device: Device, backend: str, radius: float) -> None:
    power = (40.0, 20.0, 10.0)
    lamp = plain_light("lamp", "POINT", (1.5, 0, 2), power, radius=radius)
    images = render(device, floor(DARK, lamp), **SETTINGS, passes=32, photons=0, backend=backend)
    distance2 = 1.5**2 + 2**2
    exact = lux_of(np.array(power) / (4 * math.pi) / distance2 * 2 / math.sqrt(distance2))
    assert images["Illuminance"].shape == (16, 16, 1)
    assert images["Illuminance"].mean() == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_sky_on_a_plain(device: Device, backend: str) -> None:
    sky = (1.0, 0.5, 0.25)
    scene = floor(DARK, world_light("sky", sky))
    images = render(device, scene, **SETTINGS, photons=0, backend=backend)
    assert images["Illuminance"].mean() == pytest.approx(lux_of(np.pi * np.array(sky)), rel=1e-3)


@pytest.mark.parametrize("direct_by_photons", [False, True])
def test_indirect_light_counts(device: Device, direct_by_photons: bool) -> None:
    """In a grey sphere with a lamp in its middle: E / (1 - rho), on every side."""
    albedo, radius = 0.5, 1.0
    built = Builder().sphere((0, 0, 0), radius, subdivisions=5)
    lamp = plain_light("lamp", "POINT", (0, 0, 0), (4 * math.pi,) * 3)
    scene = built.scene(
        camera((0, -0.5, 0), (0, 1, 0), 60), [lamp], [plain_material("grey", (albedo,) * 3)]
    )
    settings = SETTINGS | {"passes": 8, "photons": 50_000, "radius": 0.4}
    images = render(device, scene, **settings, direct_by_photons=direct_by_photons)
    exact = lux_of((1 / (1 - albedo),) * 3)
    assert images["Illuminance"].mean() == pytest.approx(exact, rel=1e-2)


def test_nobody_pays_who_does_not_ask(device: Device) -> None:
    scene = cornell()
    asked = render(device, scene, **SETTINGS)
    images = render(device, scene, **SETTINGS | {"illuminance": False})
    assert "Illuminance" not in images
    np.testing.assert_array_equal(asked["Combined"], images["Combined"])


# False colours.


def test_limits_are_steps_of_the_scale() -> None:
    assert limits(480.0).tolist()[-4:] == pytest.approx([150.0, 200.0, 300.0, 500.0])
    assert limits(500.0)[-1] == pytest.approx(500.0) and limits(501.0)[-1] == pytest.approx(750.0)
    assert len(limits(1e-7)) == CLASSES and (np.diff(limits(1e-7)) > 0).all()


def test_lines_lie_between_steps() -> None:
    """A ramp crosses each step once: a black column there; and the legend is beside."""
    ramp = np.geomspace(11.0, 900.0, 300)
    picture = false_colour(np.tile(ramp, (220, 1)), most=1000.0)
    black = np.flatnonzero(~picture[100, 1:300].any(axis=1)) + 1
    crossed = [int(np.argmax(ramp > step)) for step in limits(1000.0) if 11 < step < 900]
    assert black.tolist() == crossed
    assert picture.shape[1] > 300 and (picture[:, 300:] == 255).all(axis=2).any()
    inside = false_colour(np.tile(ramp, (220, 1)), most=1000.0, legend_inside=True)
    assert inside.shape == (220, 300, 3)


@pytest.mark.parametrize("values", [0.0, np.nan, np.inf, 5.0])
def test_odd_pictures(values: float) -> None:
    for size in (1, 2, 33):
        assert false_colour(np.full((size, size), values)).shape[0] == size


def test_from_an_exr(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lux = np.linspace(1.0, 99.0, 48 * 40, dtype=np.float32).reshape(40, 48, 1)
    images = {"Combined": np.ones((40, 48, 4), np.float32), "Illuminance": lux}
    write_picture(tmp_path / "a.exr", images, {})
    np.testing.assert_array_equal(illuminance(tmp_path / "a.exr")[::-1], lux[..., 0])
    assert main([str(tmp_path / "a.exr"), "-o", str(tmp_path / "a.png")]) == 0
    assert "50.0 lx in the mean" in capsys.readouterr().out
    assert (tmp_path / "a.png").stat().st_size > 500


@pytest.mark.parametrize("what", ["missing", "text", "no pass", "folder", "name", "most"])
def test_what_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], what: str) -> None:
    path, output, more = tmp_path / "a.exr", tmp_path / "a.png", []
    if what == "text":
        path.write_text("no picture")
    elif what != "missing":
        write_picture(path, {"Combined": np.ones((4, 4, 4), np.float32)}, {})
    if what == "folder":
        output = tmp_path / "none" / "a.png"
    if what == "name":
        output = tmp_path / "a.exr2"
    if what == "most":
        more = ["--most", "-1"]
    assert main([str(path), "-o", str(output), *more]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1
    assert not output.exists()
