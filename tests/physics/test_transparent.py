# SPDX-License-Identifier: GPL-3.0-or-later
"""Transparent surfaces: eyes' rays, shadow rays and photons go straight on, filtered."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import (
    ALL_RAYS,
    RAY_BITS,
    Instruction,
    Light,
    Lobe,
    Material,
    Medium,
    Result,
    Scene,
    area_light,
    phong,
    point_light,
    sun_light,
    world_light,
)
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, camera, plain_material

GREY = plain_material("grey", (0.5, 0.5, 0.5))
FILTER = (0.9, 0.6, 0.3)
BACKENDS = ["fragment", "compute", "native"]
QUICK = ["fragment", "native", pytest.param("compute", marks=pytest.mark.thorough)]
SUN = sun_light("sun", (2.0, 2.0, 2.0), (0.3, 0.2, -1.0))


def filtering(colour: Any, diffuse: Any = (0.0, 0.0, 0.0)) -> Material:
    return Material("filter", diffuse, (Lobe("transparent", colour),))


def stacked(layers: int, material: Material, lights: Any = (SUN,)) -> Scene:
    """A floor under so many sheets, seen from above through them all."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0, "floor")
    for number in range(layers):
        z = 0.5 + 0.02 * number
        built.quad((-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z), 1)
    return built.scene(camera((0.1, 0.2, 3), (0, 0, 0), 20), lights, (GREY, material))


def picture(device: Device, scene: Scene, backend: str = "auto", **settings: Any) -> Any:
    settings = {
        "passes": 4,
        "photons": 2000,
        "transparent_depth": 64,
        "backend": backend,
    } | settings
    return render(device, scene, width=16, height=16, **settings)["Combined"].astype(float)


@pytest.mark.stability(70)
@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("layers", (1, 20))
def test_sheets_filter_what_is_seen_and_what_lights(
    device: Device, backend: str, layers: int
) -> None:
    """Each twice: what the sun brings, and what the eye sees of that."""
    colour = np.array(FILTER) ** (1 / layers)
    bare = picture(device, stacked(0, GREY), backend)[..., :3].mean(axis=(0, 1))
    seen = picture(device, stacked(layers, filtering(tuple(colour))), backend)
    assert seen[..., :3].mean(axis=(0, 1)) == pytest.approx(bare * np.array(FILTER) ** 2, rel=5e-3)
    assert (seen[..., 3] == 1).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_nodes_filter_as_numbers_do(device: Device, backend: str) -> None:
    """A sheet over one half of a floor and under a plate: of what is beside it one look tells the
    light, of what is below it a second one that knows nodes."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    built.quad((-1, -1, 0.3), (0, -1, 0.3), (0, 1, 0.3), (-1, 1, 0.3), 1)
    built.quad((-0.3, -0.3, 0.5), (0.2, -0.3, 0.5), (0.2, 0.3, 0.5), (-0.3, 0.3, 0.5), 0)
    program = (Instruction("combine", (*((x,) * 4 for x in FILTER), (1.0,) * 4)),)
    lobe = Lobe("transparent", (1.0,) * 3, varying={"colour": Result(0)})
    by_nodes = Material("filter", (0.0,) * 3, (lobe,), program=program)
    lights = SUN, area_light("lamp", (0.0, 0.0, 1.9), (9.0,) * 3, size=(0.6, 0.6))
    pictures, launches = [], []
    for material in (filtering(FILTER), by_nodes):
        scene = built.scene(camera((2, 1, 3), (0, 0, 0), 40), lights, (GREY, material))
        settings: Any = {"passes": 3, "photons": 0, "backend": backend, "illuminance": True}
        with rendered(device, scene, width=16, height=16, **settings) as renderer:
            pictures.append(renderer.images(("Direct", "Illuminance")))
            launches.append(renderer.launches().get("direct", 0))
    for name, image in pictures[0].items():
        assert image.mean() > 0.1
        np.testing.assert_allclose(pictures[1][name], image, rtol=1e-4, atol=1e-5)
    assert backend == "native" or launches[1] == 2 * launches[0] > 0


@pytest.mark.parametrize("seed", range(4))
def test_dark_sheets_let_the_same_through_in_each_pass(device: Device, seed: int) -> None:
    """What the eye sees through two of them carries little: each pixel's ray goes on by its own
    chance, so no pass lacks the picture."""
    scene = stacked(2, filtering((0.2,) * 3))
    few = picture(device, scene, passes=1, seed=seed)[..., :3].mean()
    bare = picture(device, stacked(0, GREY))[..., :3].mean()
    assert few == pytest.approx(bare * 0.2**4, rel=0.15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_no_bounce_at_all(device: Device, monkeypatch: Any, backend: str) -> None:
    """Neither straight on nor by lobes: sheets are black."""
    monkeypatch.setattr(device, "prefers_native", backend == "native")
    scene = stacked(1, filtering((0.9,) * 3))
    seen = picture(device, scene, backend, transparent_depth=0, mirror_depth=0)
    assert seen[..., :3].max() == 0.0


@pytest.mark.stability(70)
@pytest.mark.parametrize("backend", BACKENDS)
def test_too_many_sheets_are_opaque(device: Device, backend: str) -> None:
    """The eye passes five, and as many are before the sun: it counts both, as Cycles does."""
    scene = stacked(5, filtering((1.0,) * 3))
    assert picture(device, scene, backend, transparent_depth=10)[..., :3].mean() > 0.1
    assert picture(device, scene, backend, transparent_depth=9)[..., :3].max() == 0.0


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_stops_lamps_lets_the_world_through(device: Device, backend: str) -> None:
    """By shadow rays and by photons: below such a sheet a floor has the world's light alone, as
    another sheet of the colour filters it."""
    lamp = area_light("lamp", (0.0, 0.0, 1.9), (9.0,) * 3, size=(0.6, 0.6))
    world = world_light("world", (1.0, 1.0, 1.0))
    stopping = replace(filtering(FILTER), shades_lamps=True)
    settings: Any = {"backend": backend, "photons": 5000, "passes": 2}
    for by_photons in (False, True):
        settings["direct_by_photons"] = by_photons
        lit = picture(device, stacked(1, filtering(FILTER), (SUN, lamp, world)), **settings)
        only = picture(device, stacked(1, filtering(FILTER), (world,)), **settings)
        seen = picture(device, stacked(1, stopping, (SUN, lamp, world)), **settings)
        assert lit[..., :3].mean() > 1.5 * only[..., :3].mean() > 0.1
        assert seen[..., :3].mean(axis=(0, 1)) == pytest.approx(
            only[..., :3].mean(axis=(0, 1)), rel=0.03
        )
        dark = picture(device, stacked(1, stopping, (SUN, lamp)), **settings)
        assert dark[..., :3].max() == 0.0


PANE = Lobe("glass", (1.0,) * 3, {"ior": 1.5, "tint": (1.0,) * 3, "reflects": 1.0, "open": 0.0})
GLASS = Material("glass", (0.0,) * 3, (PANE,))
HIDDEN = 3  # of materials below: a sheet that no shadow ray meets, nor any of a lobe


def two_sheets(over: int, under: int, lights: Any) -> Scene:
    """A floor under two sheets of materials."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    for z, worn in ((0.7, over), (0.5, under)):
        built.quad((-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z), worn)
    stops = replace(filtering(FILTER), shades_lamps=True)
    materials = (GREY, filtering(FILTER), stops, GREY)
    scene = built.scene(camera((0, -1.5, 0.2), (0, 0, 0.1), 40), lights, materials)
    rays = [RAY_BITS["camera"] if worn == HIDDEN else ALL_RAYS for worn in (0, over, under)]
    return replace(scene, visible=np.array(rays, np.uint8))


@pytest.mark.parametrize("by_photons", (False, True))
@pytest.mark.parametrize("over, under", ((1, 2), (2, 1), (HIDDEN, 2), (2, HIDDEN)))
@pytest.mark.thorough("fragment", "compute", "False", "2-3-")
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_stops_lamps_beside_another_sheet(
    device: Device, monkeypatch: Any, backend: str, over: int, under: int, by_photons: bool
) -> None:
    """Before it and behind it, transparent or hidden: nothing of a lamp comes through both."""
    monkeypatch.setattr(device, "prefers_native", backend == "native")
    settings: Any = {"photons": 20000, "direct_by_photons": by_photons}
    lamp = area_light("lamp", (0.0, 0.0, 1.9), (9.0,) * 3, size=(0.6, 0.6))
    dark = picture(device, two_sheets(over, under, (SUN, lamp)), backend, **settings)
    assert dark[..., :3].max() == 0.0
    world = world_light("world", (1.0, 1.0, 1.0))
    seen = picture(device, two_sheets(over, under, (SUN, lamp, world)), backend, **settings)
    passing = (1 if worn == 2 else worn for worn in (over, under))
    only = picture(device, two_sheets(*passing, (world,)), backend, **settings)
    means = (image[..., :3].mean(axis=(0, 1)) for image in (seen, only))
    assert next(means) == pytest.approx(next(means), rel=0.03)


def plate_over_sheet() -> Builder:
    """A floor under a sheet of material 1 under a plate of material 2."""
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
    built.quad((-2, -2, 0.5), (2, -2, 0.5), (2, 2, 0.5), (-2, 2, 0.5), 1)
    return built.box((-2, -2, 1.4), (2, 2, 1.5), 2)


@pytest.mark.thorough("nodes", "mesh-True", "absorption", "many-False")
@pytest.mark.parametrize("by_photons", (False, True))
@pytest.mark.parametrize("case", ("nodes", "absorption", "mesh", "many"))
@pytest.mark.parametrize("backend", QUICK)
def test_what_stops_lamps_stops_all_of_them(
    device: Device, monkeypatch: Any, backend: str, case: str, by_photons: bool
) -> None:
    """By whatever shadow rays pass it, and whatever they go to."""
    monkeypatch.setattr(device, "prefers_native", backend == "native")
    settings: Any = {"photons": 5000, "direct_by_photons": by_photons, "passes": 1}
    lights: tuple[Light, ...] = (area_light("lamp", (0, 0, 1.2), (9.0,) * 3, size=(0.6, 0.6)),)
    lit, emission = filtering(FILTER), (0.0, 0.0, 0.0)
    clear = (Lobe("transparent", (1.0,) * 3),)
    if case == "nodes":
        program = (Instruction("combine", (*((x,) * 4 for x in FILTER), (1.0,) * 4)),)
        lobe = Lobe("transparent", (1.0,) * 3, varying={"colour": Result(0)})
        lit = Material("filter", (0.0,) * 3, (lobe,), program=program)
    elif case == "absorption":
        lit = replace(lit, medium=Medium((0.1, 0.2, 0.3)))
    elif case == "mesh":
        lights, emission = (), (9.0,) * 3
    elif case == "many":
        places = np.random.default_rng(1).uniform(-0.9, 0.9, (300, 2))
        lights = tuple(point_light(f"{x}", (x, y, 1.2), (0.5,) * 3) for x, y in places)
    found = []
    for material in (lit, replace(lit, shades_lamps=True)):
        assert material.filters_no_lamps == bool(found)
        materials = (GREY, material, Material("over", (0.0,) * 3, clear, emission))
        scene = plate_over_sheet().scene(camera((0, -1.5, 0.2), (0, 0, 0.1), 40), lights, materials)
        found.append(picture(device, scene, backend, **settings)[..., :3])
    assert found[0].mean() > 0.01 and found[1].max() == 0.0


@pytest.mark.thorough("fragment", "native-True")
@pytest.mark.parametrize("by_photons", (False, True))
@pytest.mark.parametrize("backend", QUICK)
def test_what_stops_lamps_stops_no_caustics(
    device: Device, monkeypatch: Any, backend: str, by_photons: bool
) -> None:
    """The sun through a pane comes through such a sheet, too, as in Cycles, whose rays find it by
    glass: no shadow ray does."""
    monkeypatch.setattr(device, "prefers_native", backend == "native")
    settings: Any = {"photons": 20000, "direct_by_photons": by_photons, "passes": 4}
    found = []
    for stops in (False, True):
        materials = (GREY, replace(filtering(FILTER), shades_lamps=stops), GLASS)
        view = camera((0, -1.5, 0.2), (0, 0, 0.1), 40)
        scene = plate_over_sheet().scene(view, (SUN,), materials)
        found.append(picture(device, scene, backend, **settings)[..., :3].mean(axis=(0, 1)))
    assert found[1] == pytest.approx(found[0], rel=0.05)


ROUGH = {
    "rough diffuse": Lobe("oren_nayar", (0.8,) * 3, {"diffuse_roughness": 1.0}),
    "translucent": Lobe("translucent", (0.8,) * 3),
    "gloss": phong((0.8,) * 3, 5.0),
    "mirror": phong((0.8,) * 3),
}


@pytest.mark.thorough("translucent", "gloss")
@pytest.mark.parametrize("kind", ROUGH)
def test_what_stops_lamps_lets_delta_lobes_see_them(device: Device, kind: str) -> None:
    """A floor and a wall wholly below such a sheet: of lobes a mirror alone throws light on."""
    found = []
    for stops in (False, True):
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 2)
        z = -0.9 if kind == "translucent" else 0.9
        built.quad((-1, 1, 0), (1, 1, 0), (1, 1, z), (-1, 1, z))
        built.quad((-9, -9, 1), (9, -9, 1), (9, 9, 1), (-9, 9, 1), 1)
        sheet = replace(filtering(FILTER), shades_lamps=stops)
        view = camera((0, -0.9, z / 2), (0, 1, z / 2), 40)
        floor = Material("floor", (0.0,) * 3, (ROUGH[kind],))
        scene = built.scene(view, (SUN,), (GREY, sheet, floor))
        images = render(device, scene, width=16, height=16, passes=2, photons=20000)
        found.append(images["Indirect"][..., :3].mean())
    assert found[0] > 0.005
    assert found[1] == (pytest.approx(found[0], rel=0.02) if kind == "mirror" else 0.0)


@pytest.mark.parametrize("hidden", ("sheet", "lamp"))
def test_what_stops_no_shadow_ray_counts_once(device: Device, hidden: str) -> None:
    """A sheet that shadow rays do not meet, or under a sun that casts no shadow, changes nothing of
    what comes through glass below."""
    sun = replace(SUN, casts_shadow=hidden != "lamp")
    found = []
    for stops in (False, True):
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
        built.quad((-2, -2, 1.7), (2, -2, 1.7), (2, 2, 1.7), (-2, 2, 1.7), 1)
        built.box((-2, -2, 1.4), (2, 2, 1.5), 2)
        sheet = replace(filtering(FILTER), shades_lamps=stops)
        scene = built.scene(camera((0, -1.5, 0.2), (0, 0, 0.1), 40), (sun,), (GREY, sheet, GLASS))
        rays = np.full(3, ALL_RAYS, np.uint8)
        rays[1] -= RAY_BITS["shadow"] * (hidden == "sheet")
        scene = replace(scene, visible=rays)
        found.append(picture(device, scene, photons=20000, passes=4)[..., :3].mean(axis=(0, 1)))
    assert found[0].min() > 0.05 and found[1] == pytest.approx(found[0], rel=0.02)


@pytest.mark.thorough("compute")
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_stops_lamps_lets_through_what_is_scattered(device: Device, backend: str) -> None:
    """A wall behind it that a lamp lights lights what is before it; the lamp itself does not."""
    stopping = replace(filtering(FILTER), shades_lamps=True)
    found = []
    for material in (filtering(FILTER), stopping):
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 0)
        built.quad((-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2), 0)
        built.quad((-1, -1, 0.5), (1, -1, 0.5), (1, 0.999, 0.5), (-1, 0.999, 0.5), 1)
        lamp = area_light("lamp", (0.0, 0.9, 1.5), (9.0,) * 3, size=(0.1, 0.1))
        scene = built.scene(camera((0, -3, 0.3), (0, 0, 0.1), 30), (lamp,), (GREY, material))
        found.append(picture(device, scene, backend, photons=20000)[..., :3].mean())
    assert 0.2 * found[0] < found[1] < 0.8 * found[0]


@pytest.mark.thorough
def test_light_is_seen_and_lights_as_through_nothing(device: Device) -> None:
    """Clear sheets change nothing: lamps seen through them and in rough metal."""
    alpha = {"alpha_x": 0.1, "alpha_y": 0.1, "turn": 0.0, "compensated": 1.0}
    metal = Material("metal", (0.0,) * 3, (Lobe("ggx", (0.8,) * 3, alpha),))
    clear = filtering((1.0,) * 3)
    lamp = area_light("lamp", (0.0, 0.0, 1.9), (9.0,) * 3, size=(0.6, 0.6))
    found = []
    for sheets in (False, True):
        built = Builder().box((-1, -1, 0), (1, 1, 2), 0, skip="-y +z")
        built.quad((-1, -1, 0.05), (1, -1, 0.05), (1, 0.9, 0.3), (-1, 0.9, 0.3), 1)
        if sheets:
            for z in (0.7, 1.2):
                built.quad((-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z), 2)
            built.quad((-2, -1.5, -1), (2, -1.5, -1), (2, -1.5, 3), (-2, -1.5, 3), 2)
        world = world_light("world", (0.2, 0.3, 0.4))
        scene = built.scene(camera((0, -4, 1), (0, 0, 1), 40), (lamp, world), (GREY, metal, clear))
        found.append(picture(device, scene, passes=16, photons=30000)[..., :3].mean(axis=(0, 1)))
    assert found[1] == pytest.approx(found[0], rel=0.012)


@pytest.mark.stability(70)
@pytest.mark.parametrize("backend", BACKENDS)
def test_alpha_of_what_is_behind(device: Device, backend: str) -> None:
    """A half transparent sheet over nothing is half there; the world is seen through it unless the
    film is transparent."""
    built = Builder().quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0), 0)
    half = filtering((0.5,) * 3, (0.25,) * 3)
    lights = (world_light("world", (1.0, 1.0, 1.0)),)
    scene = built.scene(camera((0, 0, 3), (0, 0, 0), 20), lights, (half,))
    seen = picture(device, scene, backend, transparent=True)
    # Of white light from everywhere a sheet shows its albedo.
    assert seen.mean(axis=(0, 1)) == pytest.approx([0.25] * 3 + [0.5], abs=0.01)
    seen = picture(device, scene, backend)
    assert seen.mean(axis=(0, 1)) == pytest.approx([0.75] * 3 + [1.0], abs=0.01)


@pytest.mark.stability(70)
@pytest.mark.parametrize("backend", BACKENDS)
def test_photons_pass(device: Device, backend: str) -> None:
    """Directly lit, nothing lands; bounced off a wall, what a sheet lets through does."""
    settings: Any = {"photons": 1 << 18, "passes": 1, "width": 8, "height": 8, "backend": backend}
    scene = stacked(2, filtering(FILTER))
    with rendered(device, scene, **settings) as renderer:
        assert not fallen(renderer).any()
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        filtered = fallen(renderer)[0]
    with rendered(device, stacked(0, GREY), direct_by_photons=True, **settings) as renderer:
        bare = fallen(renderer)[0]
    assert filtered / bare == pytest.approx(np.array(FILTER) ** 2, rel=0.05)
