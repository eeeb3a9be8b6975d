# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents: what scenes hold of them, and how anisotropic lobes turn with them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.errors import SceneError
from addon.photon.kernels.shade import Shade
from addon.photon.photons.kept import same_but_view
from addon.photon.prepare import prepare
from addon.photon.scene import Camera, Lobe, Material, Scene, point_light
from addon.photon.scene.snapshot import pack, same, unpack
from addon.photon.settings import Settings
from addon.photon.stage.find_needs import find_needs
from addon.photon.stage.geometry import Mesh, frame_of
from addon.photon.stage.light_tree import AskedLights
from addon.photon.stage.needs import SceneNeeds
from addon.streams import Device
from tests.scenes import UNIT_INTENSITY, cornell

SIZE, PASSES, SUPERSAMPLED = 32, 96, 8
HALF, HEIGHT = 0.5, 4.0  # [m] of what is seen of a plane, and above it the camera
LIGHT = (0.6, -0.4, 2.0)
ALPHAS = 0.25, 0.09
BACKENDS = ("native", "fragment", "compute")


def lobe(kind: str = "ggx", turn: float = 0.0, alphas: tuple[float, float] = ALPHAS) -> Lobe:
    """White metal, whose tangent is turned [rad]; nothing is given back for its own shadows."""
    x, y = alphas
    more: dict[str, Any] = {"ggx": {}, "ggx_metal": {"tint": (1.0,) * 3}}[kind]
    given = {"alpha_x": x, "alpha_y": y, "turn": turn, "compensated": 0.0, **more}
    return Lobe(kind, (1.0, 1.0, 1.0), given)


def plane(of: Lobe, tangents: Any = None, tilt: float = 0.0, side: float = 1.0) -> Scene:
    """Two triangles, tilted about x by `tilt` [rad], that an orthographic camera sees nothing
    beside of, and a light. `tangents`: of the four corners (4, 3), or none. `side` -1: from behind.
    """
    c, s = math.cos(tilt), math.sin(tilt)
    corners = np.array([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], np.float64)
    vertices = corners @ np.array([(1, 0, 0), (0, c, s), (0, -s, c)])
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)[:, :: int(side)]
    normals = np.tile(np.float32([0, -s, c]) * np.float32(side), (2, 3, 1))
    none = np.zeros((0, 3, 3), np.float32)
    matrix = np.eye(4)
    matrix[2, 3] = HEIGHT
    return Scene(
        Camera("ORTHO", matrix, (-HALF, HALF, -HALF, HALF)),
        (point_light("light", LIGHT, (UNIT_INTENSITY,) * 3),),
        (Material("metal", (0.0, 0.0, 0.0), (of,)),),
        vertices,
        np.ascontiguousarray(triangles),
        normals,
        none if tangents is None else np.float32(tangents)[triangles],
        np.zeros(2, np.int32),
        np.zeros(2, np.int32),
        ("plane",),
    )


def picture(device: Device, scene: Scene, backend: Any = "fragment", passes: int = PASSES) -> Any:
    """The first channel of a scene's image (h, w)."""
    settings = Settings(
        width=SIZE, height=SIZE, passes=passes, photons=0, mirror_depth=0, backend=backend
    )
    renderer = prepare(scene, settings, device)
    try:
        for _ in range(passes):
            renderer.render_pass()
        return renderer.images()["Combined"][..., 0]
    finally:
        renderer.release()


def expected(
    scene: Scene, tangent_at: Callable[[NDArray[Any]], Any], side: float = 1.0
) -> NDArray[np.float64]:
    """The radiance of each pixel by Smith's GGX (Walter et al. 2007; Heitz 2014), summed over a
    grid. `tangent_at` gives the tangents of points (n, 3) of the plane before it was tilted."""
    (material,) = scene.materials
    given = material.lobes[0].parameters
    count = SIZE * SUPERSAMPLED
    at = ((np.arange(count) + 0.5) / count * 2.0 - 1.0) * HALF
    normal = scene.corner_normals[0, 0].astype(float)
    x, y = (a.ravel() for a in np.meshgrid(at, at))
    points = np.stack((x, y, -(normal[1] * y) / normal[2]), 1)
    tangent = np.asarray(tangent_at(points), float)
    tangent = tangent - (tangent @ normal)[:, None] * normal
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    turn = given["turn"]
    assert isinstance(turn, float)
    tangent = math.cos(turn) * tangent + math.sin(turn) * np.cross(normal, tangent)
    frame = np.stack((tangent, np.cross(normal, tangent), np.broadcast_to(normal, tangent.shape)))
    away = np.array(LIGHT) - points
    distance = np.linalg.norm(away, axis=1)[:, None]
    to_light = np.einsum("kni,ni->nk", frame, away / distance)
    to_viewer = frame[:, :, 2].T
    alpha = np.array([given["alpha_x"], given["alpha_y"], 1.0], float)
    h = to_light + to_viewer
    h /= np.linalg.norm(h, axis=1)[:, None]
    d = 1.0 / (np.pi * alpha[0] * alpha[1] * ((h / alpha) ** 2).sum(1) ** 2)
    stretched_v, stretched_l = (np.linalg.norm(v * alpha, axis=1) for v in (to_viewer, to_light))
    f = d / (2.0 * (to_light[:, 2] * stretched_v + to_viewer[:, 2] * stretched_l))
    radiance = f * to_light[:, 2] / distance[:, 0] ** 2
    blocks = radiance.reshape(SIZE, SUPERSAMPLED, SIZE, SUPERSAMPLED)
    return blocks.mean(axis=(1, 3)) * side**2


def rms(one: NDArray[Any], other: NDArray[Any]) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2) / np.mean(other**2)))


ALONG_X = np.tile((1.0, 0.0, 0.0), (4, 1))
AROUND = np.array([(2, -2, 0), (2, 2, 0), (-2, 2, 0), (-2, -2, 0)], float)  # about the middle


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("rotation", [0.0, 0.25, 0.125])
@pytest.mark.parametrize("kind", ["ggx", "ggx_metal"])
def test_rotation(device: Device, backend: str, rotation: float, kind: str) -> None:
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    scene = plane(lobe(kind, 2.0 * math.pi * rotation), ALONG_X)
    found = picture(device, scene, backend)
    reference = expected(scene, lambda points: np.tile((1.0, 0.0, 0.0), (len(points), 1)))
    assert rms(found, reference) < 0.005
    other = replace(scene, materials=(Material("metal", (0, 0, 0), (lobe(kind, 0.9),)),))
    assert rms(found, expected(other, lambda p: np.tile((1.0, 0.0, 0.0), (len(p), 1)))) > 0.05


@pytest.mark.parametrize("alphas", [ALPHAS, ALPHAS[::-1]], ids=["rougher", "smoother"])
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["front", "back"])
def test_interpolated_and_projected(
    device: Device, alphas: tuple[float, float], side: float
) -> None:
    """Tangents that differ at the corners, on a tilted plane, whose sum is not in the plane."""
    scene = plane(lobe(turn=0.4, alphas=alphas), AROUND + np.array((0.3, 0.2, 0.7)), 0.35, side)
    if side < 0.0:  # behind it, what is seen is turned towards the eye
        seen = replace(scene, corner_normals=-scene.corner_normals)
    else:
        seen = scene

    def tangent_at(points: NDArray[Any]) -> NDArray[Any]:
        y = points[:, 1] / math.cos(0.35)
        return np.stack((-y + 0.3, points[:, 0] + 0.2, np.full(len(y), 0.7)), 1)

    assert rms(picture(device, scene), expected(seen, tangent_at)) < 0.005


def test_of_any_length_and_sign(device: Device) -> None:
    """Bits are the same, but for the last: half a turn is none."""
    scene = plane(lobe(turn=0.4), ALONG_X)
    reference = picture(device, scene, passes=4)
    for factor in (8.0, 2.0**-30):
        changed = replace(scene, corner_tangents=scene.corner_tangents * np.float32(factor))
        np.testing.assert_array_equal(picture(device, changed, passes=4), reference)
    turned = replace(scene, corner_tangents=-scene.corner_tangents)
    np.testing.assert_allclose(picture(device, turned, passes=4), reference, rtol=1e-5)


@pytest.mark.parametrize("bad", [0.0, math.nan, math.inf])
def test_no_tangent(device: Device, bad: float) -> None:
    """As if there were none in the scene: along whatever line."""
    scene = plane(lobe(turn=0.4), np.full((4, 3), bad))
    without = replace(scene, corner_tangents=plane(lobe()).corner_tangents)
    found = picture(device, scene, passes=4)
    assert found.min() > 0.0
    np.testing.assert_array_equal(found, picture(device, without, passes=4))


def needs_of(scene: Scene) -> SceneNeeds:
    mesh = Mesh.build(scene, frame_of(scene))
    asked = AskedLights(np.arange(len(scene.emitters)))
    return find_needs(scene, Settings(), mesh, scene.emitters, asked)


def test_only_where_a_lobe_is_anisotropic(device: Device) -> None:
    """Round lobes read no table, and their picture is the same to the bit."""
    needed = needs_of(plane(lobe(), ALONG_X))
    assert "corner_tangents" in Shade.declaration(needed.eye_defines).tables
    assert "corner_tangents" in Shade.declaration(needed.photon_defines).tables
    round_one = plane(lobe(alphas=(0.1, 0.1)), ALONG_X)
    without = replace(round_one, corner_tangents=plane(lobe()).corner_tangents)
    for scene in (plane(lobe()), round_one, without, cornell(True)):
        needs = needs_of(scene)
        assert not needs.tangents and not len(Mesh.build(scene, frame_of(scene)).tangents)
        assert "TANGENTS" not in {**needs.eye_defines, **needs.photon_defines}
    np.testing.assert_array_equal(
        picture(device, round_one, passes=4), picture(device, without, passes=4)
    )


def test_round_lobes_beside_anisotropic_ones_do_not_turn(device: Device) -> None:
    """Their picture is the same to the bit as without tangents."""
    beside = plane(lobe(alphas=(0.1, 0.1)), ALONG_X)
    materials = (*beside.materials, Material("other", (0.0, 0.0, 0.0), (lobe(),)))
    far = beside.vertices[:3] - np.array((0.0, 0.0, 50.0))
    both = replace(
        beside,
        materials=materials,
        vertices=np.concatenate((beside.vertices, far)),
        triangles=np.concatenate((beside.triangles, np.int32([[4, 5, 6]]))),
        corner_normals=np.concatenate((beside.corner_normals, beside.corner_normals[:1])),
        corner_tangents=np.concatenate((beside.corner_tangents, beside.corner_tangents[:1])),
        material=np.int32([0, 0, 1]),
        surface=np.zeros(3, np.int32),
    )
    assert needs_of(both).tangents
    none = replace(both, corner_tangents=np.zeros((0, 3, 3), np.float32))
    np.testing.assert_array_equal(picture(device, both, passes=4), picture(device, none, passes=4))


# Scenes.


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros((1, 3, 3), np.float32),
        np.zeros((2, 3), np.float32),
        np.zeros((2, 3, 3), np.float64),
        np.zeros((0, 3), np.float32),
    ],
    ids=lambda array: f"{array.dtype}{array.shape}",
)
def test_wrong_arrays_are_refused(wrong: NDArray[Any]) -> None:
    scene = plane(lobe(), ALONG_X)
    scene.check()
    plane(lobe()).check()
    with pytest.raises(SceneError, match=r"scene\.corner_tangents: expected float32\["):
        replace(scene, corner_tangents=wrong).check()


@pytest.mark.parametrize("tangents", [ALONG_X, None], ids=["some", "none"])
def test_files(tmp_path: Path, tangents: Any) -> None:
    scene = plane(lobe(), tangents)
    scene.save(tmp_path / "scene.npz")
    assert same(Scene.load(tmp_path / "scene.npz"), scene)
    assert same(unpack(pack(scene)), scene)


def test_files_from_before_tangents(tmp_path: Path) -> None:
    scene = plane(lobe(), ALONG_X)
    scene.save(tmp_path / "scene.npz")
    with np.load(tmp_path / "scene.npz") as data:
        arrays = {name: data[name] for name in data if name != "corner_tangents"}
    np.savez(tmp_path / "old.npz", **arrays)
    assert same(Scene.load(tmp_path / "old.npz"), plane(lobe()))


def test_other_tangents_are_another_scene() -> None:
    scene = plane(lobe(), ALONG_X)
    assert same_but_view(scene, plane(lobe(), ALONG_X.copy()))
    assert not same_but_view(scene, plane(lobe(), AROUND))
    assert not same_but_view(scene, plane(lobe()))
