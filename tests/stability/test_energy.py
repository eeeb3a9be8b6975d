# SPDX-License-Identifier: GPL-3.0-or-later
"""Where photon maps gain, lose or misplace energy."""

from __future__ import annotations

import gc
import math
from itertools import product
from typing import Any

import moderngl
import numpy as np
import pytest

from addon.photon.scene import Camera, Scene
from addon.streams import Device
from tests.measure import fallen, not_finite, over_seeds, relative_bound, render, rendered
from tests.scenes import (
    DIM,
    UNIT_INTENSITY,
    Builder,
    closed_sphere,
    cornell,
    lit_plate,
    orthographic,
    plain_light,
    plain_material,
    replace,
    with_cone,
)
from tests.stability.table import Measured


@pytest.mark.stability(2)
def test_white_furnace(device: Device, measured: Measured) -> None:
    """Albedo 1: each of B bounces adds the direct light's irradiance once more."""
    bounces = 10
    pixels = over_seeds(
        device,
        closed_sphere(1.0),
        lambda im: im["Indirect"],
        photon_bounces=bounces,
        radius=0.3,
        filter="constant",
        boundary_correction=False,
        photons=40000,
        width=8,
        height=8,
    ) / (bounces / math.pi)
    assert measured("bias", relative_bound(pixels.mean(axis=(1, 2, 3)), 1.0), "%") <= 0.005
    assert measured("brightest pixel", pixels.mean(axis=0).max()) <= 1.01


def crease(degrees: float, outside: bool) -> Scene:
    """Two plates that meet in the y axis, lit and seen along their bisector."""
    half = math.radians(degrees) / 2
    sine, cosine = math.sin(half), math.cos(half)
    half_length = 0.55
    fold = Builder().add(
        [
            (x * sine, y, abs(x) * cosine)
            for x in (0, half_length, -half_length)
            for y in (-half_length, half_length)
        ],
        [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]],
    )
    side, distance = -1.0 if outside else 1.0, 1000.0
    cone = 2 * math.atan(1.05 * half_length * math.hypot(1.0, sine) / (distance - 1))
    light = plain_light(
        "far",
        "SPOT",
        (0, 0, side * distance),
        (UNIT_INTENSITY * distance**2,) * 3,
        (0, 0, -side),
        spot_size=cone,
        spot_blend=0.0,
    )
    view = orthographic((0, 0, 2 * side), (side, 0, 0), (0, 1, 0), 1.0)
    reach = 0.25 * sine  # a radius on either face
    view = replace(view, window=(-reach, reach, -0.25, 0.25))
    return fold.scene(view, [light], [DIM])


@pytest.mark.stability(6)
def test_crease(device: Device, measured: Measured, thorough: bool) -> None:
    """Both faces within a radius of the fold."""
    angles = (10, 45, 90, 135, 170)
    cases = [*product(angles, (False, True))] if thorough else [(10, False), (135, True)]
    for degrees, outside in cases:
        irradiance = math.sin(math.radians(degrees / 2))
        values = over_seeds(
            device,
            crease(degrees, outside),
            lambda im: [half.mean() for half in np.split(im["Indirect"], 2, axis=1)],
            direct_by_photons=True,
            radius=0.25,
            photons=20000,
            passes=16,
            width=8,
            height=8,
        )
        bound = relative_bound(values / (1e-3 / math.pi * irradiance), [1.0, 1.0])
        assert measured(f"{degrees} deg", bound, "%") <= 0.02


@pytest.mark.stability(7)
def test_thin_wall(device: Device, measured: Measured) -> None:
    """A room cut in two by a wall a thousandth thick, lit on one side; radius 0.3."""
    room = Builder().box((-1, -1, -1), (1, 1, 1))
    room.box((-5e-4, -1.01, -1.01), (5e-4, 1.01, 1.01))
    light = plain_light("light", "POINT", (-0.5, 0, 0), (100.0,) * 3)

    def seen(view: Camera) -> Any:
        scene = room.scene(view, [light], [plain_material("white", (0.7,) * 3)])
        return render(device, scene, radius=0.3, photons=100000)["Indirect"]

    dark, lit = (
        seen(orthographic((x, 0, 0), (0, s, 0), (0, 0, 1), 1.0)) for x, s in ((0.9, 1), (-0.9, -1))
    )
    assert lit.mean() > 0
    assert measured("the wall's dark side", dark.mean() / lit.mean()) <= 1e-4
    # The floor is one surface on either side: what ends the discs is the wall that stands on it.
    floor = seen(orthographic((0, 0, 0.9), (1, 0, 0), (0, 1, 0), 0.5))
    dark, lit = floor[:, 16:].mean(), floor[:, :16].mean()
    assert measured("floor that runs on below it", dark / lit) <= 1e-4


@pytest.mark.stability(28)
@pytest.mark.parametrize(
    ("backend", "kernel", "a_pass"), [("fragment", "reflector", 201), ("native", "photons", 1)]
)
@pytest.mark.usefixtures("not_aimed")
def test_closed_box_of_albedo_one(
    device: Device, measured: Measured, backend: str, kernel: str, a_pass: int
) -> None:
    """Every photon is cut off, and counted: what it carried is known."""
    box = Builder().box((-1, -1, -1), (1, 1, 1))
    scene = box.scene(
        cornell().camera,
        [plain_light("l", "POINT", (0, 0, 0), (1.0,) * 3)],
        [plain_material("white", (1.0,) * 3)],
    )
    settings: Any = {"photons": 5000, "photon_bounces": 200, "passes": 2, "backend": backend}
    with rendered(device, scene, **settings) as renderer:
        share = renderer.info()["unfinished_photons"] / (2 * 5000)
        assert renderer.launches()[kernel] == 2 * a_pass  # the radii's are the first pass's
        assert not_finite(renderer.images()) == 0
    assert measured("photons cut off and counted", share, "%") == 1.0


@pytest.mark.thorough
@pytest.mark.stability(41)
def test_grazing_splats(device: Device, measured: Measured) -> None:
    """An evenly lit floor seen at one degree."""
    scene, irradiance = lit_plate()
    angle = math.radians(1)
    back = np.array([0.0, -math.cos(angle), math.sin(angle)])
    view = orthographic(2 * back, (1, 0, 0), np.cross(back, (1, 0, 0)), 1.0)
    window = (-0.5, 0.5, -0.5 * math.sin(angle), 0.5 * math.sin(angle))
    light = with_cone(scene.lights[0], 2 * math.atan(0.8 / 2000.0))
    scene = replace(scene, camera=replace(view, window=window), lights=(light,))
    for shape in ("triangle", "quad", "point"):
        values = over_seeds(
            device,
            scene,
            lambda im: [im["Indirect"].mean(), im["Indirect"].max()],
            direct_by_photons=True,
            photon_bounces=1,
            estimator="splat",
            splat_shape=shape,
            radius=0.1,
            photons=25000,
            passes=4,
            width=16,
            height=16,
        ) / (0.5 / math.pi * irradiance)
        assert measured("energy", relative_bound(values[:, 0], 1.0), "%") <= 0.005
        # 400 photons a disc and pass, and the filter: 3 % of noise.
        assert measured("brightest pixel", values[:, 1].max()) <= 1.15


@pytest.mark.stability(43)
@pytest.mark.thorough("splat-constant")
@pytest.mark.parametrize("kernel", ["epanechnikov", "constant"])
@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_many_photons_on_one_pixel(
    device: Device, measured: Measured, thorough: bool, estimator: str, kernel: str
) -> None:
    """A pixel that a whole pass falls on, against a float64 sum over the same photons."""
    count = 1 << 22 if thorough else 500_000
    scene, _ = lit_plate()
    view = orthographic((0, 0, 1), (1, 0, 0), (0, 1, 0), 1e-3)
    light = with_cone(scene.lights[0], 2 * math.atan(0.9 / 2000.0))
    scene = replace(scene, camera=view, lights=(light,), materials=(DIM,))
    settings: dict[str, Any] = {"radius": 1.0, "filter": kernel, "boundary_correction": False}
    settings |= {"direct_by_photons": True, "photon_bounces": 1, "photons": count}
    with rendered(device, scene, width=1, height=1, estimator=estimator, **settings) as renderer:
        found = renderer.images()["Indirect"].mean() / (1e-3 / math.pi)
        assert renderer.photons
        place, deposit = renderer.photons.mapper.deposits.arrays()
    squares = (place[:, :3].astype(float) ** 2).sum(axis=1)  # from the middle, a scene unit is 1 m
    weight = np.where(squares <= 1, 1.0 if kernel == "constant" else 2 * (1 - squares), 0.0)
    error = abs(found / ((deposit[:, 0] * weight).sum() / math.pi) - 1)
    measured(f"{estimator} of {count:.0e}, {kernel}", error)
    assert error <= 1e-4


@pytest.mark.stability(44)
def test_sums_are_float32(device: Device, measured: Measured) -> None:
    """No texture of a render holds half floats."""
    with rendered(device, cornell(True, lobe=True), estimator="splat"):
        textures = [x for x in gc.get_objects() if isinstance(x, moderngl.Texture)]
        kinds = {texture.dtype for texture in textures if texture.mglo is not None}
    assert len(textures) > 20 and "f4" in kinds
    assert measured("half-float textures", len(kinds - {"f4", "u4", "f1"})) == 0


@pytest.mark.stability(25)
@pytest.mark.parametrize("backend", ["fragment", "native"])
@pytest.mark.parametrize("offset", [None, 0.0])
def test_terminator_of_a_coarse_ball(
    device: Device, measured: Measured, backend: str, offset: float | None
) -> None:
    """Light from the right on a ball of few triangles: as on the ball that they stand for, also
    where triangles turn from the light before it does, and none on its other side. With a Geometry
    Offset of 0 such triangles are black, as in Cycles."""
    size, width = 64, 2.2
    view = orthographic((0, 0, 5), (1, 0, 0), (0, 1, 0), width)
    light = plain_light("light", "POINT", (1000.0, 0, 0), (1e6 * UNIT_INTENSITY,) * 3)
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=2)
    scene = ball.scene(view, [light], [plain_material("grey", (0.5,) * 3)])
    if offset is not None:
        scene = replace(scene, terminators=np.full(len(scene.surfaces), offset, np.float32))
    options: dict[str, Any] = {"backend": backend, "passes": 8, "photons": 0}
    with rendered(device, scene, width=size, height=size, **options) as renderer:
        found = renderer.images()["Direct"][..., 0] * (math.pi / 0.5)
    across = (np.arange(size) + 0.5) / size * width - width / 2
    x, y = np.meshgrid(across, across)
    band = (x > 0.03) & (x < 0.3) & (np.hypot(x, y) < 0.9)
    black = measured("black in the band", (found[band] < 0.1 * x[band]).mean(), "%")
    if offset == 0.0:
        assert 0.03 < black < 0.12
        return
    assert black == 0
    error = np.abs(found - x)[band].mean() / x[band].mean()
    assert measured("error in the band", error, "%") <= 0.02
    assert measured("light on the dark side", found[x < -0.03].max()) == 0


@pytest.mark.stability(25)
def test_ledger_with_smooth_normals(device: Device, measured: Measured) -> None:
    """A coarse closed sphere with smooth normals: what falls on it is flux / (1 - albedo)."""
    ball = Builder().sphere((0, 0, 0), 1.0, subdivisions=1)
    light = plain_light("light", "POINT", (0.3, 0.2, 0.1), (UNIT_INTENSITY,) * 3)
    scene = ball.scene(cornell().camera, [light], [plain_material("white", (0.6,) * 3)])
    values = []
    for seed in range(16):
        options = {"seed": seed, "width": 1, "height": 1, "photons": 50000}
        with rendered(device, scene, direct_by_photons=True, **options) as renderer:
            values.append(fallen(renderer)[0])
    assert measured("ledger", relative_bound(values, [UNIT_INTENSITY / 0.4] * 3), "%") <= 0.005
