# SPDX-License-Identifier: GPL-3.0-or-later
"""Lenses, panoramas and pixel filters cover the same pixels by the same shares as Cycles'."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.blender.settings import film_of
from tests.measure import render

from .build import add_mesh

pytestmark = pytest.mark.blender

SAMPLES = 256


@pytest.fixture
def quads(scene) -> None:
    """Many around the camera, which looks between them, turned."""
    rng = np.random.default_rng(1)
    shape: tuple[list[Any], list[Any]] = ([], [])
    for place in rng.normal(size=(60, 3)):
        away = place / np.linalg.norm(place)
        side = np.cross(away, (0.0, 0.6, 0.8))
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        at = len(shape[0])
        shape[0].extend(
            (away * rng.uniform(2, 5) + 0.3 * (a * side + b * np.cross(away, side))).tolist()
            for a, b in corners
        )
        shape[1].append(tuple(range(at, at + 4)))
    add_mesh("Quads", shape)
    scene.cycles.pixel_filter_type = "BOX"
    scene.camera.location, scene.camera.rotation_euler = (0.1, 0.2, 0.3), (1.2, 0.3, 0.5)


def compare(cycles, export, device, **film: Any) -> None:
    """The mean to half a percent; pixels as far apart as two seeds of Cycles' are, about."""
    camera, size = export()[0], bpy.context.scene.render
    settings = {"width": size.resolution_x, "height": size.resolution_y, "photons": 0}
    ours = render(device, camera, passes=SAMPLES, transparent=True, **settings, **film)
    theirs = [cycles(SAMPLES, seed) for seed in (1, 2)]
    ours, first, second = (image[..., 3] for image in (ours["Combined"], *theirs))
    assert 0.05 < first.mean() < 0.95
    assert ours.mean() == pytest.approx((first + second).mean() / 2, rel=0.005)
    apart = [np.sqrt(((one - first) ** 2).mean()) for one in (ours, second)]
    assert apart[0] < 1.5 * apart[1] + 0.002


LENS = {"aperture_fstop": 0.03, "focus_distance": 2.5}
BLADES = {"aperture_blades": 3, "aperture_rotation": 0.4, "aperture_ratio": 1.5}


@pytest.mark.stability(74)
@pytest.mark.parametrize(
    ("data", "dof"),
    [
        ({"lens": 20, "shift_x": 0.1}, LENS),
        ({"lens": 20, "clip_start": 2.5, "clip_end": 4.0}, LENS | BLADES),
        (
            {"type": "ORTHO", "clip_start": 0.5},
            LENS | {"aperture_fstop": 3.0},
        ),
        ({"type": "PANO", "panorama_type": "EQUIRECTANGULAR", "longitude_max": 2.0}, {}),
        ({"type": "PANO", "panorama_type": "FISHEYE_EQUIDISTANT", "fisheye_fov": 5.0}, {}),
        ({"type": "PANO", "panorama_type": "FISHEYE_EQUISOLID", "shift_y": 0.1}, {}),
        ({"type": "PANO", "panorama_type": "MIRRORBALL", "lens": 20}, LENS | BLADES),
    ],
)
def test_cameras(scene, quads, cycles_mean, export, device, data, dof) -> None:
    camera = scene.camera.data
    if "panorama_type" in data and not hasattr(camera, "panorama_type"):
        pytest.skip("before Blender 5.0 these are Cycles' properties")
    for name, value in data.items():
        setattr(camera, name, value)
    camera.dof.use_dof = bool(dof)
    for name, value in dof.items():
        setattr(camera.dof, name, value)
    compare(cycles_mean, export, device)


@pytest.mark.parametrize(
    ("kind", "width"), [("BLACKMAN_HARRIS", 1.5), ("GAUSSIAN", 3.0), ("BOX", 5.0)]
)
def test_filters(scene, quads, cycles_mean, export, device, kind, width) -> None:
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = kind, width
    scene.camera.data.lens = 20
    compare(cycles_mean, export, device, **film_of(scene))


@pytest.mark.parametrize("dof", [{"focus_distance": 0.0}, {"aperture_fstop": 0.0}])
def test_lenses_that_see_nothing(scene, quads, cycles_mean, export, device, dof) -> None:
    """Rays in the plane of the lens, and of a lens of kilometres: empty, as Cycles has them."""
    scene.camera.data.dof.use_dof = True
    for name, value in dof.items():
        setattr(scene.camera.data.dof, name, value)
    ours = render(device, export()[0], width=64, height=32, photons=0, transparent=True)
    theirs = cycles_mean(16, 1)
    assert np.isfinite(ours["Combined"]).all()
    assert ours["Combined"][..., 3].mean() == pytest.approx(theirs[..., 3].mean(), abs=0.01)


def moving(scene) -> None:
    """The camera goes, turns and zooms between frames 0 and 2, faster in the second half."""
    scene.render.use_motion_blur = True
    for frame, side, turn, lens in ((0, -0.3, 0.2, 20), (1, 0.1, 0.5, 22), (2, 0.6, 0.6, 30)):
        scene.camera.location[0] = side
        scene.camera.rotation_euler[2] = turn
        scene.camera.data.lens = lens
        scene.camera.keyframe_insert("location", frame=frame)
        scene.camera.keyframe_insert("rotation_euler", frame=frame)
        scene.camera.data.keyframe_insert("lens", frame=frame)
    scene.frame_set(1)


@pytest.mark.stability(74)
@pytest.mark.thorough("1.0-CENTER")
@pytest.mark.parametrize(
    ("shutter", "position", "steps", "curve"),
    [
        (1.0, "CENTER", 1, (1.0, 1.0, 1.0)),
        (0.8, "START", 2, (1.0, 1.0, 1.0)),
        (0.8, "END", 1, (0.0, 0.3, 1.0)),
        (0.0, "CENTER", 1, (1.0, 1.0, 1.0)),
    ],
)
def test_moving_cameras(
    scene, quads, cycles_mean, export, device, shutter, position, steps, curve
) -> None:
    moving(scene)
    render, camera = scene.render, scene.camera
    render.motion_blur_shutter, render.motion_blur_position = shutter, position
    camera.cycles.motion_steps = steps
    for point, height in zip(render.motion_blur_shutter_curve.curves[0].points, curve, strict=True):
        point.location[1] = height
    render.motion_blur_shutter_curve.update()
    compare(cycles_mean, export, device)
    assert scene.frame_current == 1 and scene.frame_subframe == 0.0


def test_a_camera_that_blurs_nothing(scene, quads, export) -> None:
    """Still, or told to be, as of the middle of the exposure."""
    scene.render.use_motion_blur, scene.render.motion_blur_position = True, "START"
    assert export()[0].camera.motion is None
    moving(scene)
    scene.camera.cycles.use_motion_blur = False
    scene.render.motion_blur_shutter = 2.0
    exported = export()[0].camera
    assert exported.motion is None
    scene.frame_set(2)
    np.testing.assert_allclose(exported.matrix, scene.camera.matrix_world, atol=1e-6)
