# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes are rendered together, and no bit of a picture changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon import memory
from addon.photon.backends import backend as backend_module
from addon.photon.backends.backend import backend_of
from addon.photon.errors import DeviceError
from addon.photon.eye.eye import Eye
from addon.photon.film.film import Film, HostFilm, half_of
from addon.photon.kernels.cuts import Cuts
from addon.photon.kernels.records import RADIANCE
from addon.photon.memory import Budget
from addon.photon.photons import grid_sort
from addon.photon.photons.device_photon_mapper import DevicePhotonMapper
from addon.photon.photons.grid_sort import HostSort
from addon.photon.photons.kept import Kept
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.photon_pass import SPARE_DEPOSITS
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.scene import Scene
from addon.photon.scene.camera import Motion
from addon.photon.settings import Settings
from addon.photon.stage.needs import SceneNeeds
from addon.photon.takes_renderer import TakesRenderer
from addon.streams import Device, OfParts, Stream, StreamError
from tests.measure import assert_same
from tests.physics.test_dispersion import material as dispersive
from tests.scenes import cornell
from tests.unit.kept_frames import moved
from tests.unit.test_compaction import SETTINGS, shiny, veiled
from tests.unit.test_takes import grouped
from tests.unit.test_together import misty, waxen

OURS = replace(SETTINGS, backend="compute", passes=11)
PLAIN = Settings(24, 16, photons=1500, passes=19, mirror_depth=3, backend="compute")
GROUPS = [1, 1, 2, 4, 8, 1, 2]  # of PLAIN; pass 16 learns where photons shall start


pytestmark = pytest.mark.usefixtures("resident")


def dispersing() -> Scene:
    """A room with a ball of glass that disperses, and one that shines."""
    scene = cornell(True, bulb=True)
    return replace(scene, materials=(*scene.materials[:3], dispersive(rough=True)))


def shaken() -> Scene:
    """A room before a camera that moves."""
    scene = cornell()
    matrices = np.stack([scene.camera.matrix] * 2)
    matrices[1, 0, 3] += 0.3
    return replace(scene, camera=replace(scene.camera, motion=Motion(matrices)))


def rendered(renderer: Renderer, most: int = 8) -> tuple[dict[str, Any], list[int]]:
    """All passes' images, and how many were rendered together."""
    passes, together = renderer.settings.passes, []
    while renderer.film.passes < passes:
        together.append(renderer.render_passes(min(most, passes - renderer.film.passes)))
    images = renderer.images() | {"total": np.array(renderer.error().total)}
    renderer.release()
    return images, together


@pytest.mark.parametrize("scene", [shiny, veiled, misty, waxen, dispersing])
@pytest.mark.parametrize("first_pass", [0, 1])
@pytest.mark.thorough("1-shiny", "1-misty", "1-waxen", "0-waxen", "1-veiled", "dispersing")
def test_no_bit_changes(device: Device, scene: Callable[[], Scene], first_pass: int) -> None:
    settings = replace(OURS, first_pass=first_pass)
    expected, alone = rendered(prepare(scene(), settings, device), most=1)
    found, together = rendered(prepare(scene(), settings, device))
    assert alone == [1] * settings.passes and together == [1, 1, 2, 4, 3]
    assert found["Indirect"].any() and found["Mirror"].any()
    assert_same(found, expected)


def test_photons_that_start_elsewhere_from_a_pass_on(device: Device) -> None:
    """Those of passes together start alike."""
    settings = replace(PLAIN, first_pass=10, passes=12)
    expected, _ = rendered(prepare(cornell(), settings, device), most=1)
    found, together = rendered(prepare(cornell(), settings, device))
    assert together == [1, 1, 2, 2, 1, 5]  # as in GROUPS
    assert_same(found, expected)


def test_where_photons_crowd(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The host sorts them, and each pass adds up its own in several launches."""
    monkeypatch.setattr(grid_sort, "MAX_ADDED", 300)
    settings = replace(PLAIN, radius=20.0)  # in few cells
    monkeypatch.setattr(grid_sort, "_is_crowded", lambda *_: True)
    renderer = prepare(cornell(), settings, device)
    expected, _ = rendered(renderer, most=1)
    assert renderer.launches()["gather"] > 2 * settings.passes
    run, sorted_passes = HostSort.run, []

    def noted(self: HostSort, deposits: Any, grids: Any, span: int) -> Any:
        sorted_passes.append(len(grids))
        return run(self, deposits, grids, span)

    monkeypatch.setattr(HostSort, "run", noted)
    found, _ = rendered(prepare(cornell(), settings, device))
    assert 4 in sorted_passes
    assert_same(found, expected)


def test_lanes_that_share_probes(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of one work group are of two passes, one of which asks for more."""
    monkeypatch.setattr(backend_module, "lanes_of_probes", lambda *_: 4)
    settings = replace(PLAIN, height=15, first_pass=1, passes=9)
    expected, _ = rendered(prepare(cornell(True), settings, device), most=1)
    found, together = rendered(prepare(cornell(True), settings, device))
    assert together == [1, 1, 2, 4, 1]  # of these four the last one
    assert_same(found, expected)


def test_a_bounce_a_launch(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where materials are long to compile."""
    monkeypatch.setattr(SceneNeeds, "shades_long", True)
    settings = replace(PLAIN, passes=11)
    expected, _ = rendered(prepare(cornell(True), settings, device), most=1)
    found, _ = rendered(prepare(cornell(True), settings, device))
    assert_same(found, expected)


@pytest.mark.thorough
def test_takes(device: Device) -> None:
    """Each take's photons fly ahead for as many passes as come next."""
    settings = replace(PLAIN, passes=11)
    expected, _ = rendered(prepare(grouped(), settings, device), most=1)
    renderer = prepare(grouped(), settings, device)
    assert isinstance(renderer, TakesRenderer)
    found, together = rendered(renderer)
    assert together == [1, 1, 2, 4, 3]
    assert_same(found, expected)


def test_no_room_for_all(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Then one by one."""
    settings = replace(PLAIN, passes=11)
    expected, _ = rendered(prepare(cornell(True), settings, device), most=1)
    start = DevicePhotonMapper.start

    def refuse(mapper: DevicePhotonMapper, batch: PhotonBatch) -> None:
        if batch.passes > 2:
            raise StreamError("no room")
        start(mapper, batch)

    monkeypatch.setattr(DevicePhotonMapper, "start", refuse)
    found, together = rendered(prepare(cornell(True), settings, device))
    assert together == [1] * 11
    assert_same(found, expected)


def test_lists_that_are_too_short(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """For the deposits of many passes."""
    renderer = prepare(cornell(), PLAIN, device)
    assert renderer.photons
    landed = renderer.photons.field.deposits
    monkeypatch.setattr(renderer.photons, "_most_deposits", 3.2 * SPARE_DEPOSITS * landed)
    _, together = rendered(renderer)
    assert max(together) == 3


def test_who_asks_for_other_numbers(device: Device) -> None:
    """Photons that are under way ahead are of none that is rendered next."""
    settings = replace(PLAIN, passes=11)
    expected, _ = rendered(prepare(cornell(True), settings, device), most=1)
    renderer, together = prepare(cornell(True), settings, device), []
    for most in (2, 1, 4, 3, 1, 2, 4):
        together.append(renderer.render_passes(most))
    assert together == [1, 1, 2, 3, 1, 2, 4]
    # More than the settings have: their last three were not to be.
    assert renderer.film.passes == 14
    renderer.release()
    again = prepare(cornell(True), settings, device)
    for most in (2, 1, 2, 1, 4):
        again.render_passes(most)
    found, _ = rendered(again, most=2)
    assert_same(found, expected)


def test_what_is_kept(device: Device) -> None:
    """Another view finds the photons of passes together."""
    kept, scene, settings = Kept(device), cornell(True), replace(PLAIN, passes=11)
    rendered(prepare(scene, settings, device, kept))
    fresh, _ = rendered(prepare(moved(scene, 0.1), settings, device))
    again = prepare(moved(scene, 0.1), settings, device, kept)
    images, together = rendered(again)
    assert together == [1, 1, 2, 4, 3] and again.launches().get("generator", 0) == 0
    kept.release()
    assert_same(images, fresh)


def test_passes_that_failed_are_forgotten(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    expected, _ = rendered(prepare(cornell(True), PLAIN, device), most=1)
    renderer, look = prepare(cornell(True), PLAIN, device), Eye.look
    while renderer.film.passes < 4:
        renderer.render_passes(4)

    def failing(self: Eye, paths: Any, photons: Any) -> None:
        look(self, paths, photons)
        raise StreamError("in the middle of passes")

    with monkeypatch.context() as patched:
        patched.setattr(Eye, "look", failing)
        with pytest.raises(DeviceError, match="in the middle of passes"):
            renderer.render_passes(4)
    assert renderer.film.passes == 4
    found, _ = rendered(renderer)
    assert_same(found, expected)


@pytest.mark.parametrize(
    ("scene", "changes"),
    [(cornell, {"estimator": "splat"}), (shaken, {}), (cornell, {"photons": 0})],
    ids=["splats", "a camera that moves", "no photons"],
)
def test_which_are_not(device: Device, scene: Callable[[], Scene], changes: dict[str, Any]) -> None:
    settings = replace(PLAIN, passes=8, **changes)
    _, together = rendered(prepare(scene(), settings, device))
    assert together == ([1] * 8 if changes.get("photons") is None else [1, 1, 2, 4])


def test_how_many(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """As there is room for, and no render is refused for them."""
    monkeypatch.setattr(device, "is_software", False)
    monkeypatch.setattr(device, "buffer_limit", 1 << 31)
    free: int | None = 1 << 40
    monkeypatch.setattr(device, "free_memory", lambda: free, raising=False)
    monkeypatch.setattr(memory, "free_host_memory", lambda: None)

    def passes(width: int, height: int, photons: int | None = None) -> int:
        settings = Settings(width, height, photons=photons, backend="compute")
        return Budget(cornell(), settings, backend_of(settings, device)).passes

    found = [passes(*size) for size in ((512, 512), (1024, 1024), (1920, 1080), (4096, 4096))]
    assert found == [8, 2, 1, 1]
    assert [passes(512, 512, photons=1 << n) for n in (21, 23, 24)] == [8, 2, 1]
    free = None
    alone = Budget(
        cornell(), Settings(512, 512, backend="compute"), backend_of(Settings(), device)
    ).needed(passes=1)
    counts = []
    for share in (1.01, 4.0, 8.0, 16.0, 64.0):
        free = int(share * alone)
        counts.append(passes(512, 512))
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] == 8


def test_a_film_of_passes_together(device: Device) -> None:
    """Its sums are those of one after the other, and what numpy makes of them."""
    size, names, halved = (8, 3), ("combined", "direct", "indirect"), ("direct", "indirect")
    random = np.random.default_rng(2)
    films: list[Film | HostFilm] = [
        Film(device, layer, size, names, halved=halved) for layer in ("compute", "compute")
    ]
    films.append(HostFilm(size, names, halved))
    for film in films:
        film.prepare()
    streams = {name: Stream(device, RADIANCE, (size[0], 4 * size[1])) for name in names}
    one = {name: Stream(device, RADIANCE, size) for name in names}
    for passes in (1, 1, 2, 4, 3, 4):
        given = random.lognormal(size=(len(names), 4 * size[1], size[0], 4)).astype(np.float32)
        for image, stream in zip(given, streams.values(), strict=True):
            stream.upload(image)
        films[0].add(streams, passes)
        for number in range(passes):
            rows = slice(number * size[1], (number + 1) * size[1])
            for image, stream in zip(given, one.values(), strict=True):
                stream.upload(image[rows].copy())
            for film in films[1:]:
                film.add(one)
    first, *others, host = (film.statistics() for film in films)
    for other in others:
        assert (other.passes, other.half_passes) == (first.passes, first.half_passes) == (15, 8)
        assert_same(other.means | other.halves, first.means | first.halves)
        for length, squares in first.squares.items():
            np.testing.assert_array_equal(other.squares[length].total, squares.total)
    for name, image in (host.means | host.halves).items():
        np.testing.assert_allclose({**first.means, **first.halves}[name], image, rtol=1e-7)
    assert half_of("direct") in films[0].sums  # of Film alone
    for film in films:
        film.release()
    for stream in (*streams.values(), *one.values()):
        stream.release()


def test_parts_of_a_stream_are_as_high(device: Device) -> None:
    """Five rows are not of two passes."""
    kernel = Cuts(device, "compute")
    ports = {**kernel.inputs, **kernel.outputs}
    streams = {name: Stream(device, record, (4, 5)) for name, record in ports.items()}
    tables = {name: device.texture((4, 4), 4) for name in kernel.tables}
    with pytest.raises(StreamError, match="5 rows are not of 2 parts"):
        kernel.run(streams, tables, {"radius_scale": OfParts((1.0, 2.0))})
    for stream in streams.values():
        stream.release()
    for texture in tables.values():
        device.put_back(texture)
