# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame whose triangles have only moved takes the tree of the one before: to the bit what a fresh
renderer gives, which builds another."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import photon_stream_native as native
import pytest

from addon.photon.backends.backend import backend_of
from addon.photon.kernels.coverage import Coverage
from addon.photon.photons.kept import Kept
from addon.photon.scene import Moving, Scene
from addon.photon.stage.geometry import MOST_WEAR, Mesh, Tree, _areas, frame_of
from addon.streams import Device
from tests.physics.test_portals import room
from tests.scenes import Builder, camera, cornell, corners_of, plain_light, plain_material
from tests.unit.kept_frames import SETTINGS, WAYS, Frame, render

WALLS = slice(0, 20)  # vertices of the room


@pytest.fixture
def kept(device: Device) -> Iterator[Kept]:
    made = Kept(device)
    yield made
    made.release()


# Which tree is taken is nothing to how deposits are summed.
pytestmark = pytest.mark.thorough("compute splat")


@pytest.fixture(params=WAYS, ids=["native", "fragment", "compute gather", "compute splat"])
def picture(
    request: pytest.FixtureRequest, device: Device, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Frame]:
    """Renders a scene on one backend."""
    backend, estimator, on_host = request.param
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    settings = replace(SETTINGS, backend=backend, estimator=estimator, width=32, height=24)

    def made(scene: Scene, kept: Kept | None = None) -> Frame:
        return render(device, scene, settings, kept)

    return made


def tree_of(kept: Kept) -> Tree:
    assert kept._scene
    return kept._scene.mesh.tree


def bent(scene: Scene, by: float) -> Scene:
    """All but the walls bends, corner normals too."""
    x, y, z = scene.vertices.T
    moved = np.stack([x + by * np.sin(z), y + by * np.cos(1.3 * z + x), z * (1 + 0.2 * by)], 1)
    moved[WALLS] = scene.vertices[WALLS]
    normals = scene.corner_normals + np.float32([0.2 * by, 0.0, -0.1 * by])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return replace(scene, vertices=moved, corner_normals=normals)


def shuffled(scene: Scene) -> Scene:
    """The vertices change places."""
    order = np.random.default_rng(1).permutation(len(scene.vertices))
    return replace(scene, vertices=scene.vertices[order])


def twins(by: float) -> Scene:
    """A ground of squares, each two or three times there in different colours, that bends; and all
    of it glossy, so that mirrors and photons meet it, too."""
    at = np.linspace(-1, 1, 7)
    b = Builder()
    for i, (x, to_x) in enumerate(pairwise(at)):
        for j, (y, to_y) in enumerate(pairwise(at)):
            corners = [(x, y), (to_x, y), (to_x, to_y), (x, to_y)]
            raised = [(u, v, by * (u * u + v)) for u, v in corners]
            for twin in range(2 + (i + j) % 2):
                b.quad(*raised, (i + 2 * j + twin) % 3)
    colours = np.eye(3) * 0.5 + 0.1
    materials = [plain_material(f"m{i}", tuple(c), tuple(0.3 * c)) for i, c in enumerate(colours)]
    wall = [(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)]
    light = plain_light("spot", "SPOT", (0.2, -0.3, 2.0), (100.0,) * 3, spot_size=1.5)
    return b.quad(*wall).scene(camera((0, -2.5, 1.5), (0, 0, 0)), [light], materials)


@pytest.mark.thorough("compute gather")
def test_deforming_scene(kept: Kept, picture: Callable[..., Frame]) -> None:
    """Frame after frame, with one tree, which is not what would be built."""
    scene = cornell(mirror=True)
    picture(scene, kept)
    first, others, pictures = tree_of(kept), 0, set()
    for by in (0.1, 0.3, -0.2, 0.0):
        moved = bent(scene, by)
        frame, fresh = picture(moved, kept), picture(moved)
        assert tree_of(kept).order is first.order
        others += not np.array_equal(Mesh.build(moved, frame_of(moved)).tree.order, first.order)
        assert frame.images == fresh.images and frame.info == fresh.info, by
        pictures.add(frame.images["Combined"])
    assert others == 3 and len(pictures) == 4
    assert np.array_equal(tree_of(kept).nodes, first.nodes)


@pytest.mark.thorough("compute gather")
def test_twins_of_other_colours(kept: Kept, picture: Callable[..., Frame]) -> None:
    """Of triangles in one place the first in the scene is seen, whatever the tree's order."""
    picture(twins(0.3), kept)
    first = tree_of(kept)
    for by in (-0.3, 0.1, 0.2):
        scene = twins(by)
        frame, fresh = picture(scene, kept), picture(scene)
        assert tree_of(kept).order is first.order
        assert frame.images == fresh.images and frame.info == fresh.info, by
    assert not np.array_equal(Mesh.build(scene, frame_of(scene)).tree.order, first.order)


@pytest.mark.thorough("compute gather", "fragment")
def test_windows(kept: Kept, picture: Callable[..., Frame]) -> None:
    """Are fitted along what stands about them, whatever the tree's order."""
    picture(room(side=True, ball=-1.0), kept)
    first = tree_of(kept)
    for ball in (0.2, 1.0):
        scene = room(side=True, ball=ball)
        frame, fresh = picture(scene, kept), picture(scene)
        assert tree_of(kept).order is first.order
        assert frame.images == fresh.images and frame.info == fresh.info, ball
    assert not np.array_equal(Mesh.build(scene, frame_of(scene)).tree.order, first.order)


@pytest.mark.thorough("compute gather", "fragment-shuffled")
@pytest.mark.parametrize("broken", ["not finite", "degenerate", "shuffled", "other triangles"])
def test_another_tree_is_built(kept: Kept, picture: Callable[..., Frame], broken: str) -> None:
    """Where triangles are to be skipped that were not, and back; and for shapes too different."""
    scene = cornell(mirror=True)
    if broken == "shuffled":
        other = shuffled(scene)
    elif broken == "other triangles":
        other = replace(scene, triangles=scene.triangles[:, ::-1].copy())
    else:
        vertices = scene.vertices.copy()
        last = scene.triangles[-1]
        vertices[last[0]] = np.nan if broken == "not finite" else vertices[last[1]]
        other = replace(scene, vertices=vertices)
    # To be shuffled does a tree no harm: all others are as bad. Not so the way back.
    frames = (other, scene) if broken == "shuffled" else (scene, other, scene)
    picture(frames[0], kept)
    for changed in frames[1:]:
        before = tree_of(kept)
        frame, fresh = picture(changed, kept), picture(changed)
        built = tree_of(kept)
        assert built.order is not before.order
        assert np.array_equal(built.nodes, Mesh.build(changed, frame_of(changed)).tree.nodes)
        assert frame.images == fresh.images and frame.info == fresh.info
    # What is skipped may stay so.
    if broken in ("not finite", "degenerate"):
        picture(other, kept)
        before, moved = tree_of(kept), bent(other, 0.1)
        assert before.not_finite + before.degenerate > 0
        frame, fresh = picture(moved, kept), picture(moved)
        assert tree_of(kept).order is before.order
        assert (tree_of(kept).not_finite, tree_of(kept).degenerate) == (
            before.not_finite,
            before.degenerate,
        )
        assert frame.images == fresh.images and frame.info == fresh.info


def seat(parted: float = 0.0) -> Scene:
    """A board and a leg that ends in it, of one surface; a side of the board has moved away."""
    light = plain_light("lamp", "SPOT", (0.5, -1.0, 3.0), (300.0,) * 3, (-0.1, 0.3, -1.0))
    built = Builder().box((-1, -1, 0), (1, 1, 0.1)).box((-0.4, -0.4, -0.5), (0.4, 0.4, 0.05))
    built.quad((-2, -2, -0.5), (2, -2, -0.5), (2, 2, -0.5), (-2, 2, -0.5))
    scene = built.scene(camera((0, -2.5, 2.0), (0, 0, 0)), [light])
    vertices = scene.vertices.copy()
    vertices[:4, 0] -= parted
    return replace(scene, vertices=vertices, surface=np.maximum(scene.surface - 1, 0))


def test_a_seam_parts(kept: Kept, picture: Callable[..., Frame]) -> None:
    """What was closed is so no more, with the same tree: what is in it then counts."""
    picture(seat(), kept)
    first = tree_of(kept)
    frame, fresh = picture(seat(0.05), kept), picture(seat(0.05))
    assert tree_of(kept).order is first.order
    assert frame.images == fresh.images and frame.info == fresh.info


def solid(mesh: Mesh) -> Any:
    """1 where a triangle's front is outside of a solid, -1 where its back is, else 0."""
    return mesh.faces[:, 3] % 4 - 1


def test_quads_are_of_the_mesh_as_it_is() -> None:
    """One of which a corner has moved out of its plane is none."""
    scene = seat()
    vertices = scene.vertices.copy()
    vertices[-4] += (0.0, 0.0, 0.1)  # of the floor
    bent = replace(scene, vertices=vertices)
    mesh = Mesh.build(scene, frame_of(scene))
    fitted = Mesh.build(bent, frame_of(bent), mesh.tree)
    assert fitted.tree.order is mesh.tree.order
    assert (mesh.faces[:, 3] >= 4).all()
    assert ((fitted.faces[:, 3] < 4) == (mesh.tree.order >= 24)).all()


def test_a_thread_finds_faces_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = seat()
    mesh, ahead = (Mesh.build(scene, frame_of(scene)) for _ in range(2))
    threads, find = [], native.faces_of

    def faces_of(*given: Any) -> Any:
        threads.append(threading.current_thread())
        if len(threads) == 1:
            raise MemoryError
        return find(*given)

    monkeypatch.setattr(native, "faces_of", faces_of)
    ahead.find_faces()
    with pytest.raises(MemoryError):
        _ = ahead.faces
    ahead.find_faces()  # a later render of the same mesh
    ahead.find_faces()
    found = ahead.faces
    ahead.find_faces()
    assert len(threads) == 2 and threading.main_thread() not in threads
    np.testing.assert_array_equal(found, mesh.faces)


def test_solids_are_of_the_mesh_as_it_is() -> None:
    scene, parted = seat(), seat(0.05)
    mesh = Mesh.build(scene, frame_of(scene))
    fitted = Mesh.build(parted, frame_of(parted), mesh.tree)
    assert fitted.tree.order is mesh.tree.order
    board = mesh.tree.order < 12
    leg = (mesh.tree.order >= 12) & (mesh.tree.order < 24)
    assert (solid(mesh) == board | leg).all() and (solid(fitted) == leg).all()


def test_a_seam_parts_while_the_shutter_is_open(kept: Kept, device: Device) -> None:
    offsets = np.zeros((2, 4, 3), np.float32)
    offsets[1, :, 0] = -0.05
    normals = np.zeros((2, 0, 3), np.float32)  # flat
    scene = replace(seat(), moving=(Moving((0, 4), offsets=offsets, normals=normals),))
    now = kept.device_scene(scene, backend_of(replace(SETTINGS, backend="fragment"), device))
    for time, count in ((0.0, 24), (1.0, 12), (0.0, 24)):
        now = now.at(time)
        table = np.frombuffer(now.tables.of(Coverage)["faces"].read(), np.float32)
        faces = table.reshape(-1, 4)[: len(now.mesh.faces)]
        assert solid(now.mesh).sum() == count and (faces == now.mesh.faces).all()


def test_faces_are_not_looked_for_where_nothing_gathers(
    kept: Kept, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    found = native.faces_of
    monkeypatch.setattr(native, "faces_of", lambda *x: asked.append(x) or found(*x))
    for photons, times in ((0, 0), (500, 1), (500, 1)):
        render(device, seat(), replace(SETTINGS, photons=photons), kept)
        assert len(asked) == times


def test_wear_adds_up() -> None:
    """Many small steps for the worse are one large one."""
    scene = bent(cornell(), 0.0)

    def scattered(share: float) -> Any:
        vertices = scene.vertices + share * (shuffled(scene).vertices - scene.vertices)
        return vertices.astype(np.float32), scene.triangles

    tree = Tree.build(*scattered(1.0))
    for share in np.linspace(0.99, 0.0, 100):
        before, tree = tree, Tree.build(*scattered(share), tree)
        if tree.order is not before.order:
            break
        assert tree.cost == before.cost
    refitted = native.refit_bvh(before.nodes, before.order, *scattered(share))
    assert refitted and refitted[3] > MOST_WEAR * before.cost
    nodes, *_, cost = native.build_bvh(*scattered(share))
    assert share < 0.98 and tree.cost == cost and np.array_equal(tree.nodes, nodes)


def test_area_is_summed_in_the_scenes_order() -> None:
    rng = np.random.default_rng(2)
    b = Builder().add(rng.random((9000, 3)), np.arange(9000).reshape(-1, 3))
    scene = b.scene(camera((0, -2, 1), (0, 0, 0)))
    elsewhere = replace(scene, vertices=rng.random((9000, 3)))
    old = replace(Mesh.build(elsewhere, frame_of(elsewhere)).tree, cost=np.inf)
    built, fitted = (Mesh.build(scene, frame_of(scene), tree) for tree in (None, old))
    assert fitted.tree.order is old.order
    sums = [_areas(corners_of(mesh)).sum() for mesh in (built, fitted)]
    assert built.area == fitted.area == pytest.approx(sums[0])
    assert sums[0] != sums[1]  # else this would tell nothing


def test_no_triangles(device: Device, kept: Kept) -> None:
    scene = Builder().scene(camera((0, -2, 1), (0, 0, 0)))
    for _ in range(2):
        assert render(device, scene, kept=kept).images == render(device, scene).images
        scene = replace(scene, lights=cornell().lights)
