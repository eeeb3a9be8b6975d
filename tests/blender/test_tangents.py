# SPDX-License-Identifier: GPL-3.0-or-later
"""Anisotropic reflections: how far microfacets are stretched, and along which tangents."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export import Report
from addon.blender.export.tangents import uv_tangents
from addon.photon.scene import Scene

from .build import CUBE, QUAD, add_mesh, add_node, finish, new_material, shader_material

pytestmark = pytest.mark.blender

PRINCIPLED, GLOSSY = "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfAnisotropic"
METALLIC = "ShaderNodeBsdfMetallic"
ALPHA = 0.25  # of roughness 0.5


def metal(**inputs: Any) -> bpy.types.Material:
    given = {"Metallic": 1.0, "Roughness": 0.5, "Anisotropic": 0.5} | inputs
    return shader_material(PRINCIPLED, **given)


def with_tangent(kind: str = "ShaderNodeTangent", **properties: Any) -> bpy.types.Material:
    """Anisotropic metal whose Tangent a node feeds."""
    material, tree = new_material()
    feeding = tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(feeding, name, value)
    linked = {"Metallic": 1.0, "Anisotropic": 0.5, "Tangent": feeding.outputs["Tangent"]}
    finish(tree, add_node(tree, PRINCIPLED, **linked))
    return material


def add_uv(mesh: bpy.types.Mesh, name: str, uv_at: Callable[[Any], tuple[float, float]]) -> Any:
    layer = mesh.uv_layers.new(name=name)
    for loop in mesh.loops:
        layer.uv[loop.index].vector = uv_at(mesh.vertices[loop.vertex_index].co)
    return layer


def notes(report: Report, feature: str) -> list[str]:
    return [f"{e.object}: {e.detail}" for e in report.of("approximated") if feature in e.feature]


def directions(vectors: Any) -> NDArray[np.float64]:
    """Unit vectors, of one sign: lobes are the same both ways."""
    vectors = np.asarray(vectors, float)
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    largest = np.take_along_axis(unit, np.abs(unit).argmax(-1, keepdims=True), -1)
    return unit * np.sign(largest)


def corners(scene: Scene) -> NDArray[np.float64]:
    return scene.vertices[scene.triangles]


# Shaders.


@pytest.mark.parametrize(
    ("kind", "inputs", "aspect", "rotation"),
    [
        (PRINCIPLED, {"Anisotropic": 0.5}, math.sqrt(1 - 0.45), 0.0),
        (PRINCIPLED, {"Anisotropic": 1.0, "Anisotropic_Rotation": 0.125}, math.sqrt(0.1), 0.125),
        (PRINCIPLED, {"Anisotropic": -0.5, "Anisotropic_Rotation": 0.125}, 1.0, 0.0),
        (METALLIC, {"Anisotropy": 0.5, "Rotation": 0.25}, math.sqrt(1 - 0.45), 0.25),
        (GLOSSY, {"Anisotropy": 0.5, "Rotation": 0.125}, 1 / (1 - 0.5), 0.125),
        (GLOSSY, {"Anisotropy": -0.5, "Rotation": 0.75}, 1 - 0.5, 0.25),  # modulo half a turn
        (GLOSSY, {"Anisotropy": 0.00009}, 1.0, 0.0),
        (GLOSSY, {"Anisotropy": 5.0}, 1 / (1 - 0.99), 0.0),
    ],
)
def test_stretched(
    export: Any, kind: str, inputs: dict[str, float], aspect: float, rotation: float
) -> None:
    """The tangent is the rougher way, of Glossy the smoother; alpha is 1 at most."""
    if not hasattr(bpy.types, kind):
        pytest.skip(f"this Blender has no {kind}")
    given = {"Roughness": 0.5} | ({"Metallic": 1.0} if kind == PRINCIPLED else {}) | inputs
    add_mesh("Plane").data.materials.append(shader_material(kind, **given))
    scene, report = export()
    ((lobe,),) = (material.lobes for material in scene.materials)
    found = [lobe.parameters[name] for name in ("alpha_x", "alpha_y", "turn")]
    wanted = [min(ALPHA / aspect, 1.0), min(ALPHA * aspect, 1.0), 2.0 * math.pi * rotation]
    assert found == pytest.approx(wanted, rel=1e-6)
    assert lobe.is_anisotropic == (aspect != 1.0)
    assert scene.corner_tangents.shape == ((2, 3, 3) if lobe.is_anisotropic else (0, 3, 3))
    assert not notes(report, "nisotrop") and not notes(report, "Tangent")


def test_all_lobes_of_a_material_are_stretched(export) -> None:
    add_mesh("Plane").data.materials.append(metal(Metallic=0.5))
    scene = export()[0]
    assert [lobe.kind for lobe in scene.materials[0].lobes] == ["ggx_metal", "ggx_dielectric"]
    assert all(lobe.is_anisotropic for lobe in scene.materials[0].lobes)


def test_other_links_are_named(export) -> None:
    material, tree = new_material()
    feeding = tree.nodes.new("ShaderNodeCombineXYZ")
    linked = {"Metallic": 1.0, "Anisotropic": 0.5, "Tangent": feeding.outputs[0]}
    finish(tree, add_node(tree, PRINCIPLED, **linked))
    add_mesh("Plane").data.materials.append(material)
    scene, report = export()
    # Blender since 5.2 works it out.
    names = feeding.name, "Vector"
    assert sum(len(notes(report, f"Tangent from '{name}'")) for name in names) == 1
    expected = corners(scene)[..., [1, 0, 2]] * (-1, 1, 0)
    np.testing.assert_allclose(directions(scene.corner_tangents), directions(expected), atol=1e-6)


@pytest.mark.parametrize(("axis", "named"), [("Z", 0), ("X", 1)])
def test_two_tangents_become_one(export, axis: str, named: int) -> None:
    material, tree = new_material()
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.axis = "RADIAL", axis
    first = add_node(tree, GLOSSY, Anisotropy=0.5, Roughness=0.3)
    second = add_node(tree, GLOSSY, Anisotropy=0.2, Tangent=tangent.outputs[0])
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    finish(tree, mix)
    add_mesh("Plane").data.materials.append(material)
    scene, report = export()
    assert len(notes(report, "Different tangents")) == named
    assert len(scene.corner_tangents) == 2 and not scene.corner_tangents[..., 2].any()


# Where tangents come from.


@pytest.mark.parametrize("link", [None, "X", "Y", "Z", "geometry"])
def test_radial(export, link: str | None) -> None:
    """About an axis of the object through the middle of its box, wherever its origin is; with the
    inverse transpose, as normals."""
    if link is None:
        material = metal()
    elif link == "geometry":
        material = with_tangent("ShaderNodeNewGeometry")
    else:
        material = with_tangent(direction_type="RADIAL", axis=link)
    shift = np.array((5.0, 3.0, 1.0))
    cube = add_mesh("Cube", ([tuple(np.array(v) + shift) for v in CUBE[0]], CUBE[1]))
    cube.data.materials.append(material)
    cube.rotation_euler, cube.scale = (0.3, 0.5, 0.7), (1.0, 2.0, 0.5)
    bpy.context.view_layer.update()
    linear = np.array(cube.matrix_world)[:3, :3]
    scene = export()[0]
    local = (corners(scene) - np.array(cube.matrix_world)[:3, 3]) @ np.linalg.inv(linear).T - shift
    x, y, z = np.moveaxis(local, -1, 0)
    zero = np.zeros_like(x)
    around = {"X": (zero, -z, y), "Y": (-z, zero, x)}.get(link or "Z", (-y, x, zero))
    expected = np.stack(around, -1) @ np.linalg.inv(linear)
    found = scene.corner_tangents
    np.testing.assert_allclose(directions(found), directions(expected), atol=1e-5)
    lengths = np.linalg.norm(found, axis=-1) / np.linalg.norm(expected, axis=-1)
    np.testing.assert_allclose(lengths, lengths[0, 0], rtol=1e-5)  # what is between interpolates
    assert np.abs(found).max() == 1.0


def test_mirrored_objects_keep_tangents_at_their_corners(export) -> None:
    plane = add_mesh("Plane", scale=(-1.0, 1.0, 1.0), location=(3.0, 0.0, 0.0))
    plane.data.materials.append(metal())
    scene = export()[0]
    expected = (corners(scene) - (3.0, 0.0, 0.0))[..., [1, 0, 2]] * (-1, 1, 0)
    np.testing.assert_allclose(directions(scene.corner_tangents), directions(expected), atol=1e-6)


def test_instances_share_and_turn_them(export) -> None:
    first = add_mesh("First")
    first.data.materials.append(metal())
    second = bpy.data.objects.new("Second", first.data)
    second.rotation_euler = (0.0, math.pi / 2, 0.0)
    bpy.context.scene.collection.objects.link(second)
    scene = export()[0]
    of_first, of_second = (scene.corner_tangents[scene.surface == i] for i in (0, 1))
    turned = of_first[..., [2, 1, 0]] * (1, 1, -1)
    np.testing.assert_allclose(of_second, turned, atol=1e-6)


def test_only_where_they_are_needed(export) -> None:
    """Zero at triangles of other materials, and no array at all if there are no others."""
    plane = add_mesh("Plane", (QUAD[0], [(0, 1, 2), (0, 2, 3)]))
    for material in (metal(Anisotropic=0.0), metal()):
        plane.data.materials.append(material)
    add_mesh("Other", location=(0.0, 0.0, -1.0)).data.materials.append(metal(Anisotropic=0.0))
    assert export()[0].corner_tangents.shape == (0, 3, 3)
    plane.data.polygons[1].material_index = 1
    scene = export()[0]
    assert scene.corner_tangents.shape == (4, 3, 3)
    np.testing.assert_array_equal(
        scene.corner_tangents.any(axis=(1, 2)), [m.is_anisotropic for m in materials_of(scene)]
    )


def materials_of(scene: Scene) -> list[Any]:
    return [scene.materials[number] for number in scene.material]


def test_modifiers_do_not_move_generated_coordinates(export) -> None:
    plane = add_mesh("Plane")
    plane.data.materials.append(metal())
    modifier = plane.modifiers.new("Cast", "CAST")
    modifier.cast_type, modifier.factor, modifier.use_x = "CYLINDER", 0.5, False
    modifier.use_radius_as_size, modifier.size = False, 1.0
    scene = export()[0]
    assert np.ptp(np.abs(corners(scene)[..., :2])) > 0.05  # it does something
    np.testing.assert_allclose(np.abs(scene.corner_tangents[..., :2]), 1.0, atol=1e-6)


def test_edit_mode(export) -> None:
    plane = add_mesh("Plane")
    plane.data.materials.append(metal())
    scene = export()[0]
    bpy.context.view_layer.objects.active = plane
    bpy.ops.object.mode_set(mode="EDIT")
    np.testing.assert_array_equal(export()[0].corner_tangents, scene.corner_tangents)


# UV maps.


@pytest.mark.parametrize(("name", "way"), [("", (0, 1, 0)), ("A", (1, 0, 0)), ("B", (0, 1, 0))])
def test_uv_map(export, name: str, way: tuple[int, int, int]) -> None:
    """That of the name, or without one that which is active in renders."""
    plane = add_mesh("Plane", rotation_euler=(0.0, 0.0, 0.4))
    add_uv(plane.data, "A", lambda v: (v.x, v.y))
    add_uv(plane.data, "B", lambda v: (v.y, v.x)).active_render = True
    plane.data.materials.append(with_tangent(direction_type="UV_MAP", uv_map=name))
    scene, report = export()
    turned = np.array(plane.matrix_world)[:3, :3] @ way
    expected = np.broadcast_to(directions(turned), (2, 3, 3))
    np.testing.assert_allclose(directions(scene.corner_tangents), expected, atol=1e-6)
    assert not notes(report, "UV map")


def test_missing_uv_map_is_black(export) -> None:
    """Of the object that has none; another that wears the material has its own colour."""
    material = with_tangent(direction_type="UV_MAP", uv_map="A")
    for name in ("Has", "Lacks"):
        plane = add_mesh(name)
        plane.data.materials.append(material)
        if name == "Has":
            add_uv(plane.data, "A", lambda v: (v.x, v.y))
    scene, report = export()
    for worn, name in zip(
        materials_of(scene), np.array(scene.surfaces)[scene.surface], strict=True
    ):
        assert worn.head_on().any() == (name == "Has")
    assert notes(report, "UV map 'A'") == ["Object 'Lacks': there is none: black, as in Cycles"]
    assert scene.corner_tangents[scene.surface == scene.surfaces.index("Has")].any()


def test_without_any_uv_map_a_sphere_is_one(export) -> None:
    """U goes round about Z. Longitude begins and ends where X is 0."""
    made = bmesh.new()
    bmesh.ops.create_uvsphere(made, u_segments=64, v_segments=33, radius=1.0)
    for face in made.faces:
        face.smooth = True
    ball = add_mesh("Ball", ([], []))
    made.to_mesh(ball.data)
    ball.data.materials.append(with_tangent(direction_type="UV_MAP"))
    scene = export()[0]
    at = corners(scene)
    kept = (np.abs(at[..., 2]).max(1) < 0.8) & (np.abs(at[..., 0]).min(1) > 0.15)
    found, expected = scene.corner_tangents[kept], (at[..., [1, 0, 2]] * (-1, 1, 0))[kept]
    assert len(found) > 1000
    cosines = np.abs((directions(found) * directions(expected)).sum(-1))
    np.testing.assert_allclose(cosines, 1.0, atol=1e-6)


def test_quads_have_blenders_own_tangents() -> None:
    """MikkTSpace by Blender, of a plane of squares whose U runs along circles, and mirrored."""
    count = 8
    grid = [(x / count, y / count, 0.1 * x * y / count**2) for y in range(9) for x in range(9)]
    faces = [(i, i + 1, i + 10, i + 9) for y in range(count) for i in range(9 * y, 9 * y + count)]
    mesh = bpy.data.meshes.new("Grid")
    mesh.from_pydata(grid, [], [f[:3] for f in faces] + [(f[0], f[2], f[3]) for f in faces])
    mesh.shade_smooth()
    add_uv(mesh, "A", lambda v: (abs(v.x - 0.5) + 0.2 * v.y**2, v.y - 0.3 * v.x * v.y))
    mesh.calc_tangents(uvmap="A")
    mesh.calc_loop_triangles()
    loops = np.array([t.loops[:] for t in mesh.loop_triangles])
    tangents = np.array([loop.tangent[:] for loop in mesh.loops])[loops]
    normals = np.array([loop.normal[:] for loop in mesh.loops])[loops]
    points = np.array([mesh.vertices[loop.vertex_index].co[:] for loop in mesh.loops])[loops]
    uv = np.array([item.vector[:] for item in mesh.uv_layers["A"].uv])[loops]
    np.testing.assert_allclose(uv_tangents(points, normals, uv), tangents, atol=2e-4)


def test_where_a_uv_map_is_a_point_tangents_are_those_beside() -> None:
    """Or none, where there is nothing beside either; never NaN."""
    points = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (0, 1, 0), (-1, 0, 0)]])
    normals = np.broadcast_to((0.0, 0.0, 1.0), (2, 3, 3))
    uv = points[..., :2].astype(float)
    uv[1] = 0.0
    uv[1, 1] = uv[0, 2]  # shares two corners with the first, and U and V are along one line
    found = uv_tangents(points, normals, uv)
    np.testing.assert_allclose(found[0], np.tile((1, 0, 0), (3, 1)), atol=1e-6)
    np.testing.assert_allclose(found[1], [(1, 0, 0), (1, 0, 0), (0, 0, 0)], atol=1e-6)
    assert not uv_tangents(points, normals, np.zeros((2, 3, 2))).any()
