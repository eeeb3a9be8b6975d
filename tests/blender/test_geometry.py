# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, instances, modifiers and normals arrive in world space."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender.export import geometry
from addon.blender.export.geometry import Geometry
from addon.photon.errors import SceneError
from addon.photon.scene import Scene

from .build import CUBE, QUAD, add_mesh, add_object, new_mesh, shader_material

pytestmark = pytest.mark.blender

SEEN = 8.0  # [m] of the world in a picture from above


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


@pytest.mark.stability(73)
def test_linked_duplicates_share_one_export(export, monkeypatch) -> None:
    found: list[Geometry] = []
    original = Geometry.arrays
    monkeypatch.setattr(
        Geometry, "arrays", lambda self, *given: found.append(self) or original(self, *given)
    )
    mesh = new_mesh("Shared")
    for index in range(3):
        add_object(f"Plane {index}", mesh, location=(0, 0, index))
    scene = export()[0]
    assert scene.surfaces == ("Plane 0", "Plane 1", "Plane 2")
    assert np.bincount(scene.surface).tolist() == [2, 2, 2]
    assert sorted(set(scene.vertices[:, 2])) == [0.0, 1.0, 2.0]
    assert len(found[0]._local) == 1


@pytest.mark.stability(73)
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
    mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data[0].value = domain == "CORNER"
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


@pytest.mark.parametrize("sharp", [False, True])
def test_smooth_faces_beside_flat_ones(export, sharp) -> None:
    """Unless an edge is sharp, those smooth have their vertices' normals in Cycles before Blender
    5.2; since then, and beside a sharp edge, their corners' own."""
    mesh = add_mesh("Cube", CUBE).data
    mesh.polygons.foreach_set("use_smooth", [index < 3 for index in range(6)])
    mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data[11].value = sharp
    by_corner = sharp or bpy.app.version >= (5, 2)
    scene = export()[0]
    normals = mesh.corner_normals if by_corner else mesh.vertex_normals
    mesh.calc_loop_triangles()
    smooth = [t for t in mesh.loop_triangles if mesh.polygons[t.polygon_index].use_smooth]
    expected = [[normals[i].vector for i in (t.loops if by_corner else t.vertices)] for t in smooth]
    np.testing.assert_allclose(scene.corner_normals[: len(smooth)], expected, atol=1e-6)


@pytest.mark.parametrize("smooth", [0, 1])
def test_flat_faces_that_are_not_plane_have_their_triangles_normals(export, smooth) -> None:
    """As in Cycles: each of the two triangles of a quad is flat."""
    points = [(x, y, z) for y in (-1, 1) for x, z in ((-1, 0), (0, 0), (1, y))]
    mesh = add_mesh("Bent", (points, [(0, 1, 4, 3), (1, 2, 5, 4)])).data
    mesh.polygons.foreach_set("use_smooth", [index < smooth for index in range(2)])
    scene = export()[0]
    a, b, c = np.moveaxis(scene.vertices[scene.triangles], 1, 0)
    own = np.cross(b - a, c - a)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    np.testing.assert_allclose(scene.corner_normals[2:], np.repeat(own[2:, None], 3, 1), atol=1e-6)
    assert abs(own[2] @ own[3]) < 0.99


@pytest.mark.parametrize("given", [False, True])
def test_flat_faces_beside_sharp_edges_or_with_normals_of_their_own(export, given) -> None:
    """Their corners' in Cycles: of a face that is not plane the whole face's, or those given."""
    points = [(x, y, z) for y in (-1, 1) for x, z in ((-1, 0), (0, 0), (1, y))]
    mesh = add_mesh("Bent", (points, [(0, 1, 4, 3), (1, 2, 5, 4)])).data
    mesh.polygons.foreach_set("use_smooth", [not given, False])
    if given:
        mesh.normals_split_custom_set([(0.6, 0.0, 0.8)] * 8)
    else:
        mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data[0].value = True
    scene = export()[0]
    assert mesh.normals_domain == "CORNER"
    mesh.calc_loop_triangles()
    expected = [[mesh.corner_normals[i].vector for i in t.loops] for t in mesh.loop_triangles]
    np.testing.assert_allclose(scene.corner_normals, expected, atol=1e-6)
    if given:
        np.testing.assert_allclose(scene.corner_normals[0, 0], (0.6, 0.0, 0.8), atol=1e-3)


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


def saved_in_edit_mode(active: bpy.types.Object, folder: Path) -> None:
    """Save a file as it is while its user edits a mesh; open it, as the user or a farm does."""
    name = active.name
    bpy.context.view_layer.objects.active = active
    active.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "edited.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "edited.blend"))
    assert bpy.data.objects[name].mode == "EDIT"


def area_from_above(scene: Scene) -> float:
    a, b, c = np.moveaxis(scene.vertices[scene.triangles], 1, 0)
    return float(0.5 * np.abs(np.cross(b - a, c - a)[:, 2]).sum())


def area_in(picture: NDArray[np.float32]) -> float:
    """What of SEEN x SEEN metres is covered."""
    return float(picture[..., 3].mean() * SEEN**2)


def add_row(obj: bpy.types.Object, **properties: Any) -> None:
    """Add a second copy, two metres up the y axis, by a modifier."""
    row = obj.modifiers.new("Row", "ARRAY")
    row.use_relative_offset, row.use_constant_offset = False, True
    row.constant_offset_displace = (0.0, 2.0, 0.0)
    for key, value in properties.items():
        setattr(row, key, value)


def edited(case: str) -> bpy.types.Object:
    """A plane as Cycles may find it in Edit Mode; of its copies none covers another."""
    obj = add_mesh("Plane", location=(0.0, -2.0, 0.0))
    match case:
        case "modifier":
            add_row(obj)
        case "modifier off in Edit Mode":
            add_row(obj, show_in_editmode=False)
        case "modifier of another object":
            add_row(add_object("Other", obj.data))
        case "another object":
            add_row(obj)
            add_object("Other", obj.data, location=(0.0, 2.0, 0.0))
        case "instance":
            parts = bpy.data.collections.new("Parts")
            parts.objects.link(obj)
            add_object("Two", None, instance_type="COLLECTION", instance_collection=parts)
            bpy.data.objects["Two"].location = (0.0, 2.0, 0.0)
        case "shape key":
            obj.shape_key_add(name="Basis")
            wide = obj.shape_key_add(name="Wide")
            wide.value = 1.0
            for point in wide.data:
                point.co.x *= 2.0
            obj.active_shape_key_index = 0
        case "instances of nodes":
            tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
            for way in ("INPUT", "OUTPUT"):
                tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
            kinds = ("NodeGroupInput", "GeometryNodeGeometryToInstance", "NodeGroupOutput")
            start, instance, end = (tree.nodes.new(kind) for kind in kinds)
            tree.links.new(start.outputs[0], instance.inputs[0])
            tree.links.new(instance.outputs[0], end.inputs[0])
            obj.modifiers.new("Nodes", "NODES").node_group = tree
    return obj


@pytest.mark.stability(73)
@pytest.mark.parametrize(
    ("case", "quads"),
    [
        ("plain", 1),
        ("modifier", 2),
        ("modifier off in Edit Mode", 1),
        ("modifier of another object", 3),
        ("another object", 3),
        ("instance", 2),
        ("shape key", 1),
        ("instances of nodes", 1),
    ],
)
def test_saved_in_edit_mode_shows_what_cycles_shows(
    scene, export, cycles, tmp_path, case, quads
) -> None:
    """Without a modifier nothing at all was exported, with one there was a KeyError."""
    scene.render.resolution_y = 64
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", SEEN
    saved_in_edit_mode(edited(case), tmp_path)
    exported = export()[0]
    assert len(exported.triangles) == 2 * quads
    assert area_from_above(exported) == pytest.approx(area_in(cycles()), abs=1e-4)
    np.testing.assert_allclose(exported.corner_normals[..., 2], 1.0, atol=1e-6)


@pytest.mark.stability(73)
def test_edited_since_the_file_was_opened(scene, export, cycles, tmp_path) -> None:
    """What the mesh itself has not been told of yet."""
    scene.render.resolution_y = 64
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", SEEN
    saved_in_edit_mode(edited("modifier"), tmp_path)
    mesh = bpy.data.objects["Plane"].data
    edit = bmesh.from_edit_mesh(mesh)
    for vertex in edit.verts:
        vertex.co.x *= 2.0
    bmesh.update_edit_mesh(mesh)
    assert max(abs(vertex.co.x) for vertex in mesh.vertices) == 1.0
    assert area_from_above(export()[0]) == pytest.approx(16.0)
    assert area_in(cycles()) == pytest.approx(16.0)


def test_edit_mode_keeps_materials_and_normals(export, tmp_path) -> None:
    obj = add_mesh("Cube", CUBE)
    for name in "AB":
        obj.data.materials.append(shader_material("ShaderNodeBsdfDiffuse", name))
    obj.data.polygons.foreach_set("material_index", [0, 1, 1, 1, 1, 0])
    obj.data.polygons.foreach_set("use_smooth", [0, 0, 0, 1, 1, 1])
    add_row(obj)
    before = export()[0]
    saved_in_edit_mode(obj, tmp_path)
    after = export()[0]
    assert [after.materials[i].name for i in after.material] == list("AABBBBBBBBAA" * 2)
    for name in ("vertices", "triangles", "corner_normals", "material"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-6)


@pytest.mark.stability(73)
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


def test_unknown_object_features_are_reported(export) -> None:
    plane = add_mesh("Plane", QUAD)
    plane.light_linking.blocker_collection = bpy.data.collections.new("Shadowed by some")
    scene, report = export()
    assert scene.surfaces == ("Plane",)
    assert ("Object 'Plane'", "Shadow Linking") in [
        (e.object, e.feature) for e in report.of("ignored")
    ]


def test_hair_is_reported(export) -> None:
    obj = add_mesh("Head")
    obj.modifiers.new("Fur", "PARTICLE_SYSTEM")
    obj.particle_systems[0].settings.type = "HAIR"
    entries = export()[1].of("approximated")
    assert [entry.feature for entry in entries] == ["Particle Hair"]


def test_more_triangles_than_can_be_rendered(export, monkeypatch) -> None:
    """End the export before they are copied, and name whose they mostly are."""
    monkeypatch.setattr(geometry, "MOST_TRIANGLES", 30)
    for number in range(4):
        add_mesh("Crumb", CUBE, location=(number, 0, 0))
    add_mesh("Plate")
    with pytest.raises(SceneError, match=r"Object 'Crumb.*12 triangles or more.*more than 30"):
        export()
