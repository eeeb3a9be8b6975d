# SPDX-License-Identifier: GPL-3.0-or-later
"""blend_scenes/kitchen.blend, whose picture stands in the README, is rendered as it is."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from addon.blender.export import Report, snapshot
from addon.photon.scene import Scene
from addon.photon.stage.straight import straight_code

pytestmark = pytest.mark.blender

BLEND = Path(__file__).resolve().parents[2] / "blend_scenes/kitchen.blend"
TEXTURES = {"noise_3d", "wave", "brick", "checker", "image", "ramp", "bump", "object", "attribute"}


@pytest.fixture(scope="module")
def exported() -> tuple[Scene, Report]:
    bpy.ops.wm.open_mainfile(filepath=str(BLEND))
    return snapshot(bpy.context.evaluated_depsgraph_get())


def test_the_report_finds_nothing_that_is_not_exact(exported: tuple[Scene, Report]) -> None:
    scene, report = exported
    count = len(scene.materials)
    assert report.lines() == [] and report.warnings == ()
    assert count > 20 and report.summary.startswith(f"{count} of {count} materials exact")


def test_it_has_the_textures_that_it_is_there_for(exported: tuple[Scene, Report]) -> None:
    scene, _ = exported
    kinds = {node.kind for material in scene.materials for node in material.program}
    assert kinds >= TEXTURES
    lobes = {lobe.kind for material in scene.materials for lobe in material.lobes}
    assert lobes >= {"ggx_dielectric", "coat", "sheen", "transparent"}
    assert {light.kind for light in scene.lights} == {"area"}


def test_its_programs_are_straight_code(exported: tuple[Scene, Report]) -> None:
    """Interpreted, a pass takes two or three times as long on processors."""
    scene, _ = exported
    assert straight_code(scene.materials)
