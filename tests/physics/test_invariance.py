# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cases 10 and 11: what must not change the picture, or must change it exactly."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Camera, Scene
from addon.streams import Device
from tests.flip import mean_flip
from tests.measure import SEEDS, T_95, render
from tests.scenes import cornell, orthographic
from tests.stability.table import Measured

PARTS = ("Direct", "Indirect", "Mirror")


def moved(scene: Scene, rotation: Any, offset: Any, scale: float = 1.0) -> Scene:
    """The scene rotated, then scaled with powers by scale^2, then shifted."""

    def points(x: Any) -> Any:
        return np.asarray(x) @ rotation.T * scale + offset

    matrix = np.array(scene.camera.matrix)
    matrix[:3, :3] = rotation @ matrix[:3, :3]
    matrix[:3, 3] = points(scene.camera.matrix[:3, 3])
    camera = Camera(scene.camera.kind, matrix, scene.camera.window)
    lights = tuple(
        replace(
            light,
            position=tuple(points(light.position)),
            direction=tuple(rotation @ light.direction),
            power=tuple(np.multiply(light.power, scale**2)),
            parameters=dict(light.parameters) | {"radius": light.parameters["radius"] * scale},
        )
        for light in scene.lights
    )
    normals = (scene.corner_normals @ rotation.T).astype(np.float32)
    return replace(
        scene, camera=camera, lights=lights, vertices=points(scene.vertices), corner_normals=normals
    )


def assert_same_picture(a: dict[str, Any], b: dict[str, Any], tolerance: float) -> None:
    """Means over 8x8 blocks agree: single pixels on an edge may fall on its other side."""
    for part in PARTS:
        x, y = (im[part].reshape(-1, 8, im[part].shape[1] // 8, 8, 3).mean((1, 3)) for im in (a, b))
        assert np.abs(x - y).max() <= tolerance * max(x.max(), 1e-6), part


def turn(angle: float, axis: int = 2) -> Any:
    c, s = np.cos(angle), np.sin(angle)
    i, j = [k for k in range(3) if k != axis]
    rotation = np.eye(3)
    rotation[i, i], rotation[i, j], rotation[j, i], rotation[j, j] = c, -s, s, c
    return rotation


@pytest.mark.parametrize("backends", [("fragment", "compute")])
@pytest.mark.parametrize("estimator", ["splat", "gather"])
def test_case_10_backends_are_bit_equal(device: Device, backends: Any, estimator: str) -> None:
    """Both backends run one kernel source and draw the same random numbers."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    a, b = (
        render(
            device,
            cornell(True, lobe=True),
            backend=backend,
            estimator=estimator,
            width=48,
            height=48,
            photons=5000,
        )
        for backend in backends
    )
    if device.is_software:
        assert all(np.array_equal(a[name], b[name]) for name in a)
    else:
        assert_same_picture(a, b, 1e-4)


@pytest.mark.thorough(
    "constant-point",
    "constant-triangle",
    "cone-triangle",
    "cone-quad",
    "gaussian-point",
    "gaussian-quad",
)  # each filter, and each shape
@pytest.mark.parametrize("shape", ["triangle", "quad", "point"])
@pytest.mark.parametrize("kernel", ["constant", "cone", "gaussian", "epanechnikov"])
def test_case_10_splat_equals_gather(device: Device, shape: str, kernel: str) -> None:
    """Two ways to add up the same pairs: equal but for the order of additions."""
    settings: dict[str, Any] = {"filter": kernel, "width": 64, "height": 64, "radius": 0.6}
    scene = cornell()
    splat = render(device, scene, estimator="splat", splat_shape=shape, **settings)["Indirect"]
    gather = render(device, scene, estimator="gather", **settings)["Indirect"]
    assert gather.mean() > 0
    # A photon within rounding of the radius may count in one and not in the other: K(r) matters
    # only for the constant and Gaussian filters.
    differ = np.abs(splat - gather) > 1e-4 * gather.max()
    assert differ.mean() <= (1e-3 if kernel in ("constant", "gaussian") else 0.0)
    assert abs(splat.mean() / gather.mean() - 1) < 1e-4


@pytest.mark.stability(42)
def test_case_10_splats_near_and_behind_the_camera(device: Device, measured: Measured) -> None:
    """Discs that reach through the camera's plane, or fill the screen, are clipped right."""
    scene = cornell()
    inside = np.array(scene.camera.matrix)
    inside[:3, 3] = (5, 3, 0.4)  # close above the floor, discs all around
    scene = replace(scene, camera=replace(scene.camera, matrix=inside))
    settings: dict[str, Any] = {"radius": 1.5, "width": 64, "height": 48, "photons": 3000}
    for shape in ("triangle", "quad", "point"):
        splat = render(device, scene, estimator="splat", splat_shape=shape, **settings)["Indirect"]
        gather = render(device, scene, estimator="gather", **settings)["Indirect"]
        error = np.abs(splat - gather).max() / gather.max()
        assert measured("differs from gather by", error) <= 1e-4, shape


@pytest.mark.parametrize("flat", [False, True], ids=["perspective", "orthographic"])
@pytest.mark.parametrize(
    "film", [{}, {"pixel_filter": "blackman_harris", "pixel_width": 6.0}], ids=["box", "wide"]
)
def test_case_10_splats_reach_beside_pixels(
    device: Device, film: dict[str, Any], flat: bool
) -> None:
    """Discs narrower than a pixel, visible points some pixels beside theirs, of a part of a frame
    whose pixels are no squares."""
    scene = cornell()
    if flat:
        middle = scene.camera.matrix[:3, 3] + np.array((0.0, 1.0, 0.0))
        view = orthographic(middle, (1, 0, 0), (0, 0, 1), 8.0)
        scene = replace(scene, camera=view)
    settings: dict[str, Any] = {"width": 48, "height": 16, "region": (7, 3, 40, 15), **film}
    settings |= {"radius": 0.05, "photons": 30000, "first_pass": 1, "passes": 2}
    gather = render(device, scene, estimator="gather", **settings)["Indirect"]
    assert (gather > 0).mean() > 0.1
    for shape in ("quad", "point"):
        splat = render(device, scene, estimator="splat", splat_shape=shape, **settings)["Indirect"]
        assert np.abs(splat - gather).max() <= 1e-4 * gather.max(), shape


def test_case_10_one_pass_of_2n_is_two_of_n(device: Device) -> None:
    """More photons in a pass or more passes: the same expected value."""
    settings: dict[str, Any] = {"radius": 0.5, "width": 16, "height": 16}
    difference = np.array(
        [
            render(device, cornell(), photons=200000, passes=1, seed=s, **settings)[
                "Indirect"
            ].mean()
            / render(device, cornell(), photons=100000, passes=2, seed=s + 99, **settings)[
                "Indirect"
            ].mean()
            - 1
            for s in range(SEEDS)
        ]
    )
    assert abs(difference.mean()) + T_95 * difference.std(ddof=1) / SEEDS**0.5 <= 0.02


@pytest.mark.parametrize(
    ("angle", "axis", "offset", "scale"),
    [
        pytest.param(0.0, 2, (7.0, -3.0, 2.0), 1.0, marks=pytest.mark.stability(12)),
        pytest.param(0.0, 2, (1e3, 1e3, -1e3), 1.0, marks=pytest.mark.stability(12)),
        pytest.param(0.0, 2, (1e6, -1e6, 1e6), 1.0, marks=pytest.mark.stability(12)),
        pytest.param(np.pi / 2, 2, (0.0, 0.0, 0.0), 1.0, marks=pytest.mark.stability(11)),
        *(
            pytest.param(0.0, 2, (0.0, 0.0, 0.0), scale, marks=pytest.mark.stability(11))
            for scale in (1e-4, 1e-2, 1e2, 1e6)
        ),
    ],
)
def test_case_11_move_rotate_scale(
    device: Device, measured: Measured, angle: float, axis: int, offset: Any, scale: float
) -> None:
    """Scene units make place and scale vanish; a quarter turn only permutes the axes."""
    scene = cornell(True)
    turned = angle != 0.0  # other random directions: compare means of the whole
    settings = {"width": 64, "height": 64, "photons": 400000 if turned else 20000}
    a = render(device, scene, **settings)
    b = render(device, moved(scene, turn(angle, axis), np.array(offset), scale), **settings)
    if turned:
        for part in PARTS:
            difference = abs(b[part].mean() / a[part].mean() - 1)
            assert measured("a quarter turn changes means by", difference, "%") <= 0.03, part
    else:
        seen = mean_flip(a["Combined"][..., :3], b["Combined"][..., :3])
        assert measured("mean FLIP", seen) <= 0.01
        assert_same_picture(a, b, 0.02 if max(map(abs, offset)) > 1e5 else 1e-3)


def test_case_11_double_power(device: Device) -> None:
    """Light is linear, and a power of two is exact."""
    scene = cornell(True)
    light = replace(scene.lights[0], power=tuple(np.multiply(scene.lights[0].power, 2)))
    a, b = render(device, scene), render(device, replace(scene, lights=(light,)))
    for part in PARTS:
        assert np.array_equal(2 * a[part], b[part])


def test_case_11_permuted_triangles(device: Device) -> None:
    """The order of triangles is nobody's business."""
    scene = cornell(True)
    order = np.random.default_rng(1).permutation(len(scene.triangles))
    names = ("triangles", "corner_normals", "material", "surface")
    shuffled = replace(scene, **{name: getattr(scene, name)[order] for name in names})
    a, b = render(device, scene, width=64, height=64), render(device, shuffled, width=64, height=64)
    assert_same_picture(a, b, 1e-3)


def test_case_11_subdivided_triangles(device: Device) -> None:
    """Flat triangles cut in four are the same surface."""
    scene = cornell()
    v, t = scene.vertices, scene.triangles
    a, b, c = (v[t[:, i]] for i in range(3))
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = np.stack([(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)])
    corners = corners.transpose(2, 0, 1, 3).reshape(-1, 3)
    n = scene.corner_normals
    na, nb, nc = n[:, 0], n[:, 1], n[:, 2]
    nab, nbc, nca = na + nb, nb + nc, nc + na
    normals = np.stack([(na, nab, nca), (nab, nb, nbc), (nca, nbc, nc), (nab, nbc, nca)])
    normals = normals.transpose(2, 0, 1, 3).reshape(-1, 3, 3)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    cut = replace(
        scene,
        vertices=corners,
        triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        corner_normals=normals.astype(np.float32),
        material=np.repeat(scene.material, 4),
        surface=np.repeat(scene.surface, 4),
    )
    x, y = render(device, scene, width=64, height=64), render(device, cut, width=64, height=64)
    # Rounding moves a few photons to other fates; their share of a block is what differs.
    assert_same_picture(x, y, 0.05)
    for part in ("Direct", "Indirect"):
        assert x[part].mean() == pytest.approx(y[part].mean(), rel=2e-3)


def test_case_11_swapped_channels(device: Device) -> None:
    """Red and blue trade places everywhere, and so does the picture."""
    scene = cornell(True)

    def swap(c: Any) -> Any:
        return (c[2], c[1], c[0])

    materials = tuple(
        replace(
            m,
            diffuse=swap(m.diffuse),
            lobes=tuple(replace(lobe, colour=swap(lobe.colour)) for lobe in m.lobes),
        )
        for m in scene.materials
    )
    lights = tuple(replace(x, power=swap(x.power)) for x in scene.lights)
    a = render(device, scene)
    b = render(device, replace(scene, materials=materials, lights=lights))
    for part in PARTS:
        assert np.allclose(a[part], b[part][..., ::-1], rtol=1e-5, atol=1e-7)


def test_case_11_lights_add(device: Device) -> None:
    """Two lights together are each alone, added: direct light exactly, indirect in the mean."""
    scene = cornell(True)
    first = scene.lights[0]
    second = replace(first, name="second", position=(2.0, 3.0, 8.0), power=(500.0, 900.0, 300.0))
    settings = {"photons": 60000}
    a = render(device, replace(scene, lights=(first,)), **settings)
    b = render(device, replace(scene, lights=(second,)), **settings)
    both = render(device, replace(scene, lights=(first, second)), **settings)
    assert np.allclose(a["Direct"] + b["Direct"], both["Direct"], rtol=1e-5, atol=1e-6)
    total = (a["Indirect"] + b["Indirect"]).mean()
    assert both["Indirect"].mean() == pytest.approx(total, rel=0.02)
