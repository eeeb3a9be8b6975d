# SPDX-License-Identifier: GPL-3.0-or-later
"""The tree of lights: what it draws has the probability that it says, and none is forgotten that
could bring light."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.kernels.records import LIGHT, LIGHT_NODE, LIGHT_PLACE
from addon.photon.prepare import prepare
from addon.photon.scene import BLACK, Light, Material, Scene, point_light, spot_light, world_light
from addon.photon.settings import Settings
from addon.photon.stage.emissive import (
    Emission,
    are_one_lamp,
    emissive_triangles,
    triangle_lights,
)
from addon.photon.stage.geometry import Frame, Mesh
from addon.photon.stage.light_tables import (
    choose_lights,
    count_distant,
    flux_of,
    joined,
    kinds_of,
    light_table,
    tree_of,
)
from addon.photon.stage.light_tree import (
    DRAWN_OF_ONE,
    DRAWN_RAYS,
    LEAST_DRAWN,
    LEAST_OF_ONE,
    MOST_ASKED,
    MOST_GROUPS,
    Bounds,
    asked_lights,
    groups_of,
    light_tree,
)
from addon.photon.stage.switches import made_lights
from addon.streams import Device, Table, Uniform
from tests.kernels.conftest import Bench
from tests.scenes import Builder, camera
from tests.unit.glsl_files import VALUE, declare

DRAW, PROBABILITY, EMIT = range(3)
COUNT = 1 << 17
FAR = 1e3  # the flux of a light that is
HERE = Frame(np.zeros(3), 1.0)
EXTENT = 1.5
PROBE = declare(
    "probe_light_tree",
    {"first": VALUE, "second": VALUE},
    inputs={"a": VALUE, "b": VALUE},
    uniforms={"asked_lights": Uniform("int"), "light_leaves": Uniform("int")},
    tables={
        "lights": Table(LIGHT),
        "light_nodes": Table(LIGHT_NODE),
        "light_places": Table(LIGHT_PLACE),
    },
    structure=("ASK",),
)
# Among lights and beside them, upwards and down, near a wall, and far away.
PLACES = np.array(
    [[0.1, 0.05, 0.0], [0.9, -0.8, 0.3], [0.0, 0.0, -1.0], [0.31, 0.2, 0.4], [5, 5, 5]]
)
NORMALS = np.array([[0, 0, 1], [0, 0, -1], [0.6, 0.0, 0.8], [-1, 0, 0], [0, -0.6, -0.8]], float)


def lamps(count: int, seed: int) -> tuple[Light, ...]:
    """Bulbs and spots of all sizes and powers."""
    rng = np.random.default_rng(seed)
    made: list[Light] = []
    for i in range(count):
        position = tuple(map(float, rng.uniform(-1, 1, 3)))
        power = (float(10 ** rng.uniform(-2, 2)),) * 3
        radius = float(rng.choice([0.0, 0.02, 0.2]))
        if i % 2:
            axis = tuple(map(float, rng.normal(size=3)))
            size = float(rng.uniform(0.2, math.pi))
            made.append(spot_light("", position, power, axis, size=size, blend=0.3, radius=radius))
        else:
            made.append(point_light("", position, power, radius))
    return tuple(made)


def triangles(seed: int) -> NDArray[Any]:
    """An emissive ball, and a sheet."""
    built = Builder().sphere((0.4, 0.2, 0.3), 0.2, subdivisions=1)
    x = np.linspace(-1, 1, 8)
    for a, b in pairwise(x):
        built.quad((a, -1, 0.9), (b, -1, 0.9), (b, 1, 0.9), (a, 1, 0.9))
    return of_triangles(built)


def glowing(built: Builder) -> Scene:
    """What was built, of an emissive material."""
    return built.scene(camera((0, 0, 0), (1, 1, 1), 40), [], [Material("", BLACK, (), (1, 2, 3))])


def of_triangles(built: Builder) -> NDArray[Any]:
    """The lights that this is."""
    scene = glowing(built)
    mesh = Mesh.build(scene, HERE)
    emission = np.array([material.emission for material in scene.materials])
    radiance = emission[scene.material[emissive_triangles(scene, mesh)]]
    return triangle_lights(scene, mesh, Emission.even(radiance))


TABLES = {
    "lamps": lambda: light_table(lamps(101, 1), HERE),
    "triangles": lambda: triangles(2),
    "all": lambda: joined(
        light_table((world_light("a", (0.1,) * 3), world_light("b", (0.2,) * 3)), HERE, EXTENT),
        light_table(lamps(64, 3), HERE),
        triangles(4),
    ),
    "one": lambda: light_table(lamps(1, 5), HERE),
    "two": lambda: light_table(lamps(2, 6), HERE),
}


class Asked:
    """Of a table of lights and its tree."""

    def __init__(self, bench: Bench, lights: NDArray[Any]) -> None:
        self.bench, self.lights = bench, lights
        device, layer = bench.device, bench.layer
        flux = flux_of(device, layer, lights, {})
        choose_lights(lights, flux)
        self.flux = flux.mean(axis=1)
        self.asked = np.arange(count_distant(lights))
        self.nodes, self.places = tree_of(device, layer, lights, self.asked, {})

    def __call__(self, ask: int, place: Any, normal: Any, numbers: Any) -> NDArray[Any]:
        return self.both(ask, place, normal, numbers)[0]

    def both(self, ask: int, place: Any, normal: Any, numbers: Any) -> tuple[Any, Any]:
        a = np.zeros((len(numbers), 4), np.float32)
        a[:, :3], a[:, 3] = place, numbers
        b = np.zeros((len(numbers), 4), np.float32)
        b[:, :3] = normal
        found = self.bench.run(
            PROBE,
            {"a": a, "b": b},
            {"asked_lights": len(self.asked), "light_leaves": len(self.nodes) // 2},
            {"lights": self.lights, "light_nodes": self.nodes, "light_places": self.places},
            defines={"ASK": ask},
            made=made_lights(kinds_of(self.lights)),
        )
        return found["first"].astype(float), found["second"].astype(float)


@pytest.mark.parametrize("at", range(len(PLACES)))
@pytest.mark.parametrize("name", TABLES)
def test_draws_have_their_probabilities(one_bench: Bench, name: str, at: int) -> None:
    asked = Asked(one_bench, TABLES[name]())
    count = len(asked.lights)
    place, normal = PLACES[at], NORMALS[at]
    probabilities, places = asked(PROBABILITY, place, normal, np.arange(count))[:, :2].T
    assert np.array_equal(np.flatnonzero(places < 0), asked.asked)
    # Whole, but for what is lost where a node may bring something and no light in it does.
    u = (np.arange(COUNT) + 0.5) / COUNT
    drawn = asked(DRAW, place, normal, u)
    lost = (drawn[:, 1] == 0.0).mean()
    assert probabilities.sum() == pytest.approx(1.0 - lost, abs=1e-4)
    there = drawn[:, 1] > 0
    np.testing.assert_allclose(
        drawn[there, 1], probabilities[drawn[there, 0].astype(int)], rtol=1e-3
    )
    # Of an even comb of numbers each light has its share, to a number or two at each end of it.
    found = np.bincount(drawn[there, 0].astype(int), minlength=count) / COUNT
    assert np.abs(found - probabilities).max() < 4.0 / COUNT + 1e-5


def test_far_triangles_that_are_alike_go_by_flux(one_bench: Bench) -> None:
    """Of those of a ball that face about the same way: nobody asks how each faces a place."""
    asked = Asked(one_bench, of_triangles(Builder().sphere((0, 0, 0), 0.5, subdivisions=3)))
    normal, numbers = (0.0, 0.0, -1.0), np.arange(len(asked.lights))
    for far, least, most in ((0.6, 0.2, 1.0), (6.0, 0.0, 0.05)):
        probabilities = asked(PROBABILITY, (0.0, 0.0, far), normal, numbers)[:, 0]
        times = np.sort(probabilities / asked.flux[numbers])
        kinds = 1 + np.count_nonzero(np.diff(times) > 1e-4 * times[1:])
        assert least < kinds / len(numbers) < most


def test_dark_triangles_are_never_drawn(one_bench: Bench) -> None:
    """Among others that are far away and go by flux, and alone in a part of the tree."""
    lights = of_triangles(Builder().sphere((0, 0, 0), 0.5, subdivisions=3))
    lights["power"][::3] = lights["power"][: len(lights) // 4] = 0.0
    asked = Asked(one_bench, lights)
    numbers = np.arange(len(lights))
    found = asked(PROBABILITY, (0.0, 0.0, 6.0), (0.0, 0.0, -1.0), numbers)[:, 0]
    assert np.array_equal(found > 0.0, lights["power"].any(axis=1))
    assert found.sum() == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("name", ["lamps", "triangles", "all"])
def test_no_light_that_could_arrive_is_forgotten(one_bench: Bench, name: str) -> None:
    """Wherever a photon of a light arrives, it may be drawn."""
    asked = Asked(one_bench, TABLES[name]())
    rng = np.random.default_rng(7)
    number = np.repeat(np.arange(len(asked.asked), len(asked.lights)), 64)
    both = rng.random((2, len(number), 3)).astype(np.float32)
    origin, direction = asked.both(EMIT, both[0], both[1], number)
    place = origin[:, :3] + direction[:, :3] * rng.uniform(0.01, 2.0, (len(number), 1))
    normal = rng.normal(size=place.shape)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    falling = (normal * direction[:, :3]).sum(axis=1)
    normal *= -np.sign(falling)[:, None]
    probability = asked(PROBABILITY, place, normal, number)[:, 0]
    bright = (asked.flux[number] > 0) & (np.abs(falling) > 1e-3)
    assert bright.sum() > 1000 and (probability[bright] > 0).all()


def test_what_is_dark_widens_nothing() -> None:
    """As a dome far around two lamps, which is seen and lights nothing."""
    places = np.concatenate([np.eye(3)[:2], 50.0 * np.random.default_rng(1).normal(size=(30, 3))])
    flux = np.where(np.arange(len(places)) < 2, 1.0, 0.0)
    axes, ones = np.tile((0.0, 0.0, 1.0), (len(places), 1)), np.ones(len(places))
    bounds = Bounds(places, places, axes, -ones, 0.0 * ones, flux)
    root = light_tree(bounds, np.zeros(0, int))[0][1]
    assert np.array_equal(root["low"], [0, 0, 0]) and np.array_equal(root["high"], [1, 1, 0])
    assert root["flux"] == 2.0


def test_few_lights_far_away_hide_none_nearby(one_bench: Bench) -> None:
    """Of a thousand near ones, a few on another planet and dark ones farther away each is drawn
    about as often as without those, and as its own light is."""
    rng = np.random.default_rng(3)
    near = [point_light("", (*map(float, x),), (1.0,) * 3) for x in rng.uniform(-1, 1, (1000, 3))]
    far = [point_light("", (i * 0.1, 0.0, -80.0), (1.0,) * 3) for i in range(20)]
    dark = rng.normal(size=(3000, 3)) * 200.0
    far += [point_light("", (*map(float, x),), (0.0,) * 3) for x in dark]
    place, normal = np.array([0.1, 0.2, -1.2]), np.array([0.0, 0.0, 1.0])
    to_light = np.array([light.position for light in near]) - place
    away = np.linalg.norm(to_light, axis=1)
    wanted = to_light[:, 2].clip(0.0) / away**3
    found = []
    for lights in (near, near + far):
        asked = Asked(one_bench, light_table(lights, HERE))
        found.append(asked(PROBABILITY, place, normal, np.arange(len(near)))[:, 0])
    alone, beside = found
    # What 32 draws leave of variance: the mean of squares over what they are drawn by.
    variances = [float((wanted**2 / x.clip(1e-12)).sum()) / wanted.sum() ** 2 for x in found]
    assert alone.min() > 0.0 and beside.min() > 0.0
    assert variances[1] < 1.5 * variances[0] < 5.0, variances


@pytest.mark.parametrize(
    ("flux", "distant", "asked", "drawn"),
    [
        (np.ones(MOST_ASKED), 0, range(MOST_ASKED), 0),
        (np.ones(MOST_ASKED + 1), 0, (), DRAWN_RAYS),
        # A strong lamp: of the many weak ones beside it few are drawn, and of few none.
        (np.array([30.0, *[0.01] * 40]), 0, [0], LEAST_DRAWN),
        (np.array([30.0, *[0.01] * 16]), 0, range(17), 0),
        # Half of the light comes from many.
        (np.array([50.0, *[1.0] * 50]), 0, [0], DRAWN_RAYS // 2),
        # A sun says nothing of lamps in a room; a lamp that lights nothing is not asked.
        (np.array([1e6, *[1.0] * 40]), 1, range(41), 0),
        (np.array([1e6, 0.0, *[1.0] * 65]), 1, [0], DRAWN_RAYS),
        (np.zeros(3), 1, range(3), 0),
        # What a sun outshines by more than numbers hold.
        (np.array([1e12, *[0.0] * 100]), 1, [0], DRAWN_RAYS),
    ],
)
def test_weak_lights_are_drawn(flux: Any, distant: int, asked: Any, drawn: int) -> None:
    found = asked_lights(flux, distant)
    assert (found.lights.tolist(), found.drawn) == (list(asked), drawn)


def test_what_glows_asks_for_few_rays() -> None:
    """It and half as much light of many lamps; and few lamps among it are each asked."""
    glows = np.arange(300) < 200
    found = asked_lights(np.ones(300), 0, glows)
    assert found.lights.tolist() == [] and found.drawn == DRAWN_RAYS // 4
    assert asked_lights(np.ones(300), 0, glows | True).drawn == LEAST_DRAWN
    found = asked_lights(np.array([50.0, *[0.1] * 60]), 0, np.arange(61) > 0)
    assert found.lights.tolist() == [0] and found.drawn == LEAST_DRAWN


def test_many_dark_lights_ask_for_few_rays() -> None:
    """As triangles whose emission the nodes make black are."""
    found = asked_lights(np.array([1.0, *[0.0] * 500]), 0)
    assert found.lights.tolist() == [0] and 0 < found.drawn < 10


def test_triangles_that_are_one_lamp() -> None:
    """Those of a ball or a screen, but not of balls far apart, nor where a lamp that is no mesh is
    among them."""
    screen = Builder().quad((0, 0, 0), (2, 0, 0), (2, 1, 1), (0, 1, 1))
    bulb = light_table((point_light("bulb", (0.0, 0.0, 2.0), (1.0,) * 3),), HERE)
    ball, balls = (of_triangles(balls_at(*places)) for places in ((0.0,), (0.0, 20.0)))
    for lights, is_one in (
        (ball, True),
        (of_triangles(screen), True),
        (balls, False),
        (of_triangles(balls_at(*range(0, 20, 2))), False),
        (joined(bulb, ball), False),
    ):
        assert are_one_lamp(lights, np.ones(len(lights), bool)) == is_one
    some = np.arange(len(balls)) < len(ball)
    assert are_one_lamp(balls, some) and not are_one_lamp(balls, some & ~some)


def test_how_often_one_lamp_is_asked() -> None:
    """The less often, the less it brings beside others."""

    def one(some: NDArray[np.bool_]) -> bool:
        """Of what is near and shines."""
        return not some[flux == FAR].any() and some[(flux > 0.0) & (flux != FAR)].all()

    for flux, distant, asked, drawn in (
        (np.ones(65), 0, 0, DRAWN_OF_ONE),
        (np.ones(2 * DRAWN_OF_ONE), 0, 2 * DRAWN_OF_ONE, 0),
        (np.array([100.0, *[1.0] * 40]), 0, 1, LEAST_OF_ONE),
        (np.array([15.0, *[1.0] * 40]), 0, 1, DRAWN_OF_ONE // 2),
        (np.array([100.0, *[1.0] * 4]), 0, 5, 0),
        (np.array([FAR, 0.0, *[1.0] * 40]), 1, 1, DRAWN_OF_ONE),
    ):
        found = asked_lights(flux, distant, are_one=one)
        assert (len(found.lights), found.drawn) == (asked, drawn)


def test_a_scene_asks_of_one_lamp(device: Device) -> None:
    """Where one is, and it is all that lights."""
    for places, drawn in (((0.0,), DRAWN_OF_ONE), ((0.0, 20.0), DRAWN_RAYS)):
        settings = Settings(width=8, height=8, photons=64, passes=1)
        renderer = prepare(glowing(balls_at(*places)), settings, device)
        assert renderer.eye._tables.asked.drawn == drawn
        renderer.release()


def balls_at(*places: float) -> Builder:
    """Of a radius of 0.5, at places on a line."""
    built = Builder()
    for x in places:
        built.sphere((x, 0.0, 0.0), 0.5, subdivisions=1)
    return built


@pytest.mark.parametrize(
    ("distant", "near", "alone"), [(0, 40, 0), (3, 40, 3), (12, 5, 1), (17, 0, 1), (9, 30, 1)]
)
def test_groups_hold_each_light_once(distant: int, near: int, alone: int) -> None:
    """None is empty, and those afar are in no group of near ones."""
    middles = np.random.default_rng(1).normal(size=(distant + near, 3))
    groups = groups_of(middles, np.ones(len(middles)), distant)
    assert sorted(np.concatenate(groups)) == list(range(len(middles)))
    assert min(map(len, groups)) > 0 and len(groups) <= MOST_GROUPS
    assert sum(group[0] < distant for group in groups) == alone
    assert all((group < distant).all() or (group >= distant).all() for group in groups)


@pytest.mark.parametrize("count", [5120, 1_000_000])
def test_faint_lights_beside_a_strong_one(count: int) -> None:
    """Photons start at each, however little of all it sends: float32 sums would skip most."""
    table = LIGHT.zeros(count + 2)
    flux = np.full((count + 2, 3), 1e-6 / count)
    flux[0], flux[-1] = 1.0, 0.0
    choose_lights(table, flux)
    assert table["chosen"][1:-1].min() > 0.0 and table["chosen"][-1] == 0.0
    assert table["chosen"][0] > 0.85
    assert table["chosen"].sum(dtype=np.float64) == pytest.approx(1.0)
    evenly = np.full((count + 2, 3), 1.0)
    choose_lights(table, evenly)
    assert table["chosen"].min() > 0.5 / count
