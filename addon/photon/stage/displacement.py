# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that nodes of their materials move, moved before anything else is made of a scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Defines, Stream, StreamError
from ..backends.backend import Backend
from ..errors import DeviceError
from ..kernels.displacement import Displace
from ..scene import Displacement, Material, Moving, Result, Scene
from .device_scene import DeviceScene
from .geometry import Mesh, frame_of
from .programs import ProgramNeeds
from .textures import Texels

ASKED = "diffuse"  # what a material's program gives, by the kernel
WEIGHTS = np.array(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))  # u and v of the corners of a triangle
SAME = 1e-4  # between normals of smooth corners about a vertex that has one alone


def displaced(scene: Scene, backend: Backend) -> Scene:
    """The scene where materials have moved its vertices, as Cycles does: each by what the first
    triangle about it says, and smooth normals along with them. DeviceError when OpenGL fails."""
    moves = [material.displacement for material in scene.materials]
    which = np.flatnonzero(_wear(scene, [move is not None for move in moves]))
    materials = tuple(replace(material, displacement=None) for material in scene.materials)
    if not len(which):
        return replace(scene, materials=materials) if any(moves) else scene
    try:
        vertices = scene.vertices + _ways(scene, moves, which, backend)
    except StreamError as error:
        backend.device.trim()
        raise DeviceError(str(error)) from error
    turned = _wear(scene, [move is not None and move.turns_normals for move in moves])
    smooth = np.flatnonzero(_wear(scene, [move is not None and move.smooths for move in moves]))
    normals = scene.corner_normals.copy()
    normals[smooth] = _smoothed(scene, smooth)
    normals = _turned(scene, scene.vertices, vertices, normals, turned)
    moving = tuple(_with_normals(one, scene, vertices, turned) for one in scene.moving)
    return replace(
        scene, materials=materials, vertices=vertices, corner_normals=normals, moving=moving
    )


def _wear(scene: Scene, of_material: list[bool]) -> NDArray[np.bool_]:
    """(T,) which triangles wear materials of a kind."""
    found: NDArray[np.bool_] = np.array(of_material, bool)[scene.material]
    return found


def _ways(
    scene: Scene, moves: list[Displacement | None], which: NDArray[np.intp], backend: Backend
) -> NDArray[np.float64]:
    """(V, 3) by which vertices move [m]: those of some triangles that have an area."""
    asked = _asked_scene(scene, which)
    frame = frame_of(asked)
    mesh = Mesh.build(asked, frame)
    place = np.full(len(which), -1)
    place[mesh.tree.order] = np.arange(len(mesh.tree.order))
    numbers = np.flatnonzero(place >= 0)
    vertex, first = np.unique(asked.triangles[numbers].reshape(-1), return_index=True)
    triangle, corner = numbers[first // 3], first % 3
    own = asked.material[triangle]
    ways, by_program = np.zeros((len(vertex), 3)), np.zeros(len(vertex), bool)
    for number, move in enumerate(moves):
        if move and isinstance(move.way, Result):
            by_program |= own == number
        elif move:
            ways[own == number] = move.way
    if by_program.any():
        texels = Texels.of(backend.device, asked, None)
        tables = None
        try:
            made = DeviceScene.build(asked, backend, frame, mesh, texels)
            tables = made.tables
            ways[by_program] = _by_programs(made, place[triangle[by_program]], corner[by_program])
        finally:
            for own_textures in (tables, texels):
                if own_textures:
                    own_textures.release()
    found = np.zeros_like(scene.vertices)
    found[vertex] = np.where(np.isfinite(ways).all(axis=1, keepdims=True), ways, 0.0)
    return found


def _asked_scene(scene: Scene, which: NDArray[np.intp]) -> Scene:
    """Some triangles of a scene, of whose materials there is the displacement alone."""
    attributes = scene.corner_attributes
    return replace(
        scene,
        lights=(),
        images=(),
        materials=tuple(map(_asked, scene.materials)),
        triangles=scene.triangles[which],
        corner_normals=_smoothed(scene, which),  # vertices move one way for all about them
        corner_tangents=scene.corner_tangents[:0],
        material=scene.material[which],
        surface=scene.surface[which],
        corner_attributes=attributes[which] if len(attributes) else attributes,
        flat=scene.flat[:0],
        moving=(),
        shutter=(),
    )


def _smoothed(scene: Scene, which: NDArray[np.intp]) -> NDArray[np.float32]:
    """Corner normals of some triangles, of flat ones their vertices'."""
    normals = scene.corner_normals[which]
    if len(scene.flat) and scene.flat[which].any():
        by_angle = _vertex_normals(scene, scene.vertices, which, _angles)
        flat = scene.flat[which][:, None, None]
        normals = np.where(flat, by_angle, normals).astype(np.float32)
    return normals


def _asked(material: Material) -> Material:
    """A material whose program is that of its displacement."""
    move = material.displacement
    if not move or not isinstance(move.way, Result):
        return Material(material.name)
    return Material(material.name, program=move.program, varying={ASKED: move.way})


def _by_programs(
    made: DeviceScene, places: NDArray[np.intp], corners: NDArray[np.intp]
) -> NDArray[np.float64]:
    """(n, 3): how far corners of triangles at such places of the mesh move [m]."""
    backend, scene = made.backend, made.scene
    needs = ProgramNeeds.of(scene)
    kernel = Displace(backend.device, backend.layer, defines_of(needs), made=needs.made)
    tables = {name: made.tables.textures[name] for name in kernel.tables}
    found = np.zeros((len(places), 3))
    try:
        for first in range(0, len(places), TABLE_WIDTH):
            some = slice(first, first + TABLE_WIDTH)
            found[some] = _run(kernel, made, places[some], corners[some], tables)
    finally:
        kernel.release()
    return found


def defines_of(needs: ProgramNeeds) -> Defines:
    """What Displace is compiled with. Nothing is asked beside a point: a bump there changes no
    normal, as in Cycles."""
    return {name: value for name, value in needs.defines.items() if name != "BUMPS"}


def _run(
    kernel: Displace,
    made: DeviceScene,
    places: NDArray[np.intp],
    corners: NDArray[np.intp],
    tables: dict[str, Any],
) -> NDArray[np.float64]:
    """(n, 3), looked at from outside."""
    count, ports = len(places), {**kernel.inputs, **kernel.outputs}
    streams = {name: Stream(kernel.device, record, (count, 1)) for name, record in ports.items()}
    hits, rays = np.zeros((2, count, 4), np.float32)
    hits[:, 0], hits[:, 1], hits[:, 2:] = 1.0, places + 1, WEIGHTS[corners]
    a, b, c = (made.mesh.triangles[places][name].astype(np.float64) for name in "abc")
    rays[:, :3] = -_unit(np.cross(b - a, c - a))
    try:
        streams["hit"].upload(hits[None])
        streams["direction"].upload(rays[None])
        kernel.run(streams, tables)
        found: NDArray[np.float64] = streams["way"].download()[0, :, :3].astype(np.float64)
    finally:
        for stream in streams.values():
            stream.release()
    return found


def _turned(
    scene: Scene,
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    normals: NDArray[np.float32],
    turned: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """Corner normals (T, 3, 3) where vertices have moved, of the triangles that are turned (T,).

    As Cycles has it: of smooth ones those of their vertices, to which each triangle counts alike;
    where these have several, each by as much as that one changes.
    """
    if not turned.any():
        return normals
    triangles, old = scene.triangles[turned], normals[turned].astype(np.float64)
    found = _vertex_normals(scene, after, turned)
    mean = _mean_about(triangles, old, len(after))[triangles]
    has_one = _mean_about(triangles, (old * mean).sum(axis=2, keepdims=True), len(after))
    several = has_one[triangles][..., 0] <= 1.0 - SAME
    if several.any():
        change = found - _vertex_normals(scene, before, turned)
        found[several] = _unit(old + change)[several]
    if len(scene.flat):
        faces = _unit(np.cross(*_sides(after, triangles)))[:, None]
        found = np.where(scene.flat[turned][:, None, None], faces, found)
    made = normals.copy()
    made[turned] = found
    return made


def _with_normals(
    moving: Moving, scene: Scene, vertices: NDArray[np.float64], turned: NDArray[np.bool_]
) -> Moving:
    """What bends, with the normals of the surface where it is at each step."""
    first, last = moving.vertices
    own = (scene.triangles[:, 0] >= first) & (scene.triangles[:, 0] < last)
    if not moving.bends or not moving.normals.shape[1] or not (own & turned).any():
        return moving
    steps = []
    for offsets, normals in zip(moving.offsets, moving.normals, strict=True):
        before, after = scene.vertices.copy(), vertices.copy()
        before[first:last] += offsets
        after[first:last] += offsets
        corners = scene.corner_normals.copy()
        corners[own] = normals[moving.corners]
        steps.append(_turned(scene, before, after, corners, own & turned)[own].reshape(-1, 3))
    order = np.arange(3 * own.sum(), dtype=np.int32).reshape(-1, 3)
    return replace(moving, normals=np.array(steps, np.float32), corners=order)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)


def _spaces(scene: Scene) -> NDArray[np.float64]:
    """(S, 3, 3) from world space to that of each surface's object."""
    if not len(scene.objects):
        return np.tile(np.eye(3), (len(scene.surfaces), 1, 1))
    return scene.objects[:, :3, :3]


def _sides(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return b - a, c - a


def _vertex_normals(
    scene: Scene,
    vertices: NDArray[np.float64],
    which: NDArray[Any],
    weights: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
) -> NDArray[np.float64]:
    """(t, 3, 3) unit: at corners of some triangles those of vertices, to which triangles about them
    count alike in the spaces of their objects, or by weights (t, 3) of their corners there
    (t, 3, 3)."""
    triangles, surface = scene.triangles[which], np.zeros(len(vertices), np.intp)
    surface[triangles] = scene.surface[which, None]
    spaces = _spaces(scene)
    hands = np.where(np.linalg.det(spaces) < 0.0, -1.0, 1.0)
    corners = np.einsum("nij,nj->ni", spaces[surface], vertices)[triangles]
    faces = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[:, None]
    counted = faces * (weights(corners)[..., None] if weights else np.ones((3, 1)))
    sums = hands[surface, None] * _sums_about(triangles, counted, len(vertices))
    found: NDArray[np.float64] = _unit(np.einsum("nij,ni->nj", spaces[surface], sums))[triangles]
    return found


def _angles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3) of triangles (T, 3, 3)."""
    to_next = _unit(np.roll(corners, -1, axis=1) - corners)
    cosines = -(to_next * np.roll(to_next, 1, axis=1)).sum(axis=2)
    found: NDArray[np.float64] = np.arccos(np.clip(cosines, -1.0, 1.0))
    return found


def _mean_about(
    triangles: NDArray[np.int32], values: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """(V, n) of what corners (T, 3, n) have."""
    number = np.bincount(triangles.reshape(-1), minlength=count)[:, None]
    found: NDArray[np.float64] = _sums_about(triangles, values, count) / np.maximum(number, 1)
    return found


def _sums_about(
    triangles: NDArray[np.int32], values: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    corners = triangles.reshape(-1)
    rows = values.reshape(len(corners), -1).T
    return np.stack([np.bincount(corners, row, count) for row in rows], axis=1)
