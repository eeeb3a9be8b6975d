# SPDX-License-Identifier: GPL-3.0-or-later
"""Anisotropic reflections of one light against Cycles, pixel by pixel: neither has any noise but
that of where in a pixel it looks."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export import Report, snapshot
from addon.photon.prepare import prepare as renderer_of
from addon.photon.settings import Settings
from addon.streams import Device
from tests.blender.build import QUAD, add_light, add_mesh, add_node, finish, new_material

from .cycles import prepare, read_exr

pytestmark = pytest.mark.blender

SIZE, SAMPLES, PASSES = 48, 256, 192
SEEN = 1.1  # [m]
RMS = 0.005  # of the root of the mean square
PRINCIPLED, GLOSSY = "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfAnisotropic"
METALLIC = "ShaderNodeBsdfMetallic"
TURNED = {"rotation_euler": (0.3, 0.2, 0.5)}
SQUASHED = {**TURNED, "scale": (1.0, 1.4, -0.8)}  # and mirrored


@pytest.fixture(autouse=True)
def scene() -> bpy.types.Scene:
    """A camera far above and a point light in the dark."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", SEEN
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0.0, 0.0, 10.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    add_light("Light", "POINT", energy=1000.0, shadow_soft_size=0.0, location=(2.0, -1.0, 7.0))
    return scene


def by_cycles() -> NDArray[np.float32]:
    """(h, w, 3) of the open scene."""
    scene = bpy.context.scene
    prepare(scene, SAMPLES, 1)
    scene.cycles.max_bounces = 0
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        return read_exr(Path(scene.render.filepath))


def by_us(device: Device) -> tuple[NDArray[np.float32], Report]:
    """The same of ours."""
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get())
    settings = Settings(
        width=SIZE, height=SIZE, passes=PASSES, photons=0, mirror_depth=0, backend="fragment"
    )
    renderer = renderer_of(exported, settings, device)
    try:
        for _ in range(PASSES):
            renderer.render_pass()
        return renderer.images()["Combined"][..., :3], report
    finally:
        renderer.release()


def ball(**placed: Any) -> bpy.types.Object:
    """Of radius 1 m, smooth, without UV maps."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0, calc_uvs=False)
    obj = bpy.context.object
    obj.data.shade_smooth()
    for name, value in placed.items():
        setattr(obj, name, value)
    return obj


def plane(**placed: Any) -> bpy.types.Object:
    return add_mesh("Plane", ([tuple(3.0 * x for x in v) for v in QUAD[0]], QUAD[1]), **placed)


def wear(
    obj: bpy.types.Object, kind: str, tangent: dict[str, Any] | None = None, **inputs: Any
) -> None:
    """Put a material of one shader on an object; `tangent`: of a Tangent node's properties."""
    material, tree = new_material()
    if kind == PRINCIPLED:
        given = {"Metallic": 1.0, "Base_Color": (0.9, 0.6, 0.3, 1.0), "Anisotropic": 0.7}
    else:
        given = {"Color" if kind == GLOSSY else "Base_Color": (0.9, 0.6, 0.3, 1.0)}
    given |= {"Roughness": 0.4, **inputs}
    if tangent:
        node = tree.nodes.new("ShaderNodeTangent")
        for name, value in tangent.items():
            setattr(node, name, value)
        given["Tangent"] = node.outputs[0]
    finish(tree, add_node(tree, kind, **given))
    obj.data.materials.append(material)


def add_uv(obj: bpy.types.Object, name: str, uv_at: Callable[[Any], tuple[float, float]]) -> Any:
    layer = obj.data.uv_layers.new(name=name)
    for loop in obj.data.loops:
        layer.uv[loop.index].vector = uv_at(obj.data.vertices[loop.vertex_index].co)
    return layer


def check(device: Device, record_property: Callable[[str, object], None]) -> None:
    """Compare the open scene's pictures."""
    reference, (ours, report) = by_cycles(), by_us(device)
    assert not [line for line in report.lines() if "Tangent" in line or "nisotrop" in line]
    found = np.sqrt(np.mean((ours - reference) ** 2) / np.mean(reference**2))
    record_property("rms", f"{found:.2%}")
    assert found < RMS


@pytest.mark.thorough("ball-0.0", "plane-0.25", "ball-0.25", "plane-0.125", "plane")
@pytest.mark.parametrize("rotation", [0.0, 0.25, 0.125])
@pytest.mark.parametrize("make", [plane, ball])
def test_principled(device: Device, record_property: Any, make: Any, rotation: float) -> None:
    wear(make(**TURNED), PRINCIPLED, Anisotropic_Rotation=rotation)
    check(device, record_property)


def test_dielectric(device: Device, record_property: Any) -> None:
    wear(ball(**TURNED), PRINCIPLED, Metallic=0.0, Anisotropic_Rotation=0.125)
    check(device, record_property)


@pytest.mark.thorough("0.6-0.0", "-0.6-0.125")
@pytest.mark.parametrize(("amount", "rotation"), [(0.6, 0.0), (0.6, 0.125), (-0.6, 0.125)])
def test_glossy(device: Device, record_property: Any, amount: float, rotation: float) -> None:
    wear(ball(**TURNED), GLOSSY, Anisotropy=amount, Rotation=rotation)
    check(device, record_property)


def test_metallic(device: Device, record_property: Any) -> None:
    if not hasattr(bpy.types, METALLIC):
        pytest.skip(f"this Blender has no {METALLIC}")
    wear(ball(**TURNED), METALLIC, Anisotropy=0.6, Rotation=0.125)
    check(device, record_property)


@pytest.mark.thorough("X", "Z")
@pytest.mark.parametrize("axis", "XYZ")
def test_radial(device: Device, record_property: Any, axis: str) -> None:
    tangent = {"direction_type": "RADIAL", "axis": axis}
    wear(ball(**SQUASHED), PRINCIPLED, tangent, Anisotropic_Rotation=0.125)
    check(device, record_property)


def test_own_texture_space(device: Device, record_property: Any) -> None:
    obj = ball(**TURNED)
    obj.data.use_auto_texspace = False
    obj.data.texspace_location, obj.data.texspace_size = (0.3, 0.2, 0.0), (1.0, 0.5, 2.0)
    wear(obj, PRINCIPLED)
    check(device, record_property)


@pytest.mark.thorough("B")  # what "" finds
@pytest.mark.parametrize("uv_map", ["", "A", "B"])
def test_uv_map(device: Device, record_property: Any, uv_map: str) -> None:
    """Maps that are no plane's, and mirrored in part."""
    obj = ball(**SQUASHED)
    add_uv(obj, "A", lambda v: (v.x + 0.3 * v.z, v.y - v.x**2))
    add_uv(obj, "B", lambda v: (abs(v.x - 0.1) + 0.3 * v.z, v.y)).active_render = True
    wear(obj, PRINCIPLED, {"direction_type": "UV_MAP", "uv_map": uv_map})
    check(device, record_property)


@pytest.mark.thorough("1.0")
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_missing_uv_map(device: Device, metallic: float) -> None:
    """Cycles divides by zero, and drops whatever a sample of such a material gives."""
    obj = ball(**TURNED)
    add_uv(obj, "A", lambda v: (v.x, v.y))
    tangent = {"direction_type": "UV_MAP", "uv_map": "Lost"}
    wear(obj, PRINCIPLED, tangent, Metallic=metallic)
    assert not by_cycles().any()
    ours, report = by_us(device)
    assert not ours.any()
    assert [e.detail for e in report.of("approximated") if "UV map 'Lost'" in e.feature] == [
        "there is none: black, as in Cycles"
    ]
