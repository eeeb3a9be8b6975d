# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth balls of few faces, whose normals lean away from the viewer where the ball ends: lobes
that Cycles has about these normals themselves."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from tests.measure import render

from .build import add_light, shader_material

pytestmark = pytest.mark.blender

SIZE = 48
CASES: dict[str, tuple[str, dict[str, Any], dict[str, str]]] = {
    "sheen": ("ShaderNodeBsdfSheen", {"Roughness": 0.2}, {}),
    "rough diffuse": ("ShaderNodeBsdfDiffuse", {"Roughness": 1.0}, {}),
    "toon": ("ShaderNodeBsdfToon", {"Size": 0.5, "Smooth": 0.2}, {"component": "GLOSSY"}),
}


@pytest.mark.thorough("toon")
@pytest.mark.parametrize("case", CASES)
def test_silhouettes(scene, cycles_mean, export, device, case) -> None:
    kind, inputs, properties = CASES[case]
    material = shader_material(kind, **inputs)
    for node in material.node_tree.nodes:
        for name, value in properties.items():
            if hasattr(node, name) and node.bl_idname == kind:
                setattr(node, name, value)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    add_light("Sun", "SUN", energy=3.0, angle=0.3, rotation_euler=(0.9, 0.4, 0.0))
    camera = scene.camera
    camera.location, camera.rotation_euler = (0.0, -4.0, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    theirs = cycles_mean(256, 1)[..., :3].astype(float)
    # Few rays meet sheen's rim: after 128 passes its mean has a deviation of 1.4 % between seeds.
    passes = 2048 if case == "sheen" else 128
    settings: Any = {"width": SIZE, "height": SIZE, "passes": passes, "photons": 100}
    ours = render(device, export()[0], **settings)["Combined"][..., :3].astype(float)
    blocks = (x.reshape(6, 8, 6, 8, 3).mean(axis=(1, 3)) for x in (ours, theirs))
    off = np.abs(np.subtract(*blocks)).mean() / theirs.mean()
    print(f"{case}: {off:.2%} off, mean {ours.mean() / theirs.mean():.4f}")
    most = 0.1 if case == "sheen" else 0.006  # a rim of a pixel
    assert off < most and ours.mean() == pytest.approx(theirs.mean(), rel=0.02)
