# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of glass and metal against a light tracer in numpy, and one way of tracing against
another. Cycles finds no caustic of so small a lamp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.scene import Material, Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.bench.chart.contenders.cycles import open_scene
from tests.bench.chart.measure import mean_of, squared_errors
from tests.bench.chart.scenes import SIZE, read_reference
from tests.measure import render, rendered, replace

from .cycles import open_blend
from .light_tracer import arrivals, is_caster

pytestmark = pytest.mark.blender


@dataclass(frozen=True)
class Caustic:
    """Where to look: a ball about all glass and metal; of what it falls on a rectangle at a
    height [m]."""

    middle: tuple[float, float, float]
    radius: float
    low: tuple[float, float]
    high: tuple[float, float]
    height: float
    share: float  # of all that comes by way of glass or metal that falls there, about


CAUSTICS = {
    "wine_glass": Caustic((0, 0, 0.065), 0.075, (-0.05, -0.15), (0.15, 0.05), 0.0, 0.7),
    "ring": Caustic((0.004, 0.008, 0.0026), 0.033, (-0.03, -0.015), (0.036, 0.03), 0.0, 0.9),
    "pool": Caustic((0, 0, 0), 2.6, (-1.6, -1.4), (1.9, 1.2), -1.2, 0.77),
}
# Strict relMSE after 16 and 64 passes against references by other methods, which
# tests/bench/references.py makes. wine_glass's are mostly red specks, by photons that the table
# sends through the wine.
ERRORS = {
    "wine_glass": (2.6e-2, 1.23e-2),
    "pool": (2.2e-3, 1.13e-3),
    "ring": (3.9e-3, 1.88e-3),
    "glass_in_mirror": (9.9e-3, 4.5e-3),
    "sunlit_window": (1.5e-3, 5.0e-4),
    "glass_bulb": (3.8e-3, 1.83e-3),
    "frosted_glass": (1.8e-2, 4.9e-3),
}
CELLS = 6  # a side
RAYS, PHOTONS = 1 << 19, 1 << 18
AIMED = 16  # from this pass on photons of a single lamp start where they count


def by_the_lamp(scene: Scene) -> Scene:
    """Without a world, and all else than glass and metal black: what falls there ends there."""
    black = Material("black", (1e-4,) * 3)
    materials = tuple(x if is_caster(x) else replace(black, name=x.name) for x in scene.materials)
    lamps = tuple(light for light in scene.lights if light.kind != "world")
    return replace(scene, materials=materials, lights=lamps)


def in_cells(at: Any, flux: Any, where: Caustic) -> Any:
    """(CELLS, CELLS, 3): the flux [W] that falls on each."""
    on = np.abs(at[:, 2] - where.height) < 1e-4 * where.radius + 1e-6
    edges = [np.linspace(a, b, CELLS + 1) for a, b in zip(where.low, where.high, strict=True)]
    found = [np.histogram2d(*at[on, :2].T, edges, weights=flux[on, c])[0] for c in range(3)]
    return np.stack(found, -1)


@pytest.mark.thorough("ring", "pool")
@pytest.mark.parametrize("name", CAUSTICS)
def test_against_a_light_tracer(device: Device, name: str) -> None:
    """What falls where: 1 % in all, and 4 % of it at most elsewhere."""
    scene, where = by_the_lamp(open_blend(name, 16)), CAUSTICS[name]
    found = arrivals(scene, scene.lights[0], RAYS, where.middle, where.radius)
    theirs = in_cells(found.at, found.flux, where)
    settings = {"width": 16, "height": 16, "photons": PHOTONS, "first_pass": AIMED, "passes": 1}
    with rendered(device, scene, photon_bounces=24, **settings) as renderer:
        assert renderer.photons
        place, deposit = renderer.photons.mapper.deposits.arrays()
        scale, centre = renderer.frame.scale, np.asarray(renderer.frame.centre)
    ours = in_cells(place[:, :3] * scale + centre, deposit[:, :3] * scale**2, where)
    ratio = ours.sum(axis=(0, 1)) / theirs.sum(axis=(0, 1))
    elsewhere = 0.5 * np.abs(ours - theirs).sum() / theirs.sum()
    share = theirs.sum() / found.flux.sum()
    print(f"\n{name}: in all {ratio - 1}, elsewhere {elsewhere:.2%}, there {share:.0%}")
    assert share == pytest.approx(where.share, abs=0.1)
    assert ratio == pytest.approx(1.0, abs=0.01) and elsewhere < 0.04


@pytest.mark.parametrize("name", CAUSTICS)
@pytest.mark.thorough  # tests/physics holds each backend to closed forms, of glass, too
def test_ways_agree(device: Device, name: str, thorough: bool, not_aimed: None) -> None:
    """Fragment and compute programs give the same bits, and the native core's rays the same picture
    but where rounding takes one another way; where photons are aimed it may aim them otherwise."""
    if not thorough and name != "ring":
        pytest.skip("runs with --thorough")
    scene = open_blend(name, 24)
    settings = {"width": 24, "height": 24, "photons": 1 << 17, "passes": 1, "seed": 1}
    settings["estimator"] = "gather"
    pictures = {
        backend: render(device, scene, backend=backend, **settings)["Combined"]
        for backend in ("fragment", "compute", "native")
    }
    np.testing.assert_array_equal(pictures["fragment"], pictures["compute"])
    native, fragment = pictures["native"], pictures["fragment"]
    same = np.isclose(native, fragment, rtol=1e-3, atol=1e-5).all(axis=-1)
    print(f"\n{name}: {same.mean():.2%} of pixels alike, means {native.mean() / fragment.mean()}")
    # Of a pass over waves, where radii are small, photons that rounding sends elsewhere are seen.
    assert same.mean() > (0.93 if name == "pool" else 0.99)
    assert native.mean() == pytest.approx(fragment.mean(), rel=0.01)


@pytest.mark.parametrize("name", ERRORS)
def test_converges_to_what_others_find(device: Device, name: str, thorough: bool) -> None:
    """Through glass and water, by metal, through frosted glass, in a mirror, out of a bulb."""
    if not thorough and name != "glass_in_mirror":
        pytest.skip("runs with --thorough")
    last, errors = 64 if thorough else 16, []
    reference, scene = read_reference(name), open_scene(name, SIZE)
    renderer = prepare(scene, Settings(width=SIZE, height=SIZE, passes=last), device)
    try:
        for passes in range(1, last + 1):
            renderer.render_pass()
            if passes in (16, 64):
                picture = renderer.images(["Combined"])["Combined"][..., :3]
                errors.append(mean_of(squared_errors(picture, reference)).value)
    finally:
        renderer.release()
    print(f"\n{name}: {errors}")
    for found, known in zip(errors, ERRORS[name], strict=False):
        assert found < 1.5 * known
