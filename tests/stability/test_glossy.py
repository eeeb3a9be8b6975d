# SPDX-License-Identifier: GPL-3.0-or-later
"""Where microfacets fail: at the limit to a mirror, and on smooth normals at grazing angles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Lobe, Material, Scene
from addon.photon.stage.gathered import GATHERED_FROM, GATHERED_WHOLLY
from addon.streams import Device
from tests.measure import fallen, render_clean, rendered
from tests.scenes import Builder, camera, plain_light, plain_material, replace
from tests.stability.table import Measured

LIMIT = 2.0e-10**0.25  # roughness up to which microfacets are a mirror; 0.00376
BLACK, WHITE, GOLD = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.9, 0.6, 0.3)
KINDS: dict[str, dict[str, Any]] = {
    "ggx": {},
    "ggx_metal": {"tint": (0.8, 0.9, 1.0)},
    "ggx_dielectric": {"ior": 1.5},
}


def glossy(
    kind: str, roughness: float, colour: Any, covered: Any = BLACK, **others: Any
) -> Material:
    """A material of one lobe; of its other parameters those of its kind count."""
    alpha = roughness**2
    microfacets = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0}
    of_kind = {name: others.get(name, value) for name, value in KINDS[kind].items()}
    lobe = Lobe(kind, colour, {**microfacets, **of_kind}, covered=covered)
    return Material("glossy", BLACK, (lobe,))


def room(material: Material) -> Scene:
    """A glossy floor before a red wall and beside a white one; the lamp's image is not in view.

    It is seen through the floor and by the caustic on the walls.
    """
    built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    built.quad((-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3), 1)
    built.quad((-2, -2, 0), (-2, 2, 0), (-2, 2, 3), (-2, -2, 3), 2)
    red, grey = plain_material("red", (0.7, 0.3, 0.2)), plain_material("grey", (0.7,) * 3)
    lamp = plain_light("lamp", "POINT", (1.0, -1.6, 2.5), (300.0,) * 3)
    return built.scene(
        camera((1.2, -3.5, 1.6), (-0.6, 1.0, 0.4), 50), [lamp], [material, red, grey]
    )


def regions(images: dict[str, Any]) -> Any:
    """The means of the picture, and of its parts, three by three; (10, 3)."""
    picture = images["Combined"][..., :3].astype(float)
    side = len(picture) // 3
    parts = picture[: 3 * side, : 3 * side].reshape(3, side, 3, side, 3).mean(axis=(1, 3))
    return np.concatenate([picture.mean(axis=(0, 1))[None], parts.reshape(9, 3)])


def changes(device: Device, kind: str, steps: list[float], **settings: Any) -> Any:
    """What the picture and its parts do from each roughness to the next; relative, (steps, 30)."""
    covered = (0.5, 0.3, 0.2) if kind == "ggx_dielectric" else BLACK
    colour = (0.04,) * 3 if kind == "ggx_dielectric" else GOLD
    options: dict[str, Any] = {"width": 24, "height": 24, "passes": 16, "photons": 8192}
    options |= {"radius": 0.3, "mirror_depth": 4} | settings
    means = [
        regions(render_clean(device, room(glossy(kind, step, colour, covered)), **options))
        for step in steps
    ]
    return np.diff(np.log(means), axis=0).reshape(len(steps) - 1, -1)


@pytest.mark.thorough("fragment", "ggx_metal")
@pytest.mark.stability(64)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("backend", ["native", "fragment"])
@pytest.mark.usefixtures("not_aimed")
def test_no_jump_at_the_mirror_limit(
    device: Device, measured: Measured, kind: str, backend: str
) -> None:
    steps = [0.0, 1e-4, LIMIT * 0.999, LIMIT * 1.001, 0.005, 0.01]
    found = np.abs(changes(device, kind, steps, backend=backend)).max()
    assert measured(f"mirror limit, {kind}", found, "%") <= 0.01


@pytest.mark.stability(64)
@pytest.mark.thorough("metal", "dielectric")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("not_aimed")
def test_no_jump_at_any_roughness(
    device: Device, measured: Measured, thorough: bool, kind: str
) -> None:
    """Across thresholds; and in small steps, of which each is the mean of its neighbours."""
    few = [0.02, 0.038, 0.05, 0.1, 0.25, GATHERED_FROM, 0.45, GATHERED_WHOLLY, 0.75]
    across = [x for step in few for x in (step * 0.9995, step * 1.0005)]
    found = np.abs(changes(device, kind, across)[::2]).max()
    assert measured(f"at thresholds, {kind}", found, "%") <= 0.01
    if thorough:
        # Of one bounce off the lobe: later ones have a few heavy photons, see the rough ball below.
        quiet = {"width": 64, "height": 64, "passes": 24, "photons": 32768, "photon_bounces": 2}
        roughness = [i / 50 for i in range(51)]
        # One seed's kinks are up to 2.3 % of noise, of either sign, from roughness 0.4 to 0.8.
        seeds = [changes(device, kind, roughness, seed=seed, **quiet) for seed in range(8)]
        steps = np.mean(seeds, axis=0)
        kinks = steps[1:-1] - 0.5 * (steps[:-2] + steps[2:])
        print(f"\n{kind}: kinks {np.abs(kinks).max(axis=1).round(4)}")
        assert measured(f"anywhere, {kind}", np.abs(kinks).max(), "%") <= 0.01


@pytest.mark.stability(64)
def test_no_roughness_is_a_mirror(device: Device, measured: Measured) -> None:
    """Microfacets of none are the mirror's picture, to the fit of their energy."""
    mirror = Material("mirror", (0.0,) * 3, (Lobe("mirror", GOLD),))
    options: dict[str, Any] = {"width": 24, "height": 24, "passes": 8, "radius": 0.3}
    one, other = (
        regions(render_clean(device, room(material), **options))
        for material in (mirror, glossy("ggx", 0.0, GOLD))
    )
    assert measured("roughness 0 and a mirror", np.abs(other / one - 1).max(), "%") <= 0.002


@pytest.mark.stability(65)
@pytest.mark.thorough(
    "0.0-ggx_", "0.05-ggx]", "0.05-ggx_m", "0.3-ggx]", "0.3-ggx_d", "0.7-", "1.0-ggx_m"
)  # each roughness, and each lobe
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("roughness", [0.0, 0.05, 0.3, 0.7, 1.0])
def test_glossy_on_smooth_normals(
    device: Device, measured: Measured, kind: str, roughness: float
) -> None:
    """A coarse smooth ball of white microfacets before an even white sky."""
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=1)
    white = glossy(kind, roughness, WHITE, tint=WHITE)
    scene = ball.scene(camera((0, -3, 0), (0, 0, 0), 40), [], [white], background=WHITE)
    images = render_clean(device, scene, width=48, height=48, passes=128)
    inside = images["Background"].max(axis=-1) == 0
    seen = images["Mirror"].astype(float).mean(axis=-1)
    blocks, whole = (x.reshape(16, 3, 16, 3) for x in (seen, inside))
    means = blocks.mean(axis=(1, 3))[whole.all(axis=(1, 3))]
    print(f"\n{kind} {roughness}: {means.min():.3f} {seen[inside].mean():.4f} {means.max():.3f}")
    assert len(means) > 50
    # At a silhouette, too, where a coarse mesh turns shading normals furthest off its own.
    assert seen[inside].min() > 0.4
    assert 1.0 - measured("darkest place, below 1", 1.0 - means.min(), "%") >= 0.7
    assert measured("reflects on the whole", seen[inside].mean()) <= 1.005


def landed(device: Device, weight: float, roughness: float, subdivisions: int, seed: int) -> float:
    """Flux that falls on a closed smooth ball of diffuse 0.3 and microfacets of a weight, over the
    lamp's."""
    lobe = replace(glossy("ggx", roughness, WHITE).lobes[0], weight=weight)
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=subdivisions)
    lamp = plain_light("lamp", "POINT", (0.3, 0.2, 0.1), (4 * math.pi,) * 3)
    view = camera((0, -0.5, 0), (0, 0, 0), 40)
    scene = ball.scene(view, [lamp], [Material("wall", (0.3,) * 3, (lobe,))])
    options: dict[str, Any] = {"width": 1, "height": 1, "photons": 100_000, "seed": seed}
    with rendered(device, scene, direct_by_photons=True, **options) as renderer:
        return float(fallen(renderer)[0].mean() / (4 * math.pi))


@pytest.mark.stability(65)
@pytest.mark.thorough("0.5")
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_ledger_of_photons(device: Device, measured: Measured, roughness: float) -> None:
    """Of albedo 0.6, half of it microfacets'. On a fine mesh, and on a coarse one.

    Compensated lobes are not reciprocal: of roughness 1 they send on 0.76 of the light that comes
    straight from above, twice what comes at a grazing angle, and all of light from everywhere. So
    what one lamp leaves in the ball is less than 1 / (1 - 0.6); what counts is that it is no more,
    and that a coarse mesh loses little of it.
    """
    fine, coarse = (
        np.mean([landed(device, 0.3, roughness, subdivisions, seed) for seed in range(2)])
        for subdivisions in (5, 1)
    )
    print(f"\n{roughness}: fine {fine:.4f}, coarse {coarse:.4f}")
    assert measured("photons gained", fine * (1 - 0.6) - 1.0, "%") <= 0.01
    assert measured("lost by a coarse mesh", 1.0 - coarse / fine, "%") <= 0.03
    assert fine * (1 - 0.6) > 0.9


@pytest.mark.stability(65)
def test_photons_in_a_bright_rough_ball(device: Device, measured: Measured) -> None:
    """Of albedo 0.8, most of it microfacets' of roughness 1: photons weigh more at each bounce."""
    found = np.array([landed(device, 0.5, 1.0, 3, seed) for seed in range(6)])
    spread = measured(
        "spread of 1e5 photons in a white rough ball", found.std() / found.mean(), "%"
    )
    print(f"\n{found.round(3)}")
    if spread > 0.01:
        measured.falls_short("photons gain weight on white microfacets of roughness near 1")
    assert 0.8 < found.mean() * (1 - 0.8) < 1.2
