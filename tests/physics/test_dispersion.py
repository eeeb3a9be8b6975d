# SPDX-License-Identifier: GPL-3.0-or-later
"""Glass that disperses: a prism by Snell, wavelength for wavelength, for rays of the eye and for
photons; what is white stays white, and no energy is lost."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Lobe, Material, Scene, point_light, spot_light, world_light
from addon.photon.stage.needs import SceneNeeds
from addon.photon.stage.spectrum import BANDS, LONGEST, SHORTEST, WEIGHT_STEP, bands
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, camera, orthographic

WHITE = (1.0, 1.0, 1.0)
BLACK_WALL = Material("black", (1e-4,) * 3)
EMISSIVE = Material("emissive", (0.0, 0.0, 0.0), emission=WHITE)
INDEX, ABBE = 1.5168, 30.0
LINES = {"d": 0.58756, "F": 0.48613, "C": 0.65627}  # Fraunhofer's [um]
# A prism of 60 degrees, its edge along y; in x and z the middle of its left face, where a beam
# falls in that goes through it almost level, and where what leaves it is caught [m].
SIDE, WALL = 0.1, 3.0
FACE = np.array([-0.25 * SIDE, 0.25 * math.sqrt(3) * SIDE])
INCOMING = math.asin(INDEX * 0.5) - math.pi / 6
BEAM = np.array([math.cos(INCOMING), math.sin(INCOMING)])
SAMPLES = 64  # wavelengths of a band


def material(rough: bool = False, abbe: float = ABBE) -> Material:
    """White glass."""
    parameters: dict[str, Any] = {"ior": INDEX, "tint": WHITE, "open": 0.0, "dispersion": 1 / abbe}
    if rough:
        parameters |= {"alpha": 0.09, "switches": 5.0}
        return Material("rough", (0.0,) * 3, (Lobe("ggx_dispersive_glass", WHITE, parameters),))
    lobe = Lobe("dispersive_glass", WHITE, parameters | {"reflects": 2.0})
    return Material("glass", (0.0,) * 3, (lobe,))


def index_at(wavelength: Any) -> Any:
    """Cauchy's, of two terms, that has INDEX at d and ABBE."""
    lines = {line: 1.0 / at**2 for line, at in LINES.items()}
    slope = (INDEX - 1.0) / ABBE / (lines["F"] - lines["C"])
    return INDEX + slope * (1.0 / wavelength**2 - lines["d"])


def refracted(way: Any, normal: Any, ratio: float) -> tuple[Any, float]:
    """Where a ray goes on behind a face, and the share of it that does (Snell, Fresnel); `normal`:
    to where it comes from, `ratio`: of the index there over that behind."""
    cosine = -way @ normal
    behind = math.sqrt(1.0 - ratio**2 * (1.0 - cosine**2))
    across = (ratio * cosine - behind) / (ratio * cosine + behind)
    along = (cosine - ratio * behind) / (cosine + ratio * behind)
    onward = ratio * way + (ratio * cosine - behind) * normal
    return onward, 1.0 - 0.5 * (across**2 + along**2)


def through_prism(wavelength: float) -> tuple[float, float]:
    """Where the beam falls on the wall [m], and how much of it."""
    slant = math.cos(math.pi / 6)
    left, right = np.array([-slant, 0.5]), np.array([slant, 0.5])
    index = float(index_at(wavelength))
    inside, entering = refracted(BEAM, left, 1.0 / index)
    # To the right face, of which the prism's edge is a point.
    edge = np.array([0.0, 0.5 * math.sqrt(3) * SIDE])
    leaves = FACE + inside * ((edge - FACE) @ right) / (inside @ right)
    onward, leaving = refracted(inside, -right, index)
    return float(leaves[1] + onward[1] * (WALL - leaves[0]) / onward[0]), entering * leaving


def rainbow() -> tuple[Any, Any]:
    """Where the wavelengths of each band fall on the wall, and how much, (BANDS, SAMPLES) each."""
    ends, _ = bands()
    inner = (np.arange(SAMPLES) + 0.5) / SAMPLES
    of_bands = ends[:-1, None] + np.diff(ends)[:, None] * inner
    found = np.array([[through_prism(one) for one in band] for band in of_bands])
    return found[..., 0], found[..., 1]


def prism() -> Builder:
    """Of glass, the material 0."""
    height = 0.5 * math.sqrt(3) * SIDE
    section = [(-0.5 * SIDE, 0.0), (0.5 * SIDE, 0.0), (0.0, height)]
    vertices = [(x, y, z) for y in (-0.2, 0.2) for x, z in section]
    ends = [[0, 1, 2], [5, 4, 3]]
    sides = [[0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]]
    return Builder().add(vertices, ends + sides, 0, "prism")


def add_wall(built: Builder, low: float, high: float) -> Builder:
    """Of the material 1, between two heights [m]."""
    corners = (WALL, -0.5, low), (WALL, -0.5, high), (WALL, 0.5, high), (WALL, 0.5, low)
    return built.quad(*corners, 1, "wall")


def beam_from(distance: float) -> Any:
    """A point from which the beam comes."""
    x, z = FACE - distance * BEAM
    return np.array([x, 0.0, z])


def test_bands_are_white() -> None:
    """To the bit, also in the packed weights of lobes."""
    ends, colours = bands()
    steps = colours / WEIGHT_STEP
    assert (steps == np.rint(steps)).all() and colours.min() >= 0.0
    assert (np.rint(steps).sum(axis=0) * 4 == 511 * BANDS).all()
    assert (np.diff(ends) > 0).all() and ends[[0, -1]] == pytest.approx((SHORTEST, LONGEST))
    np.testing.assert_allclose(colours.mean(axis=1), 1.0, atol=WEIGHT_STEP)
    red, green, blue = (colours * ends[:-1, None]).mean(axis=0)
    assert blue < 0.47 < 0.52 < green < 0.56 < 0.58 < red
    given = (index_at(LINES["F"]), index_at(LINES["C"]))
    assert (INDEX - 1.0) / (given[0] - given[1]) == pytest.approx(ABBE)


@pytest.mark.parametrize("backend", ("native", "compute"))
def test_photons_through_a_prism(device: Device, backend: Any) -> None:
    """Each colour falls where Snell has it, to 1 % of the rainbow's length, as bright as it is."""
    direction = (BEAM[0], 0.0, BEAM[1])
    lamp = spot_light("lamp", tuple(beam_from(1.0)), WHITE, direction, size=0.004, blend=0.0)
    built = add_wall(prism(), -1.6, -0.4)
    scene = built.scene(camera((0, 0, 5), (0, 0, 0)), (lamp,), (material(), BLACK_WALL))
    settings = {"photons": 1 << 17, "passes": 1, "width": 8, "height": 8, "backend": backend}
    with rendered(device, scene, **settings) as renderer:
        assert renderer.photons
        place, deposit = renderer.photons.mapper.deposits.arrays()
        height = place[:, 2] * renderer.frame.scale + renderer.frame.centre[2]
        flux = deposit[:, :3] * renderer.frame.scale**2 / (0.5 * (1 - math.cos(0.002)))
    heights, shares = rainbow()
    _, colours = bands()
    length = np.ptp(heights)
    shown = flux / flux.sum(axis=1, keepdims=True)
    known = colours / colours.sum(axis=1, keepdims=True)
    kinds, of_band = np.unique(np.round(known, 6), axis=0, return_inverse=True)
    of_photon = np.abs(shown[:, None] - kinds).sum(axis=2).argmin(axis=1)
    assert np.abs(shown - kinds[of_photon]).max() < 1e-3
    for kind in range(len(kinds)):
        own, theirs = of_photon == kind, of_band.ravel() == kind
        expected = np.average(heights[theirs], weights=shares[theirs])
        assert np.average(height[own], weights=flux[own].mean(axis=1)) == pytest.approx(
            expected, abs=0.01 * length
        )
    for channel in range(3):
        weights = colours[:, channel, None] * shares
        expected = np.average(heights, weights=weights)
        found = np.average(height, weights=flux[:, channel])
        assert found == pytest.approx(expected, abs=0.01 * length)
        assert flux[:, channel].sum() == pytest.approx(weights.mean(), rel=0.02)


def test_eyes_through_a_prism(device: Device) -> None:
    """The share of each channel that falls below a height, by an emissive wall there."""
    heights, shares = rainbow()
    _, colours = bands()
    across = np.array([0.0, 1.0, 0.0])
    way = np.array([BEAM[0], 0.0, BEAM[1]])
    view = orthographic(beam_from(1.0), across, np.cross(-way, across), 0.002)
    for wavelength in (0.47, 0.55, 0.61):
        edge = through_prism(wavelength)[0]
        scene = add_wall(prism(), -1.6, edge).scene(view, (), (material(), EMISSIVE))
        settings = {"width": 16, "height": 16, "passes": 32, "photons": 0}
        image = render(device, scene, **settings)["Combined"][..., :3]
        expected = np.mean(colours[:, None] * (shares * (heights < edge))[..., None], axis=(0, 1))
        assert image.mean(axis=(0, 1), dtype=float) == pytest.approx(expected, abs=0.01)


def ball(rough: bool) -> tuple[Builder, tuple[Material, ...]]:
    """Of glass that disperses."""
    return Builder().sphere((0, 0, 0), 1.0, 0, subdivisions=5), (material(rough), BLACK_WALL)


@pytest.mark.parametrize("rough", (False, True), ids=("smooth", "rough, behind a sheet"))
def test_a_ball_is_white(device: Device, rough: bool) -> None:
    """In a world of one radiance it cannot be seen; of four times the passes the colours' error is
    half or less. Behind what is transparent, too, where chains weigh what shadow rays find."""
    built, materials = ball(rough)
    if rough:
        built.box((-2, -2, -2), (2, 2, 2), 2)
        materials += (Material("clear", (0.0,) * 3, (Lobe("transparent", WHITE, {}),)),)
    view = orthographic(np.array([0.0, -4.0, 0.0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 1)
    scene = built.scene(view, (world_light("world", WHITE),), materials)
    errors = []
    for passes in (8, 32):
        settings = {"width": 24, "height": 24, "passes": passes, "photons": 0, "mirror_depth": 48}
        image = render(device, scene, **settings)["Combined"][..., :3].astype(float)
        errors.append(np.std(image - image.mean(axis=2, keepdims=True)))
    assert image.mean(axis=(0, 1)) == pytest.approx(1.0, abs=0.012 if rough else 0.004)
    assert errors[1] < 0.6 * errors[0]


def test_photons_lose_nothing(device: Device) -> None:
    """Of all that a lamp beside a ball sends: what falls on black walls about both."""
    built, materials = ball(rough=False)
    built.box((-3, -3, -3), (3, 3, 3), 1, "walls")
    lamp = point_light("lamp", (2.0, 0.0, 0.0), WHITE, 0.0)
    scene = built.scene(camera((0, 0, 2.5), (0, 0, 0)), (lamp,), materials)
    settings = {"photons": 1 << 17, "passes": 1, "width": 8, "height": 8, "photon_bounces": 48}
    with rendered(device, scene, direct_by_photons=True, **settings) as renderer:
        assert fallen(renderer)[1] == pytest.approx(1.0, rel=0.005)


def test_what_has_none_compiles_none(device: Device) -> None:
    """Glass that disperses nothing is another lobe: its programs know no wavelength."""
    built, (dispersive, black) = ball(rough=False)
    plain = {**dispersive.lobes[0].parameters}
    del plain["dispersion"]
    clear = Material("clear", (0.0,) * 3, (Lobe("glass", WHITE, plain),))
    needs: list[SceneNeeds] = []
    for glass in (dispersive, clear):
        scene: Scene = built.scene(camera((0, -4, 0), (0, 0, 0)), (), (glass, black))
        with rendered(device, scene, photons=0) as renderer:
            needs.append(renderer.needs)
    for found, is_there in zip(needs, (True, False), strict=True):
        for defines in (found.eye_defines, found.photon_defines):
            assert ("DISPERSION" in defines) is is_there and ("TINTED" in defines) is is_there
        assert ("made/spectrum.glsl" in found.made) is is_there
