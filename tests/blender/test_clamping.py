# SPDX-License-Identifier: GPL-3.0-or-later
"""No sample brings more light than Cycles' limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from addon.blender.settings import settings_from
from tests.measure import render

from .build import add_light, add_mesh, shader_material
from .lobes import DIFFUSE

pytestmark = pytest.mark.blender

SIZE = 32


def test_limits_are_cycles(scene) -> None:
    """New scenes have one of other light."""
    properties = scene.cycles.bl_rna.properties
    assert properties["sample_clamp_direct"].default == 0.0
    assert properties["sample_clamp_indirect"].default == 10.0
    scene.cycles.sample_clamp_direct, scene.cycles.sample_clamp_indirect = 2.5, 10.0
    settings = settings_from(scene, (SIZE, SIZE))
    assert (settings.clamp_direct, settings.clamp_indirect) == (2.5, 10.0)


@pytest.mark.parametrize("is_behind", [False, True], ids=["seen", "behind alpha"])
@pytest.mark.parametrize("limits", [(0.0, 0.0), (2.0, 0.0), (0.0, 0.7), (1.5, 0.5)])
def test_limits(scene, export, cycles_mean, device, limits, is_behind) -> None:
    """A floor in the sun, which a mirror and a mirror in that show again, and what emits."""
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    grey = shader_material(DIFFUSE, Color=(0.9, 0.6, 0.3, 1))
    add_mesh("Floor", scale=(3, 3, 1)).data.materials.append(grey)
    mirror = shader_material("ShaderNodeBsdfGlossy", Color=(1, 1, 1, 1), Roughness=0.0)
    for number, x in enumerate((-1.2, 1.2)):
        turned = {"rotation_euler": (0, math.radians((70, -70)[number]), 0)}
        panel = add_mesh(f"Mirror {number}", location=(x, 0.5, 0.7), scale=(0.7, 0.7, 1), **turned)
        panel.data.materials.append(mirror)
    lit = add_mesh("Lit", location=(0, -0.8, 0.5), rotation_euler=(0.8, 0, 0), scale=(0.3,) * 3)
    lit.data.materials.append(shader_material("ShaderNodeEmission", Strength=4.0))
    if is_behind:
        clear = shader_material("ShaderNodeBsdfTransparent")
        add_mesh("Clear", location=(0, 0, 3), scale=(3, 3, 1)).data.materials.append(clear)
    add_light("Sun", "SUN", energy=12.0, rotation_euler=(0.2, 0.1, 0))
    cycles = scene.cycles
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = limits
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.diffuse_bounces = 0  # what photons bring has no limits
    theirs = cycles_mean(64, 1)[..., :3]
    clamps = dict(zip(("clamp_direct", "clamp_indirect"), limits, strict=True))
    exported, _ = export()
    size = {"width": SIZE, "height": SIZE, "passes": 32, "photons": 0}
    ours = render(device, exported, transparent=True, mirror_depth=12, **size, **clamps)
    found = ours["Combined"][..., :3]
    off = np.abs(found - theirs) / np.maximum(theirs, 0.1 * theirs.mean())
    assert np.median(off) < 0.01 and (off.max(axis=-1) < 0.05).mean() > 0.85
    assert found.mean() == pytest.approx(theirs.mean(), rel=0.01)
