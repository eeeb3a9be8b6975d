# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of several takes: what each holds, and how their pictures are put together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.photon.backends.backend import backend_of
from addon.photon.errors import SceneError
from addon.photon.film.composite import composite
from addon.photon.film.error import relative_squares
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import (
    ALL_RAYS,
    BLACK,
    CATCHER,
    HOLDOUT,
    RAY_BITS,
    TRANSPARENT,
    Lobe,
    Material,
    Medium,
    Scene,
    point_light,
)
from addon.photon.scene.snapshot import same
from addon.photon.scene.takes import Take, takes_of
from addon.photon.settings import Settings
from addon.photon.stage.glow import lit_by_media
from addon.photon.takes_renderer import TakesRenderer, settings_of
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, backdrop, camera, cornell

SETTINGS = Settings(width=16, height=16, passes=8, photons=2000)
CAMERA = RAY_BITS["camera"]
WHITE = (1.0, 1.0, 1.0)


def grouped() -> Scene:
    """Two groups, of which one has a lamp that subtracts and an emissive box; a lamp of none."""
    scene = cornell()
    (lamp,) = scene.lights
    lights = (
        replace(lamp, group="Key"),
        replace(
            point_light("Hole", (2.0, 2.0, 3.0), (5.0, 5.0, 5.0)), group="Fill", subtracts=True
        ),
        point_light("Lone", (2.0, 2.0, 4.0), (50.0, 50.0, 50.0)),
        *(replace(light, group="Other") for light in backdrop((0.1, 0.1, 0.1))),
    )
    emissive = Material("emissive", emission=(1.0, 2.0, 3.0))
    names = tuple("Fill" if number == 1 else "" for number in range(len(scene.surfaces)))
    return replace(
        scene,
        lights=lights,
        materials=(*scene.materials, emissive),
        material=np.where(scene.surface <= 1, len(scene.materials), scene.material).astype(
            np.int32
        ),
        light_groups=("Key", "Fill", "Empty"),
        surface_groups=names,
    )


def catching(**changes: object) -> Scene:
    """A floor that catches shadows."""
    scene = cornell()
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[0] |= CATCHER
    return replace(
        scene, visible=visible, lights=(*scene.lights, *backdrop((0.1, 0.1, 0.1))), **changes
    )


def test_most_scenes_are_their_own_take(device: Device) -> None:
    """To the object, and are rendered by nothing more."""
    scene = cornell()
    (take,) = takes_of(scene, is_transparent=True)
    assert take == Take(scene, "all", "", 1.0) and take.scene is scene
    renderer = prepare(scene, SETTINGS, device)
    assert not isinstance(renderer, TakesRenderer)
    renderer.release()


def test_each_light_has_one_take() -> None:
    scene = grouped()
    takes = takes_of(scene, is_transparent=False)
    found = [(take.group, take.sign, [light.name for light in take.scene.lights]) for take in takes]
    assert found == [
        ("Key", 1.0, ["spot"]),
        ("Fill", 1.0, []),
        ("Fill", -1.0, ["Hole"]),
        ("", 1.0, ["Lone", scene.lights[3].name]),
    ]
    materials = [np.array([m.is_emissive for m in x.scene.materials]) for x in takes]
    emissive = [of[x.scene.material] for x, of in zip(takes, materials, strict=True)]
    where = [sorted(set(x.scene.surface[on])) for x, on in zip(takes, emissive, strict=True)]
    assert where == [[], [1], [], [0]]
    for take in takes:
        take.scene.check()
        assert takes_of(take.scene, False)[0].scene is take.scene


def test_media_emit_in_one_take(device: Device) -> None:
    """What the eye sees of them, and their lamps."""
    glow = Material("glow", BLACK, (Lobe(TRANSPARENT, WHITE),), medium=Medium(emission=WHITE))
    built = Builder().box((-2, -1, 0), (-1, 1, 1), 0).box((1, -1, 0), (2, 1, 1), 0)
    scene = built.scene(camera((0, -5, 1), (0, 0, 1), 40), [], [glow])
    grouped_so = {"light_groups": ("Fill",), "surface_groups": ("Fill", "")}
    scene = replace(scene, surfaces=("one", "other"), surface=np.arange(24) // 12, **grouped_so)
    kept = Kept(device)
    lit = kept.worked_out(scene, 16, backend_of(SETTINGS, device))
    takes = takes_of(lit, is_transparent=False)
    assert [take.group for take in takes] == ["Fill", ""]
    for take, side in zip(takes, (-1, 1), strict=True):
        own = take.scene
        assert len(own.lights) > 100 and all(side * x.position[0] > 1.0 for x in own.lights)
        glows = np.array([material.medium.glows for material in own.materials])[own.material]
        assert (glows == (own.surface == (side > 0))).all()
    kept.release()


def test_what_media_emit_is_away_with_them() -> None:
    """Where what catches shadows is alone."""
    glow = Material("glow", BLACK, (Lobe(TRANSPARENT, WHITE),), medium=Medium(emission=WHITE))
    built = Builder().quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0), 0)
    built.box((-1, -1, 0), (1, 1, 1), 1)
    scene = built.scene(camera((0, -5, 1), (0, 0, 1), 40), [], [Material("floor"), glow])
    bits = np.array([ALL_RAYS | CATCHER, ALL_RAYS], np.uint8)
    surface = np.repeat([0, 1], [2, 12])
    scene = replace(scene, surfaces=("floor", "box"), surface=surface, visible=bits)
    lit = lit_by_media(scene)
    found = {x.part: len(x.scene.lights) > 100 for x in takes_of(lit, is_transparent=True)}
    assert found == {"others": True, "caught": True, "alone": False}


def test_bits_of_catchers() -> None:
    others, caught, alone, behind = (take.scene for take in takes_of(catching(), False))
    assert [int(x.visible[0]) for x in (others, caught, alone, behind)] == [
        ALL_RAYS | HOLDOUT,
        ALL_RAYS,
        ALL_RAYS,
        CAMERA,
    ]
    assert [int(x.visible[1]) for x in (others, caught, alone, behind)] == [
        ALL_RAYS,
        ALL_RAYS | HOLDOUT,
        CAMERA | HOLDOUT,
        CAMERA,
    ]
    assert not any("camera" in light.found_by for x in (caught, alone) for light in x.lights)
    assert [light.found_by for light in behind.lights] == [("camera",)]
    assert len(takes_of(catching(), is_transparent=True)) == 3


def test_files(tmp_path: Path) -> None:
    for scene in (grouped(), catching()):
        scene.save(tmp_path / "scene.npz")
        assert same(Scene.load(tmp_path / "scene.npz"), scene)
    with pytest.raises(SceneError, match="surface_groups: 1 of"):
        replace(grouped(), surface_groups=("Key",)).check()


def test_what_is_put_together(device: Device) -> None:
    """Each take is rendered as it would be alone, bit for bit, and again so with what is kept; the
    groups and the rest add up to the whole, as do its parts."""
    scene, kept = grouped(), Kept(device)
    found = []
    for _ in range(2):
        renderer = prepare(scene, SETTINGS, device, kept)
        for _ in range(SETTINGS.passes):
            renderer.render_pass()
        found.append(renderer.images())
        error, info, counts = renderer.error(), renderer.info(), renderer.launches()
        renderer.release()
    kept.release()
    assert all(np.array_equal(found[0][name], found[1][name]) for name in found[0])
    takes = takes_of(scene, False)
    settings = {"width": 16, "height": 16, "passes": 8, "photons": 2000, "radius_decay": 2 / 3}
    shots = [(take, render(device, take.scene, **settings)) for take in takes]
    alone = composite(shots, scene.light_groups, is_transparent=False)
    assert found[0].keys() == alone.keys()
    assert all(np.array_equal(found[0][name], alone[name]) for name in alone)
    whole = found[0]["Combined"][..., :3]
    rest = shots[-1][1]["Combined"][..., :3]
    groups = [found[0][f"Combined_{name}"] for name in scene.light_groups]
    np.testing.assert_allclose(sum(groups) + rest, whole, atol=1e-5)
    assert not groups[2].any() and groups[0].any() and (groups[1] != 0.0).any()
    parts = ("Direct", "Indirect", "Mirror", "Emission", "Background")
    np.testing.assert_allclose(sum(found[0][name] for name in parts), whole, atol=1e-5)
    assert info["photons"] == 4 * 8 * 2000 and counts["combine_all"] == 4 * 8
    brightness = whole.mean(axis=-1)
    floor = 0.1 * np.abs(brightness).mean()
    told = np.sqrt(relative_squares(found[0]["Error"][..., 0], brightness, floor).mean())
    assert error.total == pytest.approx(told, rel=1e-5) and 0.0 < error.total < 1.0


def of_one(colour: float, alpha: float, error: float = 0.0) -> dict[str, np.ndarray]:
    """Pictures of a pixel."""
    grey = np.full((1, 1, 3), colour, np.float32)
    rest = dict.fromkeys(("Background", "Normal"), grey)
    combined = np.concatenate([grey, np.full((1, 1, 1), alpha, np.float32)], axis=-1)
    told = np.full((1, 1, 1), error, np.float32)
    return {"Combined": combined, **rest, "Depth": told, "Error": told}


@pytest.mark.parametrize("is_transparent", [True, False])
@pytest.mark.parametrize(
    ("caught", "alone", "left"),
    [(0.3, 0.4, 0.75), (0.5, 0.4, 1.0), (0.0, 0.4, 0.0), (0.2, 0.0, 1.0), (0.0, 0.0, 1.0)],
)
def test_shadows(is_transparent: bool, caught: float, alone: float, left: float) -> None:
    """A pixel of which a quarter is another thing, the rest a catcher."""
    opaque = 0.25
    shots = [
        (Take(cornell(), "others", "", 1.0), of_one(0.1, opaque)),
        (Take(cornell(), "caught", "", 1.0), of_one(caught, 0.75)),
        (Take(cornell(), "alone", "", 1.0), of_one(alone, 0.75)),
        (Take(cornell(), "behind", "", 1.0), of_one(0.8, 1.0)),
    ]
    found = composite(shots, (), is_transparent)["Combined"][0, 0]
    alpha = opaque + 0.75 * (1.0 - left)
    if is_transparent:
        np.testing.assert_allclose(found, (0.1, 0.1, 0.1, alpha), rtol=1e-6)
    else:
        np.testing.assert_allclose(found, (*[0.1 + 0.8 * (1.0 - alpha)] * 3, 1.0), rtol=1e-6)


def test_settings_of_takes() -> None:
    takes = {take.part: take for take in takes_of(catching(), False)}
    of_part = {part: settings_of(take, SETTINGS) for part, take in takes.items()}
    assert of_part["others"] is SETTINGS
    assert of_part["caught"].transparent and of_part["alone"].transparent
    assert of_part["behind"].photons == 0
