# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of several lobes and of layers, many lights, and kinds that a test adds: pictures are
what they should be, natively, by fragment programs and by compute programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon import memory
from addon.photon.eye.eye import Eye
from addon.photon.scene import Light, Lobe, Material, Scene, phong, sun_light, world_light
from addon.photon.settings import Region
from addon.photon.stage.light_tree import MOST_ASKED
from addon.streams import Device, Reading
from tests.measure import render
from tests.scenes import Builder, camera, orthographic, plain_light, plain_material
from tests.unit.glsl_files import copy_glsl, use_root, write

WAYS = [("native", True), ("fragment", True), ("compute", False)]
Picture = Callable[..., dict[str, Any]]


@pytest.fixture(params=WAYS, ids=[way for way, _ in WAYS])
def picture(
    request: pytest.FixtureRequest, device: Device, monkeypatch: pytest.MonkeyPatch
) -> Picture:
    """Renders a scene in one of the ways."""
    backend, on_host = request.param
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)

    def made(scene: Scene, **settings: Any) -> dict[str, Any]:
        return render(device, scene, backend=backend, **settings)

    return made


def plate(material: Material, *lights: Light, **options: Any) -> Scene:
    """A square of 4 m in z = 0, seen from a side."""
    built = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    return built.scene(camera((0, -2.5, 2), (0, 0.3, 0), 40), lights, [material], **options)


BULB = plain_light("bulb", "POINT", (0.0, 1.5, 1.6), (50.0, 40.0, 30.0))
LOBES = phong((0.2, 0.1, 0.1), 30.0), phong((0.1, 0.2, 0.3), 5.0), phong((0.1, 0.1, 0.2))
NO_DIFFUSE = (0.0, 0.0, 0.0)


@pytest.mark.thorough("compute")
def test_three_lobes_are_their_sum(picture: Picture) -> None:
    """Of which a point has two in a pass, by chance: in highlights and in what is mirrored."""
    settings: dict[str, Any] = {"width": 32, "height": 32, "photons": 0, "passes": 64}
    settings |= {"mirror_depth": 1}
    sky = {"background": (0.5, 0.6, 0.7)}
    together = picture(plate(Material("all", NO_DIFFUSE, LOBES), BULB, **sky), **settings)
    alone = [
        picture(plate(Material("one", NO_DIFFUSE, (lobe,)), BULB, **sky), **settings)
        for lobe in LOBES
    ]
    for part in ("Direct", "Mirror"):
        expected = sum(images[part].mean(axis=(0, 1)) for images in alone)
        found = together[part].mean(axis=(0, 1))
        assert min(images["Mirror"].mean() for images in alone) > 0.01
        np.testing.assert_allclose(found, expected, rtol=0.01, err_msg=part)
    assert alone[0]["Direct"].mean() > 0.01 and not alone[2]["Direct"].any()


@pytest.mark.thorough("lobe1")
@pytest.mark.parametrize("lobe", [phong((0.3,) * 3), phong((0.02, 0.3, 0.1), 1e4)])
def test_layers_under_grazing_light(picture: Picture, lobe: Lobe) -> None:
    """What a lobe lies over: its direct light by photons is that by shadow rays. A light five
    degrees above the horizon, whose mirror image the eye does not see."""
    angle = math.radians(85)
    to_light = np.array([math.sin(angle), 0.0, math.cos(angle)])
    far, half = 2000.0, 0.6
    light = plain_light(
        "far",
        "SPOT",
        tuple(far * to_light),
        (4 * math.pi * far**2,) * 3,
        tuple(-to_light),
        spot_size=2 * math.atan(half / far),
        spot_blend=0.0,
    )
    layered = Material("layered", NO_DIFFUSE, (replace(lobe, covered=(0.8, 0.4, 0.2)),))
    built = Builder().quad((-8, -1, 0), (8, -1, 0), (8, 1, 0), (-8, 1, 0))
    scene = built.scene(orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 0.8), [light], [layered])
    settings: dict[str, Any] = {"width": 16, "height": 16, "photons": 40_000, "radius": 0.1}
    settings |= {"photon_bounces": 1, "passes": 4, "mirror_depth": 0}
    by_rays = picture(scene, **settings | {"photons": 0})["Direct"].mean(axis=(0, 1))
    by_photons = picture(scene, **settings, direct_by_photons=True)
    assert not by_photons["Direct"].any()
    exact = np.multiply((0.8, 0.4, 0.2), 1 - max(lobe.colour)) / math.pi * math.cos(angle)
    np.testing.assert_allclose(by_rays, exact, rtol=2e-3)
    np.testing.assert_allclose(by_photons["Indirect"].mean(axis=(0, 1)), by_rays, rtol=0.01)


def layered(roughness: float) -> Material:
    """Sheen over a tinted coat over a dielectric over a rough base; all gather from 0.5 on."""
    alpha = roughness**2
    shape = {"alpha_x": alpha, "alpha_y": alpha, "turn": 0.0, "compensated": 1.0, "ior": 1.5}
    coat = {"alpha": alpha, "ior": 1.6, "cover": 0.8}
    lobes = (
        Lobe("sheen", (0.7, 0.5, 0.3), {"roughness": roughness}),
        Lobe("coat", (0.5, 0.8, 0.9), coat, over=0),
        Lobe("ggx_dielectric", (0.04,) * 3, shape, covered=(0.2, 0.3, 0.1), over=1),
        Lobe("oren_nayar", (0.6, 0.4, 0.3), {"diffuse_roughness": 0.8}, over=2),
    )
    return Material("layered", NO_DIFFUSE, lobes)


@pytest.mark.thorough("fragment", "compute")
def test_lobes_under_lobes_gather(picture: Picture) -> None:
    """Their direct light by photons is that by shadow rays, ten degrees above the horizon."""
    angle = math.radians(80)
    to_light = np.array([math.sin(angle), 0.0, math.cos(angle)])
    sun = sun_light("sun", (math.pi,) * 3, tuple(-to_light))
    built = Builder().quad((-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0))
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 0.8)
    scene = built.scene(view, [sun], [layered(0.7)])
    settings: dict[str, Any] = {"width": 12, "height": 12, "photons": 40_000, "radius": 0.1}
    settings |= {"photon_bounces": 1, "passes": 4, "mirror_depth": 1}
    by_rays = picture(scene, **settings | {"photons": 0})["Direct"].mean(axis=(0, 1))
    by_photons = picture(scene, **settings, direct_by_photons=True)
    assert not by_photons["Direct"].any() and not by_photons["Mirror"].any()
    assert by_rays.min() > 0.01
    np.testing.assert_allclose(by_photons["Indirect"].mean(axis=(0, 1)), by_rays, rtol=0.01)


@pytest.mark.parametrize("kind", ["toon", "glossy_toon"])
def test_toon(device: Device, kind: str) -> None:
    """Its light is that of the cone that the sun is in, by shadow rays and by photons; and that of
    an even sky is white where all of the cone is above the horizon."""
    toon = Lobe(kind, (1.0,) * 3, {"size": 0.4, "edge": 0.1})
    angle, middle = math.radians(40.5), math.pi * 0.25
    to_light = np.array([math.sin(angle), 0.0, math.cos(angle)])
    sun = sun_light("sun", (math.pi,) * 3, tuple(-to_light))
    built = Builder().quad((-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0))
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 0.8)
    scene = built.scene(view, [sun], [Material("toon", NO_DIFFUSE, (toon,))])
    settings: dict[str, Any] = {"width": 12, "height": 12, "photons": 20_000, "radius": 0.1}
    settings |= {"photon_bounces": 1, "passes": 4, "mirror_depth": 1}
    by_rays = render(device, scene, **settings | {"photons": 0})["Direct"].mean()
    by_photons = render(device, scene, **settings, direct_by_photons=True)["Indirect"].mean()
    half_bright = 0.5 * math.pi / (2.0 * math.pi * (1.0 - math.cos(middle)))
    assert by_rays == pytest.approx(half_bright, rel=2e-3)
    assert by_photons == pytest.approx(by_rays, rel=0.02)
    sky = replace(scene, lights=(world_light("sky", (1.0,) * 3),))
    picture = render(device, sky, **settings | {"photons": 0, "passes": 64})
    white = picture["Combined"][..., :3].mean()
    filled = (1.0 - math.cos(math.pi * 0.2)) / (1.0 - math.cos(middle))
    assert filled < white < 1.0


def furnace(diffuse: float, share: float) -> Scene:
    """Inside a box that glows, and mirrors a share of what falls on it."""
    lobes = (Lobe("mirror", (share,) * 3),)
    glowing = Material("glowing", (diffuse,) * 3, lobes, emission=(1.0,) * 3)
    built = Builder().box((-1, -1, 0), (1, 1, 2))
    return built.scene(camera((0.1, 0.2, 0.7), (0.4, 0.9, 1.1), 60), (), [glowing])


def test_what_is_aside_brings_what_is_right(picture: Picture) -> None:
    """Whether later bounces go on together or each by its own chance."""
    settings: dict[str, Any] = {"width": 16, "height": 16, "photons": 4000, "passes": 64}
    for diffuse in (0.0, 0.3):
        images = picture(furnace(diffuse, 0.2), mirror_depth=12, **settings)
        light = 1 / (1 - diffuse - 0.2)
        assert images["Combined"][..., :3].mean() == pytest.approx(light, rel=0.01)
        assert images["Mirror"].mean() == pytest.approx(0.2 * light, rel=0.025)


@pytest.mark.usefixtures("resident")
def test_what_carries_little_goes_on_together(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the second bounce on either all rays go on or none, but from what has no diffuse lobe."""
    sent_last, sent = Eye._sent_last, []

    def watched(eye: Eye, region: Region, reading: Reading) -> int:
        sent.append(reading.numbers())
        return sent_last(eye, region, reading)

    monkeypatch.setattr(Eye, "_sent_last", watched)
    monkeypatch.setattr(memory, "MOST_PARTS", 1)  # it is asked once of passes together
    settings: dict[str, Any] = {"width": 16, "height": 16, "photons": 0, "passes": 16}
    for diffuse in (0.3, 0.0):
        sent.clear()
        render(device, furnace(diffuse, 0.2), backend="compute", mirror_depth=12, **settings)
        seconds = [numbers[1] for numbers in sent if len(numbers) == 2]
        if diffuse:  # each pass is asked after its second bounce
            assert len(seconds) == 16 and {*seconds} == {0, 256}
            assert 5 <= seconds.count(256) <= 8  # of 6.4
        else:
            assert seconds and min(seconds) > 0 and max(seconds) < 256


@pytest.mark.parametrize("roughness", [0.2, 0.8])
def test_furnace_of_layers(device: Device, roughness: float) -> None:
    """All of them white under a white sky: no brighter than it, and hardly darker."""
    white = tuple(
        replace(lobe, colour=(0.04,) * 3 if lobe.kind == "ggx_dielectric" else (1.0,) * 3)
        for lobe in layered(roughness).lobes
    )
    white = (*white[:2], replace(white[2], covered=NO_DIFFUSE), white[3])
    sky = world_light("sky", (1.0,) * 3, ("camera", "diffuse", "chains"))
    scene = plate(Material("white", NO_DIFFUSE, white), sky)
    settings: dict[str, Any] = {"width": 16, "height": 16, "photons": 0, "passes": 256}
    images = render(device, scene, **settings)
    seen = images["Combined"][..., :3][~images["Background"].any(axis=-1)]
    assert len(seen) > 100
    print(seen.mean(axis=0))
    assert ((seen.mean(axis=0) < 1.01) & (seen.mean(axis=0) > 0.96)).all()


def test_more_lights_than_shadow_rays(picture: Picture) -> None:
    """Those that are drawn bring what all bring, pass by pass within their noise."""
    rng = np.random.default_rng(5)
    lights = []
    for i in range(MOST_ASKED + 40):
        power = tuple(10 ** rng.uniform(-2, 1) * rng.uniform(0.2, 1, 3))
        place = (*rng.uniform(-1.5, 1.5, 2), rng.uniform(0.5, 1.5))
        kind = "SPOT" if i % 3 else "POINT"
        lights.append(plain_light(f"light {i}", kind, place, power, spot_size=2.0))
    glossy = plain_material("glossy", (0.4, 0.3, 0.2), (0.2, 0.2, 0.2), 20.0)
    settings: dict[str, Any] = {"width": 24, "height": 24, "photons": 0, "passes": 1}
    differences = []
    for index in range(16):
        groups = [lights[:52], lights[52:], lights]
        means = [
            picture(plate(glossy, *group), **settings, first_pass=index)["Direct"].mean()
            for group in groups
        ]
        differences.append(means[2] / (means[0] + means[1]) - 1)
    error = np.std(differences, ddof=1) / math.sqrt(len(differences))
    assert 1e-6 < error < 0.003
    assert abs(np.mean(differences)) < 4 * error


# A toy lobe and a toy light: a file each, and nothing else.

TOY_LOBE = """// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's lobe once more. Colour: its albedo, before it is multiplied.
// Parameters: strength.
#include "lib/sampling.glsl"

vec3 pack_toy(vec4 parameters, vec4 more) { return parameters.xyz; }

float roughness_toy(Lobe lobe, Shape shape) { return 1.0; }

vec3 adjoint_toy(Lobe lobe, Shape shape, float from, float to) { return vec3(1.0); }

vec3 eval_toy(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return shape.parameters.x * lobe.colour / PI;
}

float pdf_toy(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec3 to_light) {
    return max(0.0, dot(normal, to_light)) / PI;
}

vec3 sample_toy(Lobe lobe, Shape shape, vec3 normal, vec3 to_viewer, vec2 u, out vec3 weight) {
    weight = shape.parameters.x * lobe.colour;
    return frame_about(normal) * sample_cosine_hemisphere(u);
}

vec3 albedo_toy(Lobe lobe, Shape shape, float cosine) { return shape.parameters.x * lobe.colour; }
"""

TOY_LIGHT = """// SPDX-License-Identifier: GPL-3.0-or-later
// A point light that shines into the half space before it alone.
// Parameters: gain, unused [m]. Power: W.

LightSample sample_toy(Light light, vec3 position, vec3 normal, vec2 u) {
    vec3 to = light.position - position;
    float far = length(to);
    vec3 irradiance = light.parameters.x * light.power / (4.0 * PI * far * far);
    return LightSample(to / far, far, irradiance, dot(to, light.axis) < 0.0 ? 1.0 : 0.0);
}

float pdf_toy(Light light, vec3 position, vec3 normal, vec3 to_light) { return 0.0; }

LightRay emit_toy(Light light, vec2 u, vec2 on_light) {
    vec3 direction = direction_from_versine(u.x, 2.0 * PI * u.y);
    return LightRay(light.position, frame_about(light.axis) * direction, 1.0);
}

vec4 seen_toy(Light light, vec3 origin, vec3 direction, float far) { return vec4(0.0); }

LightBounds bounds_toy(Light light) { return sphere_bounds(light, 0.0, ALL_AROUND); }

vec3 flux_toy(Light light) { return 0.5 * light.parameters.x * light.power; }
"""


@pytest.fixture
def _toys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = copy_glsl(tmp_path, Path(__file__).parents[1] / "kernels" / "glsl")
    use_root(root, monkeypatch)
    write(root, "bsdf/toy.glsl", TOY_LOBE)
    write(root, "lights/toy.glsl", TOY_LIGHT)


TOY = Material("toy", NO_DIFFUSE, (Lobe("toy", (0.5, 0.25, 0.125), {"strength": 1.6}),))
LAMBERT = plain_material("lambert", (0.8, 0.4, 0.2))


def toy_light(axis: tuple[float, float, float]) -> Light:
    parameters = {"gain": 2.0, "unused": 3.0}
    return Light("toy", "toy", BULB.position, (25.0, 20.0, 15.0), axis, parameters)


@pytest.mark.usefixtures("_toys")
def test_a_toy_lobe(picture: Picture) -> None:
    """By shadow rays to the bit of rounding what Lambert's own lobe has, and by secondary rays what
    photons would bring."""
    settings: dict[str, Any] = {"width": 24, "height": 24, "photons": 0, "passes": 2}
    toy, lambert = (picture(plate(m, BULB), **settings)["Direct"] for m in (TOY, LAMBERT))
    assert toy.mean() > 0.01
    np.testing.assert_allclose(toy, lambert, rtol=1e-4, atol=1e-6)
    # A white sky fills the upper half: each point reflects its albedo.
    sky = picture(plate(TOY, background=(1.0, 1.0, 1.0)), **settings | {"passes": 16})
    on_plate = ~sky["Background"].any(axis=-1)
    assert on_plate.sum() > 200
    mean = sky["Mirror"][on_plate].mean(axis=0)
    np.testing.assert_allclose(mean, LAMBERT.diffuse, rtol=1e-4)


@pytest.mark.usefixtures("_toys")
def test_photons_meet_a_toy_lobe(picture: Picture) -> None:
    """They leave it as Lambert's: a floor that wears it lights a wall alike."""
    b = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), 0)
    b.quad((-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3), 1)
    view = camera((0, -2, 1.5), (0, 2, 1.5), 60)
    down = plain_light(
        "spot", "SPOT", (0, 0, 2), (900.0,) * 3, (0, 0, -1), spot_size=1.0, spot_blend=0.0
    )
    settings: dict[str, Any] = {"width": 16, "height": 16, "photons": 100_000, "passes": 4}
    settings |= {"photon_bounces": 1, "radius": 0.4, "mirror_depth": 0}
    wall = plain_material("wall", (0.5, 0.5, 0.5))
    toy, lambert = (
        picture(b.scene(view, [down], [floor, wall]), **settings)["Indirect"].mean(axis=(0, 1))
        for floor in (TOY, LAMBERT)
    )
    assert lambert.min() > 0.01
    np.testing.assert_allclose(toy, lambert, rtol=0.02)


@pytest.mark.usefixtures("_toys")
@pytest.mark.thorough("fragment", "compute", "0.3")
@pytest.mark.parametrize("roughness", [0.3, 0.8])
def test_photons_meet_lobes_under_lobes(picture: Picture, roughness: float) -> None:
    """They light a wall as a wall whose rays go to what lies in the light sees it: over what they
    do of Lambert's floor, which has most of either's noise."""
    b = Builder().quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), 0)
    b.quad((-2, 2, 0.5), (2, 2, 0.5), (2, 2, 3), (-2, 2, 3), 1)
    view = camera((0, -2, 1.75), (0, 2, 1.75), 28)
    down = plain_light(
        "spot", "SPOT", (0, 0, 2), (900.0,) * 3, (0, 0, -1), spot_size=2.4, spot_blend=0.0
    )
    settings: dict[str, Any] = {"width": 16, "height": 16, "photon_bounces": 1}
    settings |= {"radius": 0.1, "photons": 100_000, "mirror_depth": 0}
    by_rays = settings | {"photons": 0, "mirror_depth": 1, "passes": 64}
    wall = plain_material("wall", LAMBERT.diffuse)

    def both(floor: Material) -> Any:
        seen = picture(b.scene(view, [down], [floor, TOY]), **by_rays)["Mirror"]
        brought = picture(b.scene(view, [down], [floor, wall]), **settings, passes=16)["Indirect"]
        return [image.mean(axis=(0, 1)) for image in (seen, brought)]

    found, of_lambert = both(layered(roughness)), both(LAMBERT)
    assert found[0].min() > 0.01
    found = np.divide(found, of_lambert)
    np.testing.assert_allclose(found[1], found[0], rtol=0.015)


@pytest.mark.usefixtures("_toys")
def test_a_toy_light(picture: Picture) -> None:
    """Before it, a point light's: by shadow rays to the bit of rounding, by photons in the mean."""
    settings: dict[str, Any] = {"width": 24, "height": 24, "passes": 4, "radius": 0.2}
    settings |= {"photons": 100_000, "photon_bounces": 1}
    scenes = [plate(LAMBERT, light) for light in (toy_light((0.0, 0.0, -1.0)), BULB)]
    toy, bulb = (picture(scene, **settings)["Direct"] for scene in scenes)
    assert toy.mean() > 0.01
    np.testing.assert_allclose(toy, bulb, rtol=1e-4, atol=1e-6)
    by_photons = [picture(s, **settings, direct_by_photons=True)["Indirect"] for s in scenes]
    means = [image[4:-4, 4:-4].mean(axis=(0, 1)) for image in by_photons]
    np.testing.assert_allclose(means[0], means[1], rtol=0.01)
    # Behind it is nothing.
    away = picture(plate(LAMBERT, toy_light((0.0, 0.0, 1.0))), **settings)
    assert not away["Direct"].any() and not away["Indirect"].any()
