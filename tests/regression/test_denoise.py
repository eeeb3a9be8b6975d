# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoise in renders: never worse than without by the strict measure, and what it leaves alone."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from addon.denoiser import Denoiser, DenoiserError, Way
from addon.photon import prepare as preparation
from addon.photon.film import denoise, resolver
from addon.photon.film.error import DARK
from addon.photon.photons.kept import Kept
from addon.photon.prepare import prepare
from addon.photon.scene import Lobe, Material, Scene
from addon.photon.scene.camera import Lens, Motion
from addon.photon.settings import Settings
from addon.streams import Device
from tests.scenes import Builder, cornell, plain_material, random_room
from tests.unit.test_denoiser import needs_it
from tests.unit.test_movement import SCENE as MOVES

from .make_room_references import FILE, SIZE

ROOM = Settings(width=SIZE, height=SIZE, photons=8192, passes=64, seed=5)
SMALL = Settings(width=24, height=16, photons=1000, passes=4, seed=2)


def strict(picture: Any, halves: Any) -> float:
    scale = np.square(halves.mean(axis=0)) + (DARK * halves.mean()) ** 2
    return float(((picture - halves[0]) * (picture - halves[1]) / scale).mean())


def rendered(device: Device, scene: Scene, settings: Settings) -> Any:
    """The renderer after its passes, and its images; it is to be released."""
    renderer = prepare(scene, settings, device)
    for _ in range(settings.passes):
        renderer.render_pass()
    return renderer


@needs_it
@pytest.mark.thorough("all")
@pytest.mark.parametrize(
    ("rooms", "looks"),
    [((0, 3, 7), (1, 2, 3, 8, 16)), (range(10), (1, 2, 3, 5, 8, 16, 32, 64))],
    ids=["some", "all"],
)
def test_never_worse(
    device: Device, rooms: tuple[int, ...], looks: tuple[int, ...], record_property: Any
) -> None:
    """Rooms with mirrors and lobes, whose references are long renders in halves: after few passes
    and many each is as good as without or better, and the error that is told is as true."""
    ratios, told = [], []
    for room in rooms:
        with np.load(FILE) as references:
            halves = references[f"room{room}"].astype(np.float64)
        renderer = prepare(random_room(room), replace(ROOM, denoise=True), device)
        for done in range(1, max(looks) + 1):
            renderer.render_pass()
            if done not in looks:
                continue
            plain = renderer.images(is_preview=True)["Combined"][..., :3]
            plainly = renderer.error().total
            clean = renderer.images()["Combined"][..., :3]
            before, after = strict(plain, halves), strict(clean, halves)
            ratios.append(after / before)
            print(f"room {room}, {done} passes: {before:.2e} -> {after:.2e}")
            if done >= 8:
                told.append(renderer.error().total / plainly / np.sqrt(after / before))
        renderer.release()
    record_property("error with over without", ratios)
    print(f"with over without {min(ratios):.3f} to {max(ratios):.3f}, mean {np.mean(ratios):.3f}")
    print(f"told over true, against without: {min(told):.2f} to {max(told):.2f}")
    assert max(ratios) < 1.02 and np.mean(ratios) < 0.94
    assert min(told) > 0.85 and max(told) < 1.35


@needs_it
def test_a_bulb_in_a_dark_room(device: Device, record_property: Any) -> None:
    """It is a thousand times as bright as the walls: what is denoised with it shines on those."""
    room = cornell(bulb=True)
    dark = tuple(plain_material(material.name, (0.05,) * 3) for material in room.materials)
    room = replace(room, materials=dark, lights=room.lights[1:])
    small = replace(SMALL, width=48, height=48, photons=3 * 48 * 48)
    truth = rendered(device, room, replace(small, passes=64, seed=7))
    expected = truth.images(["Combined"])["Combined"][..., :3].astype(np.float64)
    truth.release()
    renderer = prepare(room, replace(small, denoise=True), device)
    ratios = []
    for done in range(1, 9):
        renderer.render_pass()
        looks = [renderer.images(["Combined"], x)["Combined"] for x in (True, False)]
        before, after = (strict(look[..., :3], np.stack([expected] * 2)) for look in looks)
        ratios.append(after / before)
        print(f"{done} passes: {before:.2e} -> {after:.2e}")
    told = renderer.error().total / np.sqrt(after)
    print(f"told over true: {told:.2f}")
    renderer.release()
    record_property("error with over without", ratios)
    assert max(ratios) < 1.02 and 0.7 < told < 1.6


@needs_it
def test_what_it_leaves_alone(device: Device) -> None:
    """All images but Combined and Error, alpha, and previews: bit for bit. No lobe is broad."""
    scene = cornell(True)
    without = rendered(device, scene, SMALL)
    expected = without.images()
    without.release()
    renderer = rendered(device, scene, replace(SMALL, denoise=True, denoising_data=True))
    preview, images = renderer.images(is_preview=True), renderer.images()
    again = renderer.images()
    info = renderer.info()
    renderer.release()
    assert {"Denoising Albedo", "Denoising Normal"} == images.keys() - expected.keys()
    for name, image in expected.items():
        assert np.array_equal(preview[name], image), name
        if name not in ("Combined", "Error"):
            assert np.array_equal(images[name], image), name
    assert np.array_equal(images["Combined"][..., 3], expected["Combined"][..., 3])
    assert not np.array_equal(images["Combined"], expected["Combined"])
    assert np.array_equal(images["Combined"], again["Combined"])
    assert info["denoiser"].startswith("OpenImageDenoise 2.") and "denoise" in info["seconds"]
    assert (images["Combined"] >= 0).all()


@needs_it
def test_strips_change_no_bit(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    for strip in (1 << 19, 24 * 4):
        monkeypatch.setattr("addon.photon.backends.backend.STRIP_PIXELS", strip)
        monkeypatch.setattr("addon.photon.backends.backend.GPU_STRIP_PIXELS", strip)
        renderer = rendered(device, cornell(True), replace(SMALL, denoise=True))
        made.append(renderer.images())
        renderer.release()
    assert all(np.array_equal(made[0][name], made[1][name]) for name in made[0])


@pytest.mark.parametrize("backend", ["native", "fragment"])
def test_features(device: Device, backend: Any) -> None:
    """A mirror that fills the left half of the picture shows the wall behind the camera, tinted;
    on the right there is a wall."""
    materials = [
        plain_material("mirror", (0.0, 0.0, 0.0), (0.5, 0.8, 0.9)),
        plain_material("wall", (0.3, 0.2, 0.1)),
        plain_material("behind", (0.6, 0.5, 0.4)),
    ]
    plates = Builder()
    plates.quad((-4, -4, 0), (0, -4, 0), (0, 4, 0), (-4, 4, 0), 0)
    plates.quad((0, -4, 0), (4, -4, 0), (4, 4, 0), (0, 4, 0), 1)
    plates.quad((-90, -90, 9), (-90, 90, 9), (90, 90, 9), (90, -90, 9), 2)
    scene = cornell()
    matrix = np.eye(4)
    matrix[2, 3] = 3.0
    scene = plates.scene(replace(scene.camera, matrix=matrix), scene.lights, materials)
    settings = replace(SMALL, width=16, height=16, denoising_data=True, backend=backend)
    renderer = rendered(device, scene, settings)
    images = renderer.images()
    renderer.release()
    albedo, normal = images["Denoising Albedo"], images["Denoising Normal"]
    assert np.allclose(albedo[:, :6], np.array([0.5, 0.8, 0.9]) * [0.6, 0.5, 0.4], atol=1e-3)
    assert np.allclose(albedo[:, 10:], [0.3, 0.2, 0.1], atol=1e-3)
    assert np.allclose(normal[:, :6], [0, 0, -1], atol=1e-3)
    assert np.allclose(normal[:, 10:], [0, 0, 1], atol=1e-3)


def test_absent(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is said before the first pass, and the picture is that without."""
    monkeypatch.setattr(preparation, "find", lambda: None)
    renderer = rendered(device, cornell(), replace(SMALL, denoise=True))
    assert any("not denoised: OpenImageDenoise is not here" in x for x in renderer.warnings)
    found = renderer.images()
    renderer.release()
    without = rendered(device, cornell(), SMALL)
    assert np.array_equal(found["Combined"], without.images()["Combined"])
    without.release()


def test_failing(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What fails in the end leaves the picture as it is, and says so."""

    def fails(*_: Any) -> None:
        raise DenoiserError("out of memory")

    monkeypatch.setattr(preparation, "find", lambda: "there")
    monkeypatch.setattr(resolver, "picture_denoised", fails)
    renderer = rendered(device, cornell(), replace(SMALL, denoise=True))
    assert not any("denoised" in x for x in renderer.warnings)
    plain, found = renderer.images(is_preview=True), renderer.images()
    assert renderer.warnings[-1] == "not denoised: out of memory"
    assert np.array_equal(plain["Combined"], found["Combined"])
    assert renderer.info()["denoiser"] == "none"
    renderer.release()


@needs_it
def test_it_stays_open(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """From one render to the next, as long as the scene is kept; without that, for one."""
    opened, closed = [], []
    monkeypatch.setattr(denoise, "Denoiser", lambda: opened.append(Denoiser()) or opened[-1])
    close = Denoiser.close
    monkeypatch.setattr(Denoiser, "close", lambda self: closed.append(self) or close(self))

    def shown(kept: Kept | None) -> Any:
        settings = Settings(16, 12, photons=300, passes=2, denoise=True)
        renderer = prepare(cornell(), settings, device, kept)
        for _ in range(2):
            renderer.render_pass()
        images = renderer.images()
        renderer.release()
        return images["Combined"]

    kept = Kept(device)
    first, second = shown(kept), shown(kept)
    assert len(opened) == 1 and not closed
    kept.release()
    assert closed == opened
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(first, shown(None))
    assert len(opened) == 2 and closed == opened


@needs_it
def test_a_gpu_without_room(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The processor takes over, with the bits that it would have made."""
    tried: list[bool] = []

    class Full(Denoiser):
        def __init__(self, on_cpu: bool = False) -> None:
            super().__init__(on_cpu=True)
            self._is_full = not on_cpu
            tried.append(on_cpu)

        def filtering(self, *args: Any) -> Any:
            if self._is_full:
                raise DenoiserError("out of memory")
            return super().filtering(*args)

    made = []
    for kind in (partial(Denoiser, on_cpu=True), Full):
        monkeypatch.setattr(denoise, "Denoiser", kind)
        renderer = rendered(device, cornell(), replace(SMALL, denoise=True))
        made.append(renderer.images()["Combined"])
        assert not any("denoised" in x for x in renderer.warnings)
        renderer.release()
    assert tried == [False, True] and np.array_equal(*made)


@needs_it
@pytest.mark.parametrize("what", ["still", "mirror", "glass", "lens", "moves", "camera moves"])
def test_which_features_are_noisy(
    device: Device, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that chance decides; they are filtered first, until there are passes enough to tell
    which way is better."""
    scene = MOVES if what == "moves" else cornell(mirror=what in ("mirror", "glass"))
    if what == "glass":
        given = {"ior": 1.5, "tint": (1.0,) * 3, "reflects": 2.0, "open": 0.0}
        lobe = Lobe("glass", (1.0,) * 3, given)
        ball = Material("glass", (0.0,) * 3, (lobe,))
        scene = replace(scene, materials=(*scene.materials[:-1], ball))
    if what == "lens":
        scene = replace(scene, camera=replace(scene.camera, lens=Lens(0.1, 4.0)))
    if what == "camera moves":
        motion = Motion(np.stack([scene.camera.matrix] * 2))
        scene = replace(scene, camera=replace(scene.camera, motion=motion))
    renderer = rendered(device, scene, replace(SMALL, passes=7, denoise=True))
    ways = renderer._denoised.ways
    with Denoiser(on_cpu=True) as denoiser:
        assert ways(denoiser) == (Way.GIVEN,)  # of few rays
        renderer.render_pass()
        way = Way.GIVEN if what in ("still", "mirror") else Way.FILTERED
        assert ways(denoiser) == (way,)
        monkeypatch.setitem(denoise.FEWEST_FOR_TWO, False, 8)
        assert ways(denoiser) == (way, Way.LARGEST)
    renderer.release()


@needs_it
def test_takes(device: Device) -> None:
    """A scene of light groups: each take is denoised, and their sum is the picture."""
    scene = cornell()
    (lamp,) = scene.lights[:1]
    groups = ("Key", "Fill")
    lights = tuple(replace(lamp, name=group, group=group) for group in groups)
    scene = replace(scene, lights=(*lights, *scene.lights[1:]), light_groups=groups)
    renderer = rendered(device, scene, replace(SMALL, passes=8, denoise=True, denoising_data=True))
    plain, found = renderer.images(is_preview=True), renderer.images()
    assert not np.array_equal(plain["Combined"], found["Combined"])
    assert (
        np.isfinite(found["Error"]).all() and (found["Error"] <= 1.01 * plain["Error"]).mean() > 0.5
    )
    total = sum(found[f"Combined_{group}"] for group in groups)
    assert np.allclose(total, found["Combined"][..., :3], rtol=1e-4, atol=1e-5)
    assert np.array_equal(plain["Denoising Normal"], found["Denoising Normal"])
    assert np.abs(found["Denoising Albedo"]).max() <= 1.0
    assert renderer.info()["denoiser"].startswith("OpenImageDenoise 2.")
    renderer.release()


@needs_it
def test_dim_and_bright(device: Device) -> None:
    """Light of any power is denoised alike."""
    scene, made = cornell(), []
    for times in (1.0, 2.0**-40, 2.0**40):
        lights = [replace(x, power=tuple(times * p for p in x.power)) for x in scene.lights]
        lit = replace(scene, lights=tuple(lights))
        renderer = rendered(device, lit, replace(SMALL, denoise=True, passes=8))
        made.append((renderer.images()["Combined"][..., :3] / times, renderer.error().total))
        renderer.release()
    for picture, told in made[1:]:
        assert np.allclose(picture, made[0][0], rtol=1e-4) and told == pytest.approx(made[0][1])
