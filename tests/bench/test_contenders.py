# SPDX-License-Identifier: GPL-3.0-or-later
"""The converters to other renderers keep units: a lamp over a plane against the closed form."""

from __future__ import annotations

import shutil
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.scene import Camera, Instruction, Light, Material, Scene, area_light
from tests.scenes import Builder, plain_light, plain_material

from .chart.plain import check_converted, cone_of, specular_of
from .chart.spot import spot_profile
from .chart.worker import EngineError, Worker

SIZE = 64
ENGINES = [
    ("photon_stream", "photons"),
    ("photon_stream", "denoised"),
    ("mitsuba", "path"),
    ("luxcore", "path"),
    ("povray", "photons"),
    ("light_tracer", "light"),
]
PACKAGES = {
    "photon_stream": "moderngl",
    "mitsuba": "mitsuba",
    "luxcore": "pyluxcore",
    "light_tracer": "mitsuba",
}
PROGRAMS = {"povray": "povray"}  # of no package
SECONDS, PASSES = 6.0, 128  # when others' climbs end, and ours: no load makes those fewer
CAMERA = np.array([[1, 0, 0, 0.5], [0, 1, 0, -0.3], [0, 0, 1, 4.0], [0, 0, 0, 1]])
SPOT = plain_light(
    "Spot", "SPOT", (0.7, 0.2, 2.5), (300.0, 200.0, 100.0), (-0.6, 0.0, -0.8), 0.0, 1.6, 0.4
)
POINT = plain_light("Point", "POINT", (-0.7, 0.4, 2.0), (30.0, 60.0, 90.0))


def plane(light: Light, material: Material) -> Scene:
    """A square of 20 m in z = 0 under a light, seen from 4 m above."""
    view = Camera("PERSP", CAMERA, (-0.4, 0.4, -0.4, 0.4), 0.1, 100.0)
    square = Builder().quad((-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0))
    return square.scene(view, [light], [material])


def floor_points(fine: int) -> np.ndarray:
    """(fine, fine, 3): what the centres of so many pixels a side see."""
    x = ((np.arange(fine) + 0.5) / fine * 2 - 1) * 0.4 * 4.0
    return np.stack([*np.meshgrid(x + 0.5, x - 0.3), np.zeros((fine, fine))], -1)


def radiance(light: Light, material: Material) -> np.ndarray:
    """(4 SIZE, 4 SIZE, 3): k_d / pi * I cos / d^2."""
    away = floor_points(4 * SIZE) - np.array(light.position)
    distance = np.linalg.norm(away, axis=-1)
    intensity = np.ones_like(distance)
    if light.kind == "spot":
        angle = np.arccos(away @ np.array(light.direction) / distance)
        intensity = spot_profile(angle, *cone_of(light))
    irradiance = intensity * -away[..., 2] / distance**3
    power = np.array(light.power) / (4 * np.pi)
    return np.array(material.diffuse) / np.pi * power * irradiance[..., None]


def blocks(image: np.ndarray) -> np.ndarray:
    """(8, 8, 3): means."""
    side = len(image) // 8
    return image.reshape(8, side, 8, side, 3).mean((1, 3))


def rendered(
    module: str, method: str, scene: Scene, folder: Path, with_llvm: bool = False
) -> np.ndarray:
    if (name := PROGRAMS.get(module)) and not shutil.which(name):
        pytest.skip(f"{name} is not installed: Debian's package {name} has it")
    if (name := PACKAGES.get(module)) and find_spec(name) is None:
        pytest.skip(f"{name} is not installed; `python build.py chart` does it")
    if with_llvm:
        from .chart.contenders.mitsuba import newest_llvm

        if not newest_llvm():
            pytest.skip("Mitsuba's scalar mode cannot; Debian's package libllvm19 has the other's")
    scene.save(folder / "scene.npz")
    worker = Worker(module)
    try:
        worker.load(folder / "scene.npz", folder / "none.blend", SIZE)
        seconds = SECONDS * (2.0 if method == "light" else 1.0)  # it sprinkles
        ours = module == "photon_stream"
        steps: list[dict[str, Any]] = []
        for step in worker.climb(method, 1, 1e3 if ours else seconds, folder):
            if "file" in step:
                steps.append(step)
            if ours and step.get("effort", 0) >= PASSES:
                break
        assert min(step["wall"] for step in steps) > 0
        return np.load(steps[-1]["file"])
    finally:
        worker.close()


@pytest.mark.thorough("denoised", "photon_stream-photons-point")
@pytest.mark.parametrize("light", [SPOT, POINT], ids=["spot", "point"])
@pytest.mark.parametrize(("module", "method"), ENGINES)
def test_a_lamp_over_a_plane(module: str, method: str, light: Light, tmp_path: Path) -> None:
    if module == "povray" and light.kind == "spot":
        pytest.skip("POV-Ray's spots fade in another way: refused")
    material = plain_material("Paint", (0.8, 0.5, 0.2))
    with_llvm = module == "light_tracer"
    found = rendered(module, method, plane(light, material), tmp_path, with_llvm)
    mine, expected = blocks(found), blocks(radiance(light, material))
    bright = expected > 0.1 * expected.max()
    # Light tracing sprinkles: its blocks still have a percent of noise; POV-Ray's photons as well.
    limit = {("light_tracer", "light"): 0.04, ("povray", "photons"): 0.03}.get(
        (module, method), 0.01
    )
    np.testing.assert_allclose(mine[bright], expected[bright], rtol=limit)
    np.testing.assert_allclose(mine.mean((0, 1)), expected.mean((0, 1)), rtol=3e-3)


def test_a_phong_lobe(tmp_path: Path) -> None:
    """Mitsuba's is ours: Lafortune & Willems' closed form."""
    material = plain_material("Gloss", (0.1, 0.2, 0.3), (0.3, 0.2, 0.1), 20.0)
    found = rendered("mitsuba", "path", plane(POINT, material), tmp_path, with_llvm=True)
    points = floor_points(4 * SIZE)
    to_light, to_eye = np.array(POINT.position) - points, CAMERA[:3, 3] - points
    distance = np.linalg.norm(to_light, axis=-1, keepdims=True)
    cosine = ((to_light * (-1, -1, 1)) * to_eye).sum(-1, keepdims=True) / (
        distance * np.linalg.norm(to_eye, axis=-1, keepdims=True)
    )
    lobe = np.array(specular_of(material)[0]) * 22 / (2 * np.pi) * np.maximum(cosine, 0) ** 20
    irradiance = np.array(POINT.power) / (4 * np.pi) * to_light[..., 2:] / distance**3
    mine, expected = blocks(found), blocks(radiance(POINT, material) + lobe * irradiance)
    np.testing.assert_allclose(mine, expected, rtol=0.02)
    np.testing.assert_allclose(mine.mean((0, 1)), expected.mean((0, 1)), rtol=3e-3)


def test_lights_that_the_paper_does_not_have_are_refused() -> None:
    check_converted(POINT)
    with pytest.raises(ValueError, match="'Point' has a radius"):
        check_converted(plain_light("Point", "POINT", (0, 0, 0), (1, 1, 1), radius=0.1))
    with pytest.raises(ValueError, match="'Key' is of kind area"):
        size = (1.0, 1.0)
        check_converted(area_light("Key", (0, 0, 0), (1, 1, 1), (0, 0, -1), (1, 0, 0), size=size))


def test_textures_are_refused() -> None:
    paint = plain_material("Paint", (0.8, 0.5, 0.2))
    assert max(specular_of(paint)[0]) == 0
    checkered = replace(paint, program=(Instruction("checker", ()),))
    with pytest.raises(ValueError, match="'Paint' has textures"):
        specular_of(checkered)


def test_luxcore_refuses_phong_lobes(tmp_path: Path) -> None:
    material = plain_material("Gloss", (0.1, 0.2, 0.3), (0.3, 0.2, 0.1), 20.0)
    if find_spec("pyluxcore") is None:
        pytest.skip("pyluxcore is not installed; `python build.py chart` does it")
    with pytest.raises(EngineError, match="'Gloss' is neither diffuse nor a mirror"):
        rendered("luxcore", "path", plane(POINT, material), tmp_path)


def test_an_engine_that_is_not_there_says_so(tmp_path: Path) -> None:
    worker = Worker("renderman")
    with pytest.raises(EngineError, match="No module named"):
        worker.load(tmp_path / "scene.npz", tmp_path / "scene.blend", SIZE)
    worker.close()
