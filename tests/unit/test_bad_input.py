# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad scenes in the renderer: a warning, and the rest of the picture as it should be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.streams import Device
from tests.scenes import backdrop, cornell, plain_material
from tests.stability.table import Measured

PARTS = ("Direct", "Indirect", "Mirror")


def render(device: Device, scene: Scene, **settings: Any) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The images, all finite, and the warnings."""
    settings = {"width": 32, "height": 32, "passes": 2, "photons": 5000} | settings
    renderer = prepare(scene, Settings(**settings), device)
    for _ in range(renderer.settings.passes):
        renderer.render_pass()
    images = renderer.images()
    renderer.release()
    assert all(np.isfinite(image).all() for name, image in images.items() if name != "Error")
    assert images["Combined"].min() >= 0
    return images, renderer.warnings


def with_triangle(scene: Scene, corners: Any) -> Scene:
    """The scene with one more triangle, amid the others."""
    count, at = len(scene.vertices), 3
    triangle = np.arange(count, count + 3, dtype=np.int32)
    normals = np.full((3, 3), np.nan, np.float32)
    return replace(
        scene,
        vertices=np.concatenate([scene.vertices, np.float64(corners)]),
        triangles=np.insert(scene.triangles, at, triangle, axis=0),
        corner_normals=np.insert(scene.corner_normals, at, normals, axis=0),
        material=np.insert(scene.material, at, np.int32(1)),
        surface=np.insert(scene.surface, at, np.int32(0)),
    )


def same(a: dict[str, Any], b: dict[str, Any]) -> bool:
    return all(a[name].tobytes() == b[name].tobytes() for name in a)


def differing(a: dict[str, Any], b: dict[str, Any]) -> int:
    """The number of pixel values that are not equal to the bit."""
    return sum(np.count_nonzero(a[name] != b[name]) for name in a)


def test_good_scene_has_no_warnings(device: Device) -> None:
    assert render(device, cornell(True))[1] == ()


@pytest.mark.stability(35)
def test_no_light(device: Device, measured: Measured) -> None:
    images, warnings = render(device, replace(cornell(), lights=()))
    assert warnings == ("the scene has no light",)
    assert measured("light in the picture", images["Combined"][..., :3].max()) == 0


@pytest.mark.stability(35)
def test_zero_power(device: Device) -> None:
    scene = cornell()
    off = replace(scene.lights[0], name="off", power=(0.0, 0.0, 0.0))
    images, warnings = render(device, replace(scene, lights=(off,)))
    assert warnings == ("light 'off' has no power",)
    assert not images["Combined"][..., :3].any()
    # Beside one that shines it changes nothing but the warning.
    both, warnings = render(device, replace(scene, lights=(*scene.lights, off)))
    assert warnings == ("light 'off' has no power",)
    assert same(both, render(device, scene)[0])


@pytest.mark.stability(19)
@pytest.mark.parametrize(
    "value",
    [
        np.nan,
        np.inf,
        -np.inf,
        1e200,
    ],
)
def test_vertex_that_is_no_place(device: Device, value: float, measured: Measured) -> None:
    """The triangle is skipped and counted, the rest identical."""
    scene = cornell(True)
    broken = with_triangle(scene, [(1, 1, 1), (2, value, 1), (1, 2, 2)])
    images, warnings = render(device, broken)
    assert warnings == ("1 triangles with NaN or infinite vertices were skipped",)
    good, _ = render(device, scene)
    assert measured("pixels that differ", differing(images, good)) == 0


@pytest.mark.stability(18)
@pytest.mark.parametrize(
    "corners",
    [
        [(1, 1, 1)] * 3,
        [(1, 1, 1), (2, 2, 2), (1, 1, 1)],
        [(1, 1, 1), (2, 1, 1), (3, 1, 1)],
    ],
    ids=["point", "two corners", "line"],
)
def test_zero_area(device: Device, corners: Any, measured: Measured) -> None:
    scene = cornell(True)
    images, warnings = render(device, with_triangle(scene, corners))
    assert warnings == ("1 triangles of zero area were skipped",)
    good, _ = render(device, scene)
    assert measured("pixels that differ", differing(images, good)) == 0


@pytest.mark.stability(18, 19)
def test_nothing_but_bad_triangles(device: Device) -> None:
    scene = replace(cornell(), vertices=np.full_like(cornell().vertices, np.nan))
    lights = (*scene.lights, *backdrop((0.5, 0.5, 0.5)))
    images, warnings = render(device, replace(scene, lights=lights))
    count = len(scene.triangles)
    assert f"{count} triangles with NaN or infinite vertices were skipped" in warnings
    assert "the scene has no triangles to render" in warnings
    assert (images["Combined"] == [0.5, 0.5, 0.5, 1.0]).all()


def test_normals_that_are_none(device: Device) -> None:
    """The triangle's own takes their place: on a flat wall nothing changes."""
    scene = cornell()
    normals = scene.corner_normals.copy()
    flat = scene.surface < 6  # all but the sphere
    normals[flat] = np.array([np.nan, 0.0, np.inf], np.float32)[None, :, None]
    images, _ = render(device, replace(scene, corner_normals=normals))
    good, _ = render(device, scene)
    for part in PARTS:
        assert images[part].mean() == pytest.approx(good[part].mean(), rel=0.02, abs=1e-9)
    assert np.allclose(images["Direct"], good["Direct"], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("offset", [(1e6, 0.0, 0.0), (1e6, -1e6, 1e6)])
def test_a_million_metres_away(device: Device, offset: Any) -> None:
    """The same picture: means over 8x8 blocks within 2 %."""
    scene = cornell(True)
    matrix = scene.camera.matrix.copy()
    matrix[:3, 3] += offset
    lights = tuple(replace(x, position=tuple(np.add(x.position, offset))) for x in scene.lights)
    far = replace(
        scene,
        camera=replace(scene.camera, matrix=matrix),
        lights=lights,
        vertices=scene.vertices + offset,
    )
    a, b = (
        render(device, x, width=64, height=64, photons=20000, radius=0.5)[0] for x in (scene, far)
    )
    for part in PARTS:
        x, y = (image[part].reshape(8, 8, 8, 8, 3).mean((1, 3)) for image in (a, b))
        assert np.abs(x - y).max() <= 0.02 * x.max(), part


def painted(k_d: float, k_s: float) -> Scene:
    scene = cornell()
    white = plain_material("white", (k_d,) * 3, (k_s,) * 3)
    return replace(scene, materials=(white, *scene.materials[1:]))


@pytest.mark.stability(29)
def test_albedo_above_one(device: Device, measured: Measured) -> None:
    """Clamped to 1, with a warning."""
    images, warnings = render(device, painted(1.5, 0.0))
    assert any("white" in warning for warning in warnings)
    good, _ = render(device, painted(1.0, 0.0))
    for part in PARTS:
        assert np.allclose(images[part], good[part], rtol=1e-4, atol=1e-6)
    most = abs(images["Combined"] / np.maximum(good["Combined"], 1e-6) - 1).max()
    assert measured("differs from the clamped one by", most, "%") <= 1e-3


@pytest.mark.stability(29)
def test_lobes_that_add_up_to_more_than_one(device: Device, measured: Measured) -> None:
    """The eye sees them as they are; photons meet k_d + k_s = 1, so light does not grow without
    end. With a warning."""
    images, warnings = render(device, painted(0.8, 0.8))
    assert any("white" in warning for warning in warnings)
    alone, _ = render(device, painted(0.8, 0.0))
    assert np.allclose(images["Direct"], alone["Direct"], rtol=1e-4, atol=1e-6)
    halves, _ = render(device, painted(0.5, 0.5))
    photons = images["Indirect"][..., :3] / np.maximum(halves["Indirect"][..., :3], 1e-9)
    lit = photons[halves["Indirect"][..., :3] > 1e-6]
    most = measured("of what photons bring to halves it shows at most", lit.max(), "times")
    assert most == pytest.approx(1.6, rel=1e-3) and lit.min() == pytest.approx(1.0, rel=1e-3)


@pytest.mark.stability(56)
@pytest.mark.parametrize("radius", [1e-9, 1e9])
def test_radius_at_its_ends(device: Device, radius: float) -> None:
    for estimator in ("gather", "splat"):
        render(device, cornell(), radius=radius, photons=500, passes=1, estimator=estimator)
