# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics that a scene switches off, and what stays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import ALL_RAYS, RAY_BITS, Lobe, Material, Scene, sun_light
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, camera, plain_light, plain_material, replace

from .test_glass import BLACK_WALL, WHITE, ball_lens, glass

OFF: dict[str, tuple[str, ...]] = {
    "none": ("reflective", "refractive"),
    "reflective": ("refractive",),
    "refractive": ("reflective",),
    "both": (),
}


def slab_and_mirror(caustics: tuple[str, ...]) -> Scene:
    """A floor under a slab of glass and a wall that only a mirror lights, each of 1 m^2."""
    built = Builder().box((-2, -2, 0), (2, 2, 0.1), 0, "slab")
    built.quad(
        (-0.5, -0.5, -0.1), (0.5, -0.5, -0.1), (0.5, 0.5, -0.1), (-0.5, 0.5, -0.1), 1, "floor"
    )
    built.quad((5, -0.5, 0), (6, -0.5, 1), (6, 0.5, 1), (5, 0.5, 0), 2, "mirror")
    built.quad((4, -0.5, 0), (4, 0.5, 0), (4, 0.5, 1), (4, -0.5, 1), 1, "wall")
    mirror = plain_material("mirror", (0.0,) * 3, WHITE)
    sun = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
    view = camera((0, 0, 5), (0, 0, 0))
    return replace(built.scene(view, (sun,), (glass(), BLACK_WALL, mirror)), caustics=caustics)


@pytest.mark.parametrize("backend", ("native", "fragment", "compute"))
def test_switches(device: Device, backend: str, no_panes: None) -> None:
    """What is left is what it was, and what is off is nothing."""
    found: dict[str, Any] = {}
    for name, caustics in OFF.items():
        scene, settings = slab_and_mirror(caustics), {"width": 8, "height": 8, "backend": backend}
        with rendered(device, scene, photons=1 << 16, passes=1, **settings) as renderer:
            found[name] = fallen(renderer)[[1, 3], 0]
    for name, caustics in OFF.items():
        floor, wall = found[name]
        assert floor == (pytest.approx(0.92308, rel=0.02) if "refractive" in caustics else 0.0)
        assert wall == (pytest.approx(1.0, rel=0.08) if "reflective" in caustics else 0.0)


def test_direct_light_by_photons_stays(device: Device) -> None:
    """Photons that come straight from the light are no caustic."""
    found = []
    for caustics in OFF.values():
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
        built.quad((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), 1)
        sun = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
        scene = built.scene(camera((0, 0, 5), (0, 0, 0)), (sun,), (BLACK_WALL, glass()))
        settings = {"photons": 1 << 14, "direct_by_photons": True}
        with rendered(device, replace(scene, caustics=caustics), **settings) as renderer:
            found.append(fallen(renderer)[0].tolist())
    assert found[0][0] == pytest.approx(4.0, rel=0.02) and found.count(found[0]) == len(OFF)


@pytest.mark.parametrize("hidden", [False, True])
def test_a_sheet_below_glass(device: Device, hidden: bool) -> None:
    """What it scatters of the light through glass is a caustic, too; through another sheet, which
    diffuse rays do not meet, it is not."""
    found = []
    for caustics in ((), ("reflective", "refractive")):
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0, "floor")
        built.quad((-3, -3, 1), (3, -3, 1), (3, 3, 1), (-3, 3, 1), 1, "sheet")
        built.quad((-3, -3, 2), (3, -3, 2), (3, 3, 2), (-3, 3, 2), 2, "above")
        sheet = Material("sheet", (0.0,) * 3, (Lobe("translucent", (0.5,) * 3, {}),))
        sun = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
        built.quad((7, 7, 2), (8, 7, 2), (8, 8, 2), (7, 8, 2), 3, "elsewhere")
        materials = BLACK_WALL, sheet, sheet if hidden else glass(), glass()
        scene = built.scene(camera((0, 0, 0.9), (0, 0, 0)), (sun,), materials)
        visible = np.full(4, ALL_RAYS, np.uint8)
        visible[2] -= RAY_BITS["diffuse"] * hidden
        scene = replace(scene, caustics=caustics, visible=visible)
        with rendered(device, scene, photons=1 << 14, passes=1) as renderer:
            found.append(fallen(renderer)[0, 0])
    off, on = found
    assert on > 0.1
    assert off == (pytest.approx(on, rel=0.02) if hidden else 0.0)


def test_sheets_that_scatter_evenly(device: Device) -> None:
    """No switch is for them: what comes through is neither a reflection nor refracted."""
    found = []
    for caustics in OFF.values():
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
        built.quad((-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1), 1)
        sheet = Material("sheet", (0.0,) * 3, (Lobe("translucent", (0.5,) * 3, {}),))
        sun = sun_light("sun", WHITE, (0.0, 0.0, -1.0))
        scene = built.scene(camera((0, 0, 5), (0, 0, 0)), (sun,), (sheet, BLACK_WALL))
        with rendered(device, replace(scene, caustics=caustics), photons=1 << 14) as renderer:
            found.append(fallen(renderer)[1].tolist())
    assert found[0][0] > 1.0 and found.count(found[0]) == len(OFF)


def test_unknown_ones_are_refused() -> None:
    with pytest.raises(SceneError, match="scene.caustics"):
        slab_and_mirror(("sparkling",)).check()


FRAMES = 24
FLOOR, REACH = -2.0, 0.9  # of the ball's shadow, which its caustic alone lights


def seen_on_floor(
    device: Device,
    angle: float = 0.0,
    along: float = 0.0,
    seed: int = 0,
    photons: int = 1 << 18,
    size: int = 64,
) -> float:
    """The flux [W] of what a ball of glass throws on a grey floor, by what a camera sees of it; the
    ball is so far along x."""
    built = Builder().sphere((along, 0, 0), 1.0, 0, "ball", subdivisions=5)
    built.quad((-3, -3, FLOOR), (3, -3, FLOOR), (3, 3, FLOOR), (-3, 3, FLOOR), 1, "floor")
    eye = np.array([4.33 * math.cos(angle), 4.33 * math.sin(angle), FLOOR + 2.5])
    view = camera(eye, (0, 0, FLOOR), 28)
    grey, sun = plain_material("floor", (0.2,) * 3), sun_light("sun", WHITE, (0.0, 0.0, -1.0))
    settings = {"width": size, "height": size, "passes": 8, "photons": photons, "seed": seed}
    scene = built.scene(view, (sun,), (glass(), grey))
    image = render(device, scene, radius_decay=2 / 3, **settings)["Indirect"][..., 0]
    left, right, bottom, top = view.window
    x, y = (low + (np.arange(size) + 0.5) / size * (high - low)
            for low, high in ((left, right), (bottom, top)))  # fmt: skip
    rays = np.stack([*np.meshgrid(x, y), -np.ones((size, size))], -1) @ view.matrix[:3, :3].T
    t = (FLOOR - eye[2]) / rays[..., 2]
    at = eye + t[..., None] * rays
    # A pixel of the window at distance 1 covers so much of the floor.
    area = (x[1] - x[0]) * (y[1] - y[0]) * t**3 / (eye[2] - FLOOR)
    there = np.hypot(at[..., 0] - along, at[..., 1]) < REACH
    return float((image * area)[there].sum() * math.pi / 0.2)


def test_animation(device: Device, thorough: bool) -> None:
    """A camera moves about a ball of glass that stands still: its caustic is as bright in each
    frame, to 0.5 %, and as bright as what comes through the ball."""
    if not thorough:
        pytest.skip("runs with --thorough")
    found = np.array([seen_on_floor(device, 0.04 * frame) for frame in range(FRAMES)])
    away = np.abs(found / found.mean() - 1.0).max()
    print(f"\nmean {found.mean():.4f} W, apart by {away:.3%}")
    assert away < 0.005
    through = ball_lens(-FLOOR, REACH) * math.pi * REACH**2
    assert found.mean() == pytest.approx(through, rel=0.02)


def test_moving_glass(device: Device, thorough: bool) -> None:
    """A ball of glass moves past a camera that stands still: its caustic goes with it, as bright as
    what comes through the ball. Frames of one seed differ as seeds of one frame do, not more."""
    frames, few = FRAMES if thorough else 2, {"photons": 1 << 16}
    found = np.array([seen_on_floor(device, along=0.013 * x, **few) for x in range(frames)])
    through = ball_lens(-FLOOR, REACH) * math.pi * REACH**2
    assert found == pytest.approx(through, rel=0.02)
    if not thorough:
        return
    seeds = np.array([seen_on_floor(device, seed=1 + x, **few) for x in range(frames)])
    print(f"\nframes {found.std() / found.mean():.3%}, seeds {seeds.std() / seeds.mean():.3%}")
    # The quotient of variances of 24 each is beyond 3 once in 200 times.
    assert found.var(ddof=1) < 3.0 * seeds.var(ddof=1)
    assert abs(found.mean() - seeds.mean()) < 4.0 * math.hypot(
        found.std() / math.sqrt(frames), seeds.std() / math.sqrt(frames)
    )


WAYS = ("native", "fragment", "compute", "resident")


def ball_and_mirror(caustics: tuple[str, ...]) -> Scene:
    """A ball of glass behind a clear sheet on a floor, a mirror that shows both, and a lamp."""
    built = Builder().sphere((0, 0, 1.1), 1.0, 0, "ball", subdivisions=4)
    built.quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0), 1, "floor")
    built.quad((-4, 4, 0), (4, 4, 0), (4, 4, 4), (-4, 4, 4), 2, "mirror")
    built.quad((-4, -3, 0), (4, -3, 0), (4, -3, 4), (-4, -3, 4), 3, "sheet")
    built.quad((-4, -4, 0), (-4, 4, 0), (-4, 4, 4), (-4, -4, 4), 1, "wall")
    grey, mirror = plain_material("grey", (0.5,) * 3), plain_material("mirror", (0.0,) * 3, WHITE)
    sheet = Material("sheet", (0.0,) * 3, (Lobe("transparent", (0.9, 0.8, 0.7), {}),))
    lamp = plain_light("lamp", "POINT", (2.0, 1.0, 3.5), (100.0, 90.0, 80.0))
    view = camera((0.5, -7, 3), (0, 0, 1), 50)
    scene = built.scene(view, (lamp,), (glass(), grey, mirror, sheet))
    return replace(scene, caustics=caustics)


@pytest.mark.thorough("resident")
@pytest.mark.parametrize("way", WAYS)
def test_the_pass(
    device: Device, way: str, monkeypatch: pytest.MonkeyPatch, not_aimed: None, thorough: bool
) -> None:
    """What is not in it is what a scene shows that has its caustics switched off, and what is asked
    for changes no bit of the picture."""
    if way in ("fragment", "compute") and not thorough:
        pytest.skip("runs with --thorough")
    if way == "resident":
        monkeypatch.setattr(device, "prefers_native", False)
    settings = {"width": 30, "height": 18, "photons": 1 << 13, "passes": 2}
    settings |= {"backend": "compute" if way == "resident" else way, "radius": 0.5}
    settings["boundary_correction"] = False  # tilted filters of a part may be below 0
    plain = render(device, ball_and_mirror(OFF["none"]), **settings)
    asked = render(device, ball_and_mirror(OFF["none"]), caustics=True, **settings)
    off = render(device, ball_and_mirror(OFF["both"]), **settings)
    assert "Caustics" not in plain
    if device.is_software:
        for name, image in plain.items():
            np.testing.assert_array_equal(asked[name], image)
    else:  # other programs may round otherwise, and a photon go another way
        assert asked["Combined"].mean() == pytest.approx(plain["Combined"].mean(), rel=0.05)
    caustics = asked["Caustics"]
    rest = asked["Combined"][..., :3] - caustics
    np.testing.assert_allclose(rest, off["Combined"][..., :3], rtol=1e-4, atol=1e-6)
    part = caustics.mean() / asked["Combined"][..., :3].mean()
    print(f"\n{way}: {part:.1%} of the light are caustics")
    assert part > 0.05 and caustics.min() >= 0.0
    assert (caustics <= asked["Indirect"] + asked["Mirror"] + 1e-6).all()


@pytest.mark.parametrize("way", WAYS)
def test_the_pass_of_lobes_that_gather(
    device: Device, way: str, monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    """A floor of rough metal that a mirror lights: all that photons bring is caustics."""
    if way != "native" and not thorough:
        pytest.skip("runs with --thorough")
    if way == "resident":
        monkeypatch.setattr(device, "prefers_native", False)
    parameters = {"alpha_x": 0.4, "alpha_y": 0.4, "turn": 0.0, "compensated": 1.0, "tint": WHITE}
    metal = Material("metal", (0.0,) * 3, (Lobe("ggx_metal", (0.8, 0.7, 0.6), parameters),))
    mirror = plain_material("mirror", (0.0,) * 3, WHITE)
    built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), 0, "floor")
    built.quad((-2, 2.5, 0), (2, 2.5, 0), (2, 2.5, 2), (-2, 2.5, 2), 1, "mirror")
    lamp = plain_light("lamp", "POINT", (0.0, 0.0, 2.0), (100.0,) * 3)
    scene = built.scene(camera((0, -0.5, 4), (0, 0, 0), 30), (lamp,), (metal, mirror))
    settings = {"width": 24, "height": 24, "photons": 1 << 14, "passes": 2}
    settings |= {"backend": "compute" if way == "resident" else way, "mirror_depth": 2}
    with rendered(device, scene, caustics=True, **settings) as renderer:
        assert renderer.needs.gathered_lobes
        images = renderer.images()
    assert images["Indirect"].mean() > 0.01
    together = images["Indirect"] + images["Mirror"]
    np.testing.assert_allclose(images["Caustics"], together, rtol=1e-4, atol=1e-6)


def test_what_is_not_asked_for_costs_nothing(device: Device) -> None:
    """Neither programs nor launches; and where nothing casts any, an image of none."""
    scene, counts = ball_and_mirror(OFF["none"]), {}
    for asked in (False, True):
        with rendered(device, scene, photons=4096, caustics=asked) as renderer:
            counts[asked] = renderer.launches()
            for defines in (renderer.needs.photon_defines, renderer.needs.combine_defines):
                assert ("CAUSTICS" in defines) is asked
    assert "combine_caustics" not in counts[False] and counts[True]["combine_caustics"] > 0
    assert counts[False]["gather"] < counts[True]["gather"]
    grey = Material("grey", (0.5,) * 3)
    plain = replace(scene, materials=(grey,) * len(scene.materials))
    with rendered(device, plain, photons=4096, caustics=True) as renderer:
        assert not renderer.needs.caustics and not renderer.images()["Caustics"].any()
