# SPDX-License-Identifier: GPL-3.0-or-later
"""The radii: as many photons in a disc everywhere, at every scale, and never less than a pixel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import photon_stream_native as native
import pytest

from addon.photon.backends import backend as backend_module
from addon.photon.backends.backend import ResidentBackend
from addon.photon.kernels.records import RADIUS_GRID
from addon.photon.photons.deposits import Copy, DeviceDeposits
from addon.photon.photons.device_radii import _ordered, _within, radii_on_device
from addon.photon.photons.radius_field import SAMPLE, grids_on_host, radius_scale, sample_of
from addon.photon.prepare import photons_per_disc, prepare
from addon.photon.settings import Settings
from addon.streams import TABLE_WIDTH, Device
from tests.measure import render
from tests.scenes import Builder, camera, cornell, plain_light, with_cone

# Normals as deposits have them: +x, -x, +y, -y, +z, -z and one that counts for three sides.
PACKED = [4096 * 4095 + 2048, 2048, 4096 * 2048 + 4095, 4096 * 2048, 4096 * 2048 + 2048]
PACKED += [4096 * 4095 + 4095, 4096 * 2730 + 2730]
UP, DOWN, BACK = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)


def radii(device: Device, scene: Any, positions: Any, normals: Any = UP, **settings: Any) -> Any:
    """Radii of the first pass [m] at positions (n, 3) [m] of surfaces with these normals."""
    settings = {"width": 512, "height": 512} | settings
    renderer = prepare(scene, Settings(**settings), device)
    at, facing = np.zeros((2, len(positions), 4), np.float32)
    at[:, :3] = renderer.frame.points(positions)
    facing[:, :3] = normals
    found = renderer.photons.field.on_host.at(at, facing) * renderer.frame.scale
    renderer.release()
    return found


def test_shrinks_as_published() -> None:
    """Against the recursion of Knaus & Zwicker 2011, eq. 15, term by term."""
    square = 1.0
    for i in range(1, 2000):
        assert radius_scale(2 / 3, i - 1) == pytest.approx(square**0.5, rel=1e-9)
        square *= (i + 2 / 3) / (i + 1)
    assert radius_scale(1.0, 100) == pytest.approx(1.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_grow_with_the_scene(device: Device, scale: float) -> None:
    """The same photons in a room of another size: radii of another size."""
    places = np.array([[5, 5, 0], [2, 9.9, 5], [9, 2, 0]], float)
    normals = (UP, BACK, UP)
    small = radii(device, cornell(), places, normals, photons=20000)
    scene = cornell()
    matrix = np.array(scene.camera.matrix, float)
    matrix[:3, 3] *= scale
    scaled = replace(
        scene,
        vertices=scene.vertices * scale,
        camera=replace(scene.camera, matrix=matrix),
        lights=tuple(
            replace(light, position=tuple(np.multiply(light.position, scale)))
            for light in scene.lights
        ),
    )
    large = radii(device, scaled, places * scale, normals, photons=20000)
    np.testing.assert_allclose(large, small * scale, rtol=1e-3)


def test_small_where_photons_are_dense(device: Device) -> None:
    """A lit corner of a large scene: the disc holds what was asked for, near and far."""
    floor = Builder().quad((-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0))
    floor.quad((-1, -1, 2), (-1, 1, 2), (1, 1, 2), (1, -1, 2))  # throws light back around it
    light = replace(with_cone(cornell().lights[0], 2.0), position=(0.0, 0.0, 1.0))
    scene = floor.scene(camera((0, -30, 20), (0, 0, 0), 60), [light])
    near, far = radii(device, scene, np.array([[0, 0, 0], [30, 30, 0]], float), photons=200000)
    assert near < 0.5 and far > 4 * near


def test_the_other_side_of_a_wall_does_not_count(device: Device) -> None:
    """A floor lit from above, three times as much as its underside is from below."""
    floor = Builder().quad((-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0))
    for z in (6.0, -6.0):  # throw light back
        floor.quad((-5, -5, z), (5, -5, z), (5, 5, z), (-5, 5, z))
    lamp = plain_light("lamp", "POINT", (0.0, 0.0, 3.0), (99.0,) * 3)
    below = replace(lamp, position=(0.0, 0.0, -3.0), power=(33.0,) * 3)
    scene = floor.scene(camera((0, -30, 20), (0, 0, 0), 60), [lamp, below])
    places = np.zeros((2, 3))
    above, beneath = radii(device, scene, places, (UP, DOWN), photons=1 << 21)
    assert beneath == pytest.approx(3**0.5 * above, rel=0.2)


def test_never_less_than_a_pixel(device: Device) -> None:
    """Many photons, few pixels: a disc is as wide as a pixel where it is seen."""
    scene, place = cornell(), np.array([[5.0, 5.0, 0.0]])
    fine, coarse = (
        radii(device, scene, place, photons=200000, width=n, height=n)[0] for n in (512, 4)
    )
    left, right, _, _ = scene.camera.window
    distance = np.linalg.norm(place[0] - np.array(scene.camera.matrix)[:3, 3])
    assert fine < 0.5 * coarse and coarse == pytest.approx(distance * (right - left) / 4, rel=0.25)


@pytest.mark.parametrize("half", [100.0, 1e3, 1e5])
def test_a_far_ground_changes_little(device: Device, half: float) -> None:
    """The radii are the lit room's, however far the ground goes on that it stands on."""
    room = cornell()
    ground = [
        [-half, -half, -0.02],
        [half, -half, -0.02],
        [half, half, -0.02],
        [-half, half, -0.02],
    ]
    first, count = len(room.vertices), 2
    scene = replace(
        room,
        vertices=np.concatenate([room.vertices, ground]),
        triangles=np.concatenate(
            [room.triangles, np.array([[0, 1, 2], [0, 2, 3]], np.int32) + first]
        ),
        corner_normals=np.concatenate(
            [room.corner_normals, np.tile(np.float32([0, 0, 1]), (count, 3, 1))]
        ),
        material=np.concatenate([room.material, np.zeros(count, np.int32)]),
        surface=np.concatenate([room.surface, np.full(count, len(room.surfaces), np.int32)]),
        surfaces=(*room.surfaces, "ground"),
    )
    places = np.array([[5, 5, 0], [2, 9.9, 5]], float)
    with_ground = radii(device, scene, places, (UP, BACK), photons=30000)
    alone = radii(device, room, places, (UP, BACK), photons=30000)
    np.testing.assert_allclose(with_ground, alone, rtol=1.5)  # cells are coarser
    settings: dict[str, Any] = {"width": 24, "height": 24, "photons": 30000, "passes": 4}
    a, b = (render(device, x, **settings)["Indirect"].mean() for x in (scene, room))
    assert a / b == pytest.approx(1.04, abs=0.12)  # the ground throws some light back


@pytest.mark.usefixtures("resident")
@pytest.mark.thorough("splat")
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_told_whichever_device_was_used_last(device: Device, estimator: Any) -> None:
    """The host asks for what a device knows long after it was made."""
    settings = Settings(width=24, height=16, photons=20000, backend="compute", estimator=estimator)
    renderer, other = prepare(cornell(), settings, device), Device()
    try:
        assert renderer.radius(0) > 0
        device.check()
        renderer.render_pass()
    finally:
        renderer.release()
        other.release()
        device.use()


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 200, 4097, 20000])
def test_the_device_finds_where_photons_are(device: Device, count: int, flat: bool) -> None:
    """The grids that the native core makes of a sample, to the bit."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    rng = np.random.default_rng(count)
    place = rng.normal(0.0, 0.3, (count, 4)).astype(np.float32)
    place[:, 1] = -0.0 if flat else place[:, 1]
    deposit = rng.random((count, 4), np.float32)
    deposit[:, 3] = rng.choice(PACKED[: 2 if flat else None], count)
    rows = np.zeros((2, -(-count // TABLE_WIDTH) * TABLE_WIDTH, 4), np.float32)
    rows[:, :count] = place, deposit
    deposits = DeviceDeposits(device)
    copy = Copy(count, tuple(device.ctx.buffer(part) for part in rows))
    deposits.paste(copy)
    grids, area = ResidentBackend(device).radius_grids(deposits)()
    expected, box = native.radius_grids(sample_of(place, deposit, SAMPLE))
    np.testing.assert_array_equal(grids, expected)
    assert area == box
    deposits.release()
    copy.release()


@pytest.mark.thorough("1-False-True", "20000-True-True")
@pytest.mark.parametrize("shares_lines", [False, True])
@pytest.mark.parametrize(
    ("photons", "flat"), [(0, False), (1, False), (20000, False), (20000, True)]
)
def test_the_device_finds_the_same(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    photons: int,
    flat: bool,
    shares_lines: bool,
    thorough: bool,
) -> None:
    """Where photons stay on a device, its programs make the native core's radii, to rounding; on a
    floor alone by grids as fine as there are."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    compared = []

    def both(device: Device, deposits: Any, grids: Any, limits: Any, shared: bool) -> Any:
        assert shared == (not device.is_software)
        made = radii_on_device(device, deposits, grids, limits, shares_lines)
        places = deposits.arrays()
        np.testing.assert_array_equal(grids, native.radius_grids(sample_of(*places, SAMPLE))[0])
        expected = native.RadiusField(*places, grids, **limits._asdict())
        used = grids.size + int((grids[:, 4:7] + 1).prod(axis=1).sum())
        table = expected.table().ravel()[:used]
        device.bind.settle()
        found = np.frombuffer(made.on_device.read(), np.float32)[:used]
        np.testing.assert_array_equal(found[: grids.size], table[: grids.size])
        # A GPU may count a photon at a cell's border in the next one.
        radii = table[grids.size :]
        share = np.mean(np.abs(found[grids.size :] - radii) > 1e-5 * radii)
        assert share <= (0.0 if device.is_software else 0.01)
        typical, largest = made.summary()  # the first by 2047 photons, native.RadiusField's by all
        assert typical == pytest.approx(expected.typical(), rel=2e-2)
        assert largest == pytest.approx(expected.largest(), rel=1e-5)
        np.testing.assert_array_equal(made.on_host.table().ravel()[:used], found)
        compared.append(deposits.count > 0)
        assert flat == (grids[:, 4:7].max() > 500.0)
        return made

    monkeypatch.setattr(device, "prefers_native", False)
    monkeypatch.setattr(backend_module, "radii_on_device", both)
    lights = cornell().lights
    if photons == 1:  # which nothing stops
        lights = (replace(lights[0], direction=(0.0, 0.0, 1.0), position=(5.0, 5.0, 30.0)),)
    perspective = cornell().camera
    views = [perspective, replace(perspective, kind="ORTHO")]
    if not thorough and (photons < 2 or flat or shares_lines):
        views.pop()
    for view in views:
        scene = replace(cornell(True), camera=view, lights=lights)
        if flat:
            floor = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
            scene = floor.scene(view, [replace(lights[0], position=(0.0, 0.0, 2.0))])
        settings = Settings(64, 64, photons=photons, backend="compute", direct_by_photons=flat)
        prepare(scene, settings, device).release()
    assert compared == ([] if photons == 0 else [photons > 1] * len(views))


def test_radii_that_no_photon_bounds(device: Device) -> None:
    """A radius far beyond any scene, and a scene far below any radius, end."""
    for scene, radius in ((cornell(), 1e18), (replace(cornell(), lights=()), 0.0)):
        tiny = replace(scene, vertices=scene.vertices * (1e-22 if not scene.lights else 1.0))
        images = render(device, tiny, width=8, height=8, photons=100, radius=radius)
        assert np.isfinite(images["Combined"]).all()


def test_custom_radius_is_even(device: Device) -> None:
    places = np.random.default_rng(0).uniform(0, 10, (50, 3))
    np.testing.assert_allclose(radii(device, cornell(), places, radius=0.7), 0.7, rtol=1e-5)


def test_photons_a_disc_grow_with_the_pass() -> None:
    assert photons_per_disc(16384) == pytest.approx(150)
    assert photons_per_disc(1) == 4 and photons_per_disc(1 << 24) == 400


@pytest.mark.parametrize(("estimator", "backend"), [("splat", "fragment"), ("gather", "native")])
def test_every_way_sums_within_the_same_radii(device: Device, estimator: str, backend: str) -> None:
    """Where the radius changes from point to point, all still sum the same pairs."""
    settings: dict[str, Any] = {"width": 64, "height": 64, "photons": 4000}
    one = render(device, cornell(), estimator="gather", backend="fragment", **settings)["Indirect"]
    other = render(device, cornell(), estimator=estimator, backend=backend, **settings)["Indirect"]
    assert one.mean() > 0
    differences = np.abs(other - one) / np.maximum(one, one.mean())
    if estimator == "splat":  # of the very same photons
        assert differences.max() < 1e-4
    else:
        # A native photon's path in thousands turns at an edge by rounding: a pixel in four or so
        # knows of one among its sixty photons, and radii, of one among the hundreds they go by.
        assert np.median(differences) < 1e-3 and np.quantile(differences, 0.7) < 5e-3


def test_passes_apart_have_the_same_radii(device: Device) -> None:
    """Radii depend on the settings, not on which pass is rendered."""
    whole, part = (
        prepare(cornell(), Settings(width=8, height=8, photons=3000, first_pass=first), device)
        for first in (0, 7)
    )
    assert whole.radius(7) == part.radius(7) < whole.radius(0)
    for renderer in (whole, part):
        renderer.release()


def test_grids_end_with_a_box() -> None:
    """Of the boxes that a device finds, those of a side without photons there."""
    low, high = np.float32([[-2, -3, -4], [-1, -1, -1]]), np.float32([[5, 6, 7], [-0.5, 1, 1]])
    boxes = np.repeat([[low[0], high[0]], [low[1], high[1]]], (4, 3), axis=0)
    faces = np.concatenate([~_ordered(boxes[:, 0]), _ordered(boxes[:, 1])], axis=1)
    focus = np.float32([[-0.75, -0.5, -0.25], [1.0, 2.0, 3.0]])
    grids, _ = native.radius_grids_about(_within(faces, focus))
    found = grids.view(RADIUS_GRID.dtype)
    for side, (least, most) in enumerate(boxes[1:]):
        np.testing.assert_array_equal(found["low"][side, 0], np.maximum(least, focus[0]))
        np.testing.assert_array_equal(found["high"][side, 0], np.minimum(most, focus[1]))
    sample = np.zeros((3, 4), np.float32)
    sample[:, :3] = [[0, 0, 0], [0.5, 0.5, 0.5], [9, 9, 9]]
    one, _ = grids_on_host(sample, sample, focus)()
    other, _ = grids_on_host(sample[:2], sample[:2])()
    np.testing.assert_array_equal(one, other)
