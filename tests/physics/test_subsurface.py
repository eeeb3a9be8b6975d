# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that scatters below surfaces."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.scene import (
    ALL_RAYS,
    RAY_BITS,
    Instruction,
    Lobe,
    Material,
    Result,
    phong,
    world_light,
)
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, camera, orthographic, plain_light, plain_material

BACKENDS = ("native", "compute", "fragment")
WHITE, BLACK = (1.0,) * 3, (0.0,) * 3
ALBEDO = 51 / 255, 153 / 255, 204 / 255  # which 8 bits hold


def scattering(radius: float, albedo: Any = ALBEDO, **more: float) -> Material:
    """A surface below which light goes so far without being scattered [m]."""
    parameters: dict[str, Any] = {f"radius_{channel}": radius for channel in "rgb"}
    parameters |= {"entry": 0.0, "albedo": albedo, "ior": 1.5} | more
    return Material("scattering", BLACK, (Lobe("subsurface", albedo, parameters),))


def of_scattering(albedo: Any) -> Any:
    """The share of one scattering that gives a surface such an albedo: Cycles' fit."""
    albedo = np.asarray(albedo)
    many = 1.8260523782 * np.arctan(5.1124679 * albedo) ** 1.09686102424
    few = 0.496310210422 * np.arctan(4.23500904 * albedo) ** 2.40602999408
    return many + albedo**0.25 * (few - many)


def of_later_scattering(albedo: Any) -> Any:
    """The same since Blender 5.2."""
    a = np.asarray(albedo)
    root = np.sqrt(9.59217 + 41.6808 * a + 17.7126 * a * a)
    return 1.0 - (4.20863 * a - root + 4.09712) ** 2


def seen_from_above(albedo: float, share: Any = of_scattering) -> float:
    """What comes out along the normal of a half space in even light of 1: 1 - sqrt(1 - w) H(1) of
    Chandrasekhar's H, Radiative Transfer (1960), sec. 33, for isotropic scattering of albedo w."""
    w = float(share(albedo))
    nodes, weights = np.polynomial.legendre.leggauss(64)
    at, weights = (nodes + 1) / 2, weights / 2
    h: NDArray[np.float64] = np.ones(64)

    def next_h(cosine: Any) -> Any:
        inner = (weights * at * h / (np.asarray(cosine)[..., None] + at)).sum(axis=-1)
        return 1.0 / (math.sqrt(1.0 - w) + w / 2 * inner)

    for _ in range(200):
        h = next_h(at)
    return 1.0 - math.sqrt(1.0 - w) * float(next_h(1.0))


def half_space() -> Builder:
    return Builder().box((-9, -9, -9), (9, 9, 0), 0)


def from_above(width: float = 1.0) -> Any:
    return orthographic((0, 0, 2), (1, 0, 0), (0, 1, 0), width)


def mean_of(device: Device, scene: Any, **settings: Any) -> Any:
    given = {"width": 32, "height": 32, "passes": 32, "photons": 500, **settings}
    return render(device, scene, **given)["Combined"][..., :3].mean(axis=(0, 1), dtype=float)


@pytest.mark.parametrize("backend", BACKENDS)
def test_half_space(device: Device, backend: str) -> None:
    """In even light it is as bright as Chandrasekhar's H says."""
    scene = half_space().scene(from_above(), (world_light("World", WHITE),), (scattering(0.02),))
    found = mean_of(device, scene, backend=backend)
    assert found == pytest.approx([seen_from_above(x) for x in ALBEDO], rel=0.01)


def test_half_space_since_blender_5_2(device: Device) -> None:
    """By the other way to tell what one scattering leaves."""
    material = scattering(0.02, entry=4.0)
    scene = half_space().scene(from_above(), (world_light("World", WHITE),), (material,))
    expected = [seen_from_above(x, of_later_scattering) for x in ALBEDO]
    assert mean_of(device, scene) == pytest.approx(expected, rel=0.01)


def test_nothing_is_lost(device: Device) -> None:
    """A ball that absorbs nothing can't be seen in even light."""
    scene = (
        Builder()
        .sphere((0, 0, 0), 1.0, 0)
        .scene(
            camera((0, -4, 0), (0, 0, 0), 25),
            (world_light("World", WHITE),),
            (scattering(0.7, WHITE),),
        )
    )
    assert mean_of(device, scene) == pytest.approx(1.0, rel=0.005)


@pytest.mark.parametrize("backend", BACKENDS)
def test_where_photons_land(device: Device, backend: str) -> None:
    """What they bring comes out as if it were Lambert's, but for the walk's share."""
    settings = {"direct_by_photons": True, "photons": 50000, "backend": backend, "passes": 16}
    lamp = plain_light("lamp", "POINT", (1.5, 0, 1.6), (50.0,) * 3)
    plain, below = (
        mean_of(device, half_space().scene(from_above(), (lamp,), (material,)), **settings)
        for material in (plain_material("plain", ALBEDO), scattering(0.02))
    )
    share = np.array([seen_from_above(x) / x for x in ALBEDO])
    np.testing.assert_allclose(below / plain, share, rtol=0.03)


def test_photons_leave_as_by_lambert(device: Device) -> None:
    """For they know no walks: a wall beside it is as bright."""
    lamp = plain_light("lamp", "POINT", (1.5, 0, 1.6), (50.0,) * 3)
    found = []
    for material in (plain_material("plain", ALBEDO), scattering(0.02)):
        built = half_space().quad((2, -9, 0), (2, -9, 4), (2, 9, 4), (2, 9, 0), 1)
        materials = material, plain_material("wall", (0.5,) * 3)
        scene = built.scene(camera((0, 0, 1), (2, 0, 1), 30), (lamp,), materials)
        images = render(device, scene, width=16, height=16, passes=8, photons=50000)
        found.append(images["Indirect"][..., :3].mean(axis=(0, 1), dtype=float))
    assert found[0].min() > 0.0
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_without_rays(device: Device) -> None:
    """Where none go on it is Lambert's, and so are channels whose light leaves at once."""
    lights = (plain_light("lamp", "POINT", (1.5, 0, 1.6), (50.0,) * 3),)
    plain, short = (
        half_space().scene(from_above(), lights, (material,))
        for material in (plain_material("plain", ALBEDO), scattering(0.0))
    )
    expected = mean_of(device, plain)
    assert mean_of(device, short, mirror_depth=0) == pytest.approx(expected, rel=1e-5)
    assert mean_of(device, short) == pytest.approx(expected, rel=0.01)


def test_other_things_are_not_in_the_way(device: Device) -> None:
    """As in Cycles, whose walks meet the surfaces of their own object alone."""
    found = []
    for number in range(2):
        built = Builder().sphere((0, 0, 0), 1.0, 0)
        built.sphere((0, 0, 0), 0.8 if number else 0.1, 1, "inside")
        scene = built.scene(
            camera((0, -4, 0), (0, 0, 0), 20),
            (world_light("World", WHITE),),
            (scattering(0.3, (0.8,) * 3), plain_material("black", BLACK)),
        )
        found.append(mean_of(device, scene))
    assert found[1] == pytest.approx(found[0], rel=0.003)


@pytest.mark.thorough("1", "2")
@pytest.mark.parametrize("channel", range(3))
def test_programs_give_every_channel(device: Device, channel: int) -> None:
    """Of a colour: what has no red is not black."""
    albedo = np.zeros(3)
    albedo[channel] = ALBEDO[1]
    program = (Instruction("combine", (*((x,) * 4 for x in albedo), (1.0,) * 4)),)
    (lobe,) = scattering(0.02).lobes
    lobe = replace(lobe, varying={"colour": Result(0), "albedo": Result(0)})
    material = Material("scattering", BLACK, (lobe,), program=program)
    scene = half_space().scene(from_above(), (world_light("World", WHITE),), (material,))
    found = mean_of(device, scene)
    assert found[channel] == pytest.approx(seen_from_above(ALBEDO[1]), rel=0.02)
    assert found.sum() == pytest.approx(found[channel], rel=1e-3)


def under_mirror(material: Material) -> Any:
    """The half space is seen from above in a mirror, whose back the camera is at."""
    built = half_space().quad((-9, -9, 3), (-9, 9, 3), (9, 9, 3), (9, -9, 3), 1)
    mirror = Material("mirror", BLACK, (phong((1.0,) * 3),))
    lamp = plain_light("lamp", "POINT", (1.5, 0, 1.6), (50.0,) * 3)
    view = orthographic((0, 0, 1), (1, 0, 0), (0, -1, 0), 1.0)  # up
    return built.scene(view, (lamp,), (material, mirror))


def test_the_last_bounce(device: Device) -> None:
    """Where no ray goes on it is Lambert's, also behind a mirror."""
    plain, below = (
        mean_of(device, under_mirror(material), mirror_depth=1)
        for material in (plain_material("plain", ALBEDO), scattering(0.02))
    )
    assert plain.min() > 0.0 and below == pytest.approx(plain, rel=0.03)


@pytest.mark.thorough
def test_what_the_camera_does_not_see(device: Device) -> None:
    """Walks meet their surface, whatever rays it is visible to."""
    scene = under_mirror(scattering(0.02))
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[0] -= RAY_BITS["camera"]
    both = scene, replace(scene, visible=visible)
    seen, hidden = (mean_of(device, x, photons=0) for x in both)
    assert seen.min() > 0.0 and hidden == pytest.approx(seen, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("sheet", [False, True])
def test_a_walk_is_no_bounce(device: Device, sheet: bool) -> None:
    """Light straight from a lamp is clamped as such, also behind what is transparent."""
    built = half_space()
    if sheet:
        built.quad((-9, -9, 1), (9, -9, 1), (9, 9, 1), (-9, 9, 1), 1)
    clear = Material("clear", BLACK, (Lobe("transparent", WHITE),))
    lamp = plain_light("lamp", "POINT", (1.5, 0, 1.6), (50.0,) * 3)
    scene = built.scene(from_above(), (lamp,), (scattering(0.02), clear))
    free, clamped = (mean_of(device, scene, clamp_indirect=x, photons=0) for x in (0.0, 1e-3))
    assert free.min() > 0.01 and clamped == pytest.approx(free, rel=1e-6)
    assert mean_of(device, scene, clamp_direct=1e-3, photons=0).max() < 0.5 * free.min()


def test_denoising_data(device: Device) -> None:
    """Its albedo and normal are the surface's, not those of where walks come out."""
    scene = half_space().scene(from_above(), (world_light("World", WHITE),), (scattering(0.02),))
    settings = {"width": 8, "height": 8, "passes": 2, "photons": 500, "denoising_data": True}
    images = render(device, scene, **settings)
    albedo = images["Denoising Albedo"][..., :3]
    np.testing.assert_allclose(albedo, np.broadcast_to(ALBEDO, albedo.shape), rtol=0.01)
    normal = images["Denoising Normal"][..., :3]
    np.testing.assert_allclose(normal, np.broadcast_to((0, 0, 1), normal.shape), atol=1e-5)
