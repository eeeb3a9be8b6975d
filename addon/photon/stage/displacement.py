# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that nodes of their materials move, moved before anything else is made of a scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Defines, StreamError
from ..backends.backend import Backend
from ..errors import DeviceError
from ..kernels.displacement import Displace
from ..scene import NO_MEDIUM, Displacement, Material, Moving, Result, Scene
from .device_scene import DeviceScene
from .geometry import Frame, Mesh, frame_of
from .normals import face_normals, longest_one, mean_about, sums_about, unit
from .points import asked_at
from .programs import ProgramNeeds
from .textures import Texels

ASKED = "diffuse"  # what a material's program gives, by the kernel
WEIGHTS = np.array(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))  # u and v of the corners of a triangle
FLATTENED = 1e-12  # of its longest side cubed: what has less volume has no inverse
SHORTEST = 1e-12  # that a unit normal becomes in the space of an object
# Between normals of smooth corners about a vertex that has one alone: they are float32, turned.
SAME = 1e-4


class _Kinds(NamedTuple):
    """(T,) of triangles: which are moved by what they wear, of these which normals turn with them,
    and which flat ones become smooth where they were."""

    moved: NDArray[np.bool_]
    turned: NDArray[np.bool_]
    smooth: NDArray[np.bool_]

    def at(self, some: NDArray[np.bool_]) -> _Kinds:
        """Of some triangles."""
        return _Kinds(*(kind[some] for kind in self))


def displaced(scene: Scene, backend: Backend, texels: Texels | None) -> Scene:
    """The scene where materials have moved its vertices, as Cycles does (mesh_displace.cpp): each
    by what the first triangle about it says, and smooth normals along with them.

    `texels`: the scene's textures. DeviceError when OpenGL fails.
    """
    moves = [material.displacement for material in scene.materials]
    which = np.flatnonzero(_wear(scene, [move is not None for move in moves]))
    materials = tuple(replace(material, displacement=None) for material in scene.materials)
    if not len(which):
        return replace(scene, materials=materials) if any(moves) else scene
    flat = scene.flat if len(scene.flat) else np.zeros(len(scene.triangles), bool)
    whole = replace(scene, flat=flat | ~scene.corner_normals.any(axis=(1, 2)))
    try:
        vertices = scene.vertices + _ways(whole, moves, which, backend, texels)
    except StreamError as error:
        backend.device.trim()
        raise DeviceError(str(error)) from error
    kinds = _Kinds(
        _wear(scene, [move is not None for move in moves]),
        _wear(scene, [move is not None and move.turns_normals for move in moves]),
        _wear(scene, [move is not None and move.smooths for move in moves]) & whole.flat,
    )
    normals = _normals(whole, scene.vertices, vertices, kinds)
    moving = tuple(_with_normals(one, whole, vertices, kinds) for one in scene.moving)
    return replace(
        scene, materials=materials, vertices=vertices, corner_normals=normals, moving=moving
    )


def _wear(scene: Scene, of_material: list[bool]) -> NDArray[np.bool_]:
    """(T,) which triangles wear materials of a kind."""
    found: NDArray[np.bool_] = np.array(of_material, bool)[scene.material]
    return found


def _ways(
    scene: Scene,
    moves: list[Displacement | None],
    which: NDArray[np.intp],
    backend: Backend,
    texels: Texels | None,
) -> NDArray[np.float64]:
    """(V, 3) by which vertices move [m]: those of some triangles that have an area."""
    asked = _asked_scene(scene, which)
    frame = frame_of(asked)
    mesh = Mesh.build(asked, frame)
    place = mesh.places_of(np.arange(len(which)))
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
        with asking(asked, backend, frame, mesh, texels) as (kernel, tables):
            where = place[triangle[by_program]], corner[by_program]
            ways[by_program] = _by_programs(kernel, tables, mesh, *where)
    found = np.zeros_like(scene.vertices)
    found[vertex] = np.where(np.isfinite(ways).all(axis=1, keepdims=True), ways, 0.0)
    return found


def _asked_scene(scene: Scene, which: NDArray[np.intp]) -> Scene:
    """Some triangles of a scene, of whose materials there is the displacement alone."""
    attributes = scene.corner_attributes
    return replace(
        bare(scene),
        materials=tuple(map(_asked, scene.materials)),
        triangles=scene.triangles[which],
        # Of flat triangles their vertices', which move one way for all about them.
        corner_normals=_smoothed(
            scene, scene.vertices, np.isin(np.arange(len(scene.flat)), which) & scene.flat
        )[which],
        material=scene.material[which],
        surface=scene.surface[which],
        corner_attributes=attributes[which] if len(attributes) else attributes,
    )


def bare(scene: Scene) -> Scene:
    """A scene without what programs do not ask for: with triangles, whatever they are."""
    return replace(
        scene,
        lights=(),
        images=(),
        corner_tangents=scene.corner_tangents[:0],
        flat=scene.flat[:0],
        moving=(),
        shutter=(),
        air=NO_MEDIUM,
    )


def _asked(material: Material) -> Material:
    """A material whose program is that of its displacement."""
    move = material.displacement
    if not move or not isinstance(move.way, Result):
        return Material(material.name)
    return Material(material.name, program=move.program, varying={ASKED: move.way})


@contextmanager
def asking(
    scene: Scene, backend: Backend, frame: Frame, mesh: Mesh, texels: Texels | None
) -> Iterator[tuple[Displace, dict[str, Any]]]:
    """What asks the materials of a scene for ASKED at points of its mesh, and the tables that it
    reads."""
    made = DeviceScene.build(scene, backend, frame, mesh, texels)
    kernel: Displace | None = None
    try:
        needs = ProgramNeeds.of(scene)
        kernel = Displace(backend.device, backend.layer, defines_of(needs), made=needs.made)
        yield kernel, {name: made.tables.textures[name] for name in kernel.tables}
    finally:
        if kernel:
            kernel.release()
        made.tables.release()


def _by_programs(
    kernel: Displace,
    tables: dict[str, Any],
    mesh: Mesh,
    places: NDArray[np.intp],
    corners: NDArray[np.intp],
) -> NDArray[np.float64]:
    """(n, 3): how far corners of triangles at such places of the mesh move [m]."""
    found = np.zeros((len(places), 3))
    for first in range(0, len(places), TABLE_WIDTH):
        some = slice(first, first + TABLE_WIDTH)
        looked_at = _looked_at(mesh, places[some], corners[some])
        found[some] = asked_at(
            kernel, places[some], WEIGHTS[corners[some]], -looked_at[None], tables
        )[0]
    return found


def defines_of(needs: ProgramNeeds) -> Defines:
    """What Displace is compiled with. Nothing is asked beside a point: a bump there changes no
    normal, as in Cycles."""
    return {name: value for name, value in needs.defines.items() if name != "BUMPS"}


def _looked_at(
    mesh: Mesh, places: NDArray[np.intp], corners: NDArray[np.intp]
) -> NDArray[np.float64]:
    """(n, 3) unit, to who looks at corners: along their normals, as in Cycles, unless these are
    behind."""
    faces = face_normals(mesh.corners[places, :, :3].astype(np.float64))
    of_corners = np.stack([mesh.normals[places][name] for name in "abc"], axis=1)
    normals = unit(of_corners[np.arange(len(places)), corners].astype(np.float64))
    is_before = (normals * faces).sum(axis=1, keepdims=True) > 1e-3
    return np.where(is_before, normals, faces)


def _smoothed(
    scene: Scene, vertices: NDArray[np.float64], which: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """New corner normals (T, 3, 3), of some triangles their vertices', to which all count."""
    normals = scene.corner_normals.copy()
    if which.any():
        is_there = np.zeros(len(vertices), bool)
        is_there[scene.triangles[which]] = True
        about = is_there[scene.triangles].any(axis=1)
        found = _vertex_normals(scene, vertices, about, _angles)[scene.triangles[which]]
        normals[which] = longest_one(found / _lengths_in_objects(scene, which, found))
    return normals


def _normals(
    scene: Scene,
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    kinds: _Kinds,
) -> NDArray[np.float32]:
    """Corner normals (T, 3, 3) where vertices have moved.

    As Cycles has it: of smooth ones those of their vertices, to which all that are turned count
    alike; where these have several, each by as much as that one changes.
    """
    normals = _smoothed(scene, before, kinds.smooth)
    turned = kinds.turned
    has_moved = (before != after).any(axis=1)[scene.triangles].any(axis=1)
    bent = scene.flat & has_moved & (turned | ~kinds.moved)  # also if others move their vertices
    normals[bent] = face_normals(after[scene.triangles[bent]])[:, None]
    is_about = np.zeros(len(after), bool)  # vertices whose normals change
    is_about[scene.triangles[turned]] = True
    some = ~scene.flat & is_about[scene.triangles].any(axis=1)
    if not some.any():
        return normals
    triangles, old = scene.triangles[some], unit(normals[some].astype(np.float64))
    of_vertices = _vertex_normals(scene, after, turned)
    found = of_vertices[triangles]
    mean = mean_about(triangles, old, len(after))[triangles]
    has_one = mean_about(triangles, (old * mean).sum(axis=2, keepdims=True), len(after))
    several = has_one[triangles][..., 0] <= 1.0 - SAME
    if several.any():
        change = of_vertices - _vertex_normals(scene, before, turned)
        found[several] = unit(old + change[triangles])[several]
    found = np.where(is_about[triangles][..., None], found, old)
    normals[some] = longest_one(found / _lengths_in_objects(scene, some, found))
    return normals


def _lengths_in_objects(
    scene: Scene, which: NDArray[np.bool_], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(t, 3, 1) of unit normals (t, 3, 3) of some triangles in the spaces of their objects; > 0."""
    to_world = np.linalg.inv(_spaces(scene))[scene.surface[which]]
    there = np.einsum("tij,tki->tkj", to_world, normals)
    found: NDArray[np.float64] = np.linalg.norm(there, axis=2, keepdims=True)
    return np.maximum(found, SHORTEST)


def _with_normals(
    moving: Moving,
    scene: Scene,
    vertices: NDArray[np.float64],
    kinds: _Kinds,
) -> Moving:
    """What bends, with the normals of the surface where it is at each step."""
    (first, last), own = moving.vertices, moving.owns(scene.triangles)
    is_flat = not moving.normals.shape[1]
    changed = kinds.smooth if is_flat else kinds.turned | kinds.smooth
    if not moving.bends or not changed[own].any():
        return moving
    part = replace(
        scene,
        triangles=scene.triangles[own] - np.int32(first),
        surface=scene.surface[own],
        flat=scene.flat[own],
    )
    steps = []
    for offsets, normals in zip(moving.offsets, moving.normals, strict=True):
        before, after = (x[first:last] + offsets for x in (scene.vertices, vertices))
        corners = (
            np.repeat(face_normals(after[part.triangles])[:, None], 3, axis=1)
            if is_flat
            else normals[moving.corners]
        )
        there = replace(part, corner_normals=corners.astype(np.float32))
        found = _normals(there, before, after, kinds.at(own))
        steps.append(found.reshape(-1, 3))
    order = np.arange(3 * own.sum(), dtype=np.int32).reshape(-1, 3)
    return replace(moving, normals=np.array(steps, np.float32), corners=order)


def _spaces(scene: Scene) -> NDArray[np.float64]:
    """(S, 3, 3) from world space to that of each surface's object; of flattened ones none."""
    spaces = np.tile(np.eye(3), (len(scene.surfaces), 1, 1))
    if len(scene.objects):
        own = scene.objects[:, :3, :3]
        volume = np.abs(np.linalg.det(own))
        is_whole = volume > FLATTENED * np.abs(own).max(axis=(1, 2)) ** 3
        spaces[is_whole] = own[is_whole]
    return spaces


def _vertex_normals(
    scene: Scene,
    vertices: NDArray[np.float64],
    which: NDArray[Any],
    weights: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
) -> NDArray[np.float64]:
    """(V, 3) unit: of vertices to which some triangles count, alike in the spaces of their objects,
    or by weights (t, 3) of their corners there (t, 3, 3); 0 of others."""
    triangles, surface = scene.triangles[which], np.zeros(len(vertices), np.intp)
    surface[triangles] = scene.surface[which, None]
    spaces = _spaces(scene)
    hands = np.where(np.linalg.det(spaces) < 0.0, -1.0, 1.0)
    corners = np.einsum("nij,nj->ni", spaces[surface], vertices)[triangles]
    counted = face_normals(corners)[:, None] * (
        weights(corners)[..., None] if weights else np.ones((3, 1))
    )
    sums = hands[surface, None] * sums_about(triangles, counted, len(vertices))
    found: NDArray[np.float64] = unit(np.einsum("nij,ni->nj", spaces[surface], sums))
    return found


def _angles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3) of triangles (T, 3, 3)."""
    to_next = unit(np.roll(corners, -1, axis=1) - corners)
    cosines = -(to_next * np.roll(to_next, 1, axis=1)).sum(axis=2)
    found: NDArray[np.float64] = np.arccos(np.clip(cosines, -1.0, 1.0))
    return found
