# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, instances, modifiers and normals arrive in world space."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export.geometry import Geometry
from addon.photon.scene import Scene

from .build import CUBE, QUAD, add_mesh, add_object, new_mesh, shader_material

pytestmark = pytest.mark.blender


def geometric_normals(scene: Scene) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(scene.vertices[scene.triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_no_mesh_is_an_empty_scene(export) -> None:
    assert len(export()[0].triangles) == 0


def test_million_metres_away_keeps_double_precision(export) -> None:
    add_mesh("Plane", location=(1e6, 0.0, 0.0), scale=(0.5, 0.5, 0.5))
    scene = export()[0]
    assert scene.vertices.dtype == np.float64
    np.testing.assert_array_equal(np.unique(scene.vertices[:, 0]), (999999.5, 1000000.5))


def test_linked_duplicates_share_one_export(export, monkeypatch) -> None:
    found: list[Geometry] = []
    original = Geometry.arrays
    monkeypatch.setattr(Geometry, "arrays", lambda self: found.append(self) or original(self))
    mesh = new_mesh("Shared")
    for index in range(3):
        add_object(f"Plane {index}", mesh, location=(0, 0, index))
    scene = export()[0]
    assert scene.surfaces == ("Plane 0", "Plane 1", "Plane 2")
    assert np.bincount(scene.surface).tolist() == [2, 2, 2]
    assert sorted(set(scene.vertices[:, 2])) == [0.0, 1.0, 2.0]
    assert len(found[0]._local) == 1


def test_collection_instances(scene, export) -> None:
    collection = bpy.data.collections.new("Parts")
    collection.objects.link(bpy.data.objects.new("Part", new_mesh("Part")))
    for index in range(2):
        add_object(
            f"Instance {index}",
            None,
            instance_type="COLLECTION",
            instance_collection=collection,
            location=(5 * index, 0, 0),
        )
    exported = export()[0]
    assert exported.surfaces == ("Part", "Part")
    assert exported.vertices[:, 0].min() == -1.0 and exported.vertices[:, 0].max() == 6.0


@pytest.mark.stability(24)
@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-1, -1, -1), (2, -0.5, 1)])
def test_mirroring_keeps_windings_with_normals(export, scale) -> None:
    add_mesh("Cube", CUBE, scale=scale, rotation_euler=(0.2, 0.4, 0.6))
    scene = export()[0]
    outward = scene.vertices[scene.triangles].mean(axis=1)
    normals = geometric_normals(scene)
    assert (np.einsum("ij,ij->i", normals, outward) > 0).all()
    np.testing.assert_allclose(
        scene.corner_normals, np.repeat(normals[:, None], 3, axis=1), atol=1e-6
    )


def test_smooth_and_flat_normals(export) -> None:
    obj = add_mesh("Cube", CUBE)
    flat = export()[0].corner_normals
    assert np.allclose(np.abs(flat).max(axis=-1), 1.0)
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    scene = export()[0]
    expected = scene.vertices[scene.triangles] / np.sqrt(3.0)
    np.testing.assert_allclose(scene.corner_normals, expected, atol=1e-4)


@pytest.mark.parametrize(("smooth", "domain"), [(0, "FACE"), (6, "POINT"), (3, "CORNER")])
def test_attributes_say_what_loop_triangles_say(export, smooth, domain) -> None:
    """Vertices, normals and material of each triangle, as Blender names them one by one."""
    mesh = add_mesh("Cube", CUBE).data
    for name in "ABC":
        mesh.materials.append(shader_material("ShaderNodeBsdfDiffuse", name))
    mesh.polygons.foreach_set("use_smooth", [index < smooth for index in range(6)])
    mesh.polygons.foreach_set("material_index", [0, 1, 2, 2, 1, 0])
    scene = export()[0]
    assert mesh.normals_domain == domain
    mesh.calc_loop_triangles()
    assert [list(t) for t in scene.triangles] == [list(t.vertices) for t in mesh.loop_triangles]
    assert list(scene.material) == [t.material_index for t in mesh.loop_triangles]
    normals = [[mesh.corner_normals[i].vector for i in t.loops] for t in mesh.loop_triangles]
    np.testing.assert_allclose(scene.corner_normals, normals, atol=1e-6)


def test_flattened_object_has_finite_normals(export) -> None:
    add_mesh("Plane", scale=(1, 1, 0))
    normals = export()[0].corner_normals
    np.testing.assert_allclose(normals, np.broadcast_to((0, 0, 1), normals.shape))


def test_modifiers_are_applied(export) -> None:
    obj = add_mesh("Plane")
    array = obj.modifiers.new("Array", "ARRAY")
    array.count = 3
    assert len(export()[0].triangles) == 6
    array.show_render = False
    assert len(export()[0].triangles) == 2


def test_hidden_objects_stay_out(scene, export) -> None:
    add_mesh("Hidden", hide_render=True)
    add_mesh("Only hidden in the viewport", hide_viewport=True)
    collection = bpy.data.collections.new("Hidden too")
    collection.hide_render = True
    scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Inside", new_mesh("Inside")))
    add_mesh("Visible")
    assert "Visible" in export()[0].surfaces
    assert not {"Hidden", "Inside"} & set(export()[0].surfaces)


def test_viewport_depsgraph_leaves_hidden_objects_out(scene) -> None:
    from addon.blender.export import snapshot

    add_mesh("Hidden", hide_render=True)
    add_mesh("Visible")
    assert snapshot(bpy.context.evaluated_depsgraph_get())[0].surfaces == ("Visible",)


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "META"])
def test_other_surfaces_become_triangles(export, kind) -> None:
    if kind == "META":
        data = bpy.data.metaballs.new("Data")
        data.elements.new()
    else:
        data = bpy.data.curves.new("Data", kind)
        if kind == "FONT":
            data.body = "A"
        else:
            data.dimensions, data.bevel_depth = "3D", 0.1
            data.splines.new("POLY").points.add(2)
            for index, point in enumerate(data.splines[0].points):
                point.co = (index, index * index, 0, 1)
    add_object("Thing", data)
    scene = export()[0]
    assert scene.surfaces == ("Thing",) and len(scene.triangles) > 4
    np.testing.assert_allclose(np.linalg.norm(scene.corner_normals, axis=-1), 1.0, atol=1e-5)


def test_material_slots(export) -> None:
    obj = add_mesh("Cube", CUBE)
    for name in ("A", "B"):
        obj.data.materials.append(shader_material("ShaderNodeBsdfDiffuse", name))
    # What an object's own slot holds goes before the mesh's.
    obj.material_slots[1].link = "OBJECT"
    obj.material_slots[1].material = shader_material("ShaderNodeBsdfDiffuse", "C")
    obj.data.polygons.foreach_set("material_index", [0, 1, 1, 1, 1, 9])
    scene = export()[0]
    names = [scene.materials[index].name for index in scene.material]
    assert names == ["A"] * 2 + ["C"] * 10


def test_material_override(scene, export) -> None:
    add_mesh("Plane")
    scene.view_layers[0].material_override = shader_material("ShaderNodeBsdfDiffuse", "Clay")
    assert [material.name for material in export()[0].materials] == ["Clay"]


def test_nan_vertices_pass_through(export) -> None:
    add_mesh("Plane", ([(float("nan"), 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)]))
    assert np.isnan(export()[0].vertices).any()


@pytest.mark.parametrize(
    ("flag", "value", "feature"),
    [
        ("is_holdout", True, "Holdout"),
        ("is_shadow_catcher", True, "Shadow Catcher"),
        ("visible_camera", False, "Ray Visibility"),
    ],
)
def test_unknown_object_features_are_reported(export, flag, value, feature) -> None:
    setattr(add_mesh("Plane", QUAD), flag, value)
    scene, report = export()
    assert scene.surfaces == ("Plane",)
    assert ("Object 'Plane'", feature) in [(e.object, e.feature) for e in report.of("ignored")]


def test_hair_is_reported(export) -> None:
    obj = add_mesh("Head")
    obj.modifiers.new("Fur", "PARTICLE_SYSTEM")
    obj.particle_systems[0].settings.type = "HAIR"
    entries = export()[1].of("ignored")
    assert [entry.feature for entry in entries] == ["Particle Hair"]
