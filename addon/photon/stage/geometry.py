# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's triangles in scene units, and their tree.

Scene units put the bounding box's centre at the origin and its largest half extent at 1, so every
tolerance means the same at every scale. Powers are divided by scale^2: flux over scene-unit area
is then the irradiance in W/m^2.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ...streams import Record
from ..errors import SceneError
from ..kernels.records import CORNER_ATTRIBUTE, CORNER_NORMALS, CORNER_TANGENTS, TRIANGLE
from ..scene import TERMINATOR, Material, Scene
from .gathered import gather_some
from .kinds import lobe_kinds
from .movement import Movement

AREAS_AT_ONCE = 1 << 15
OPAQUE, PHOTONS_LAND = 1, 2  # flags of glsl/lib/triangle.glsl
# A refitted tree is kept up to this cost over what it was when it was built: rays then take as much
# longer than in another, about, and a tenth of a few passes' rays take as long as building it.
MOST_WEAR = 1.1


@dataclass(frozen=True)
class Frame:
    """Scene units: x_scene = (x_world - centre) / scale."""

    centre: NDArray[np.float64]  # (3,) [m]
    scale: float  # [m] a scene unit

    def points(self, world: Any) -> NDArray[np.float64]:
        """World points (..., 3) in scene units."""
        return (np.asarray(world, np.float64) - self.centre) / self.scale

    def vertices(self, world: NDArray[np.float64]) -> NDArray[np.float32]:
        """The same (V, 3) as trees and tables have them: what is beyond float32 is infinite."""
        with np.errstate(over="ignore"):
            return self.points(world).astype(np.float32)


def frame_of(scene: Scene, movement: Movement | None = None) -> Frame:
    """The scene units of the finite vertices that triangles use, and of where they move."""
    is_used = np.zeros(len(scene.vertices), bool)
    is_used[scene.triangles] = True
    used = scene.vertices if is_used.all() else scene.vertices[is_used]
    if len(used) and not _greatest(used) < 1e30:  # or NaN
        used = used[(np.abs(used) < 1e30).all(axis=1)]
    if len(used) == 0:
        return Frame(np.zeros(3), 1.0)
    low, high = used.min(axis=0), used.max(axis=0)
    if movement:
        moved_low, moved_high = movement.box()
        low, high = np.minimum(low, moved_low), np.maximum(high, moved_high)
    return Frame((low + high) / 2, float((high - low).max()) / 2 or 1.0)


@dataclass(frozen=True)
class Tree:
    """A BVH of triangles, which depends on nothing but where they are."""

    triangles: NDArray[np.int32]  # (T, 3) the scene's, kept or not
    order: NDArray[np.int32]  # (K,) the kept ones' numbers, in leaf order
    nodes: NDArray[np.float32]  # (N, 16)
    not_finite: int
    degenerate: int
    cost: float  # by SAH when it was built, over the areas of the triangles' own boxes

    @staticmethod
    def build(
        vertices: NDArray[np.float32],
        triangles: NDArray[np.int32],
        old: Tree | None = None,
    ) -> Tree:
        """Fit `old` to vertices (V, 3) if it is a good tree for them, or else build another.

        ValueError if the native core refuses the triangles.
        """
        if old and np.array_equal(old.triangles, triangles):
            fitted = native.refit_bvh(old.nodes, old.order, vertices, triangles)
            if fitted and fitted[3] <= MOST_WEAR * old.cost:
                nodes, not_finite, degenerate, _ = fitted
                return replace(old, nodes=nodes, not_finite=not_finite, degenerate=degenerate)
            del fitted, old  # there may not be room for these as well
        nodes, order, not_finite, degenerate, cost = native.build_bvh(vertices, triangles)
        return Tree(triangles, order, nodes, not_finite, degenerate, cost)


@dataclass(frozen=True)
class Mesh:
    """Triangles in BVH order. In which one shows in nothing that is made of them."""

    tree: Tree
    frame: Frame
    vertices: NDArray[np.float64]  # (V, 3) the scene's [m], used or not
    surfaces: NDArray[np.int32]  # (T,) of the scene's triangles, kept or not
    triangles: NDArray[Any]  # (K,) of TRIANGLE
    normals: NDArray[Any]  # (K,) of CORNER_NORMALS
    tangents: NDArray[Any]  # (K,) of CORNER_TANGENTS; (0,): nothing is anisotropic
    attributes: NDArray[Any]  # (K A,) of CORNER_ATTRIBUTE, a triangle's one after the other
    visible: NDArray[np.uint8]  # (K,) bits of Scene.visible; (0,): all rays meet all
    area: float  # of diffuse triangles [scene units^2]
    extent: NDArray[np.float32]  # (3,) largest |x|, |y|, |z| of the corners

    @property
    def corners(self) -> NDArray[np.float32]:
        """The triangles as (K, 3, 4) numbers."""
        return self.triangles.view(np.float32).reshape(-1, 3, 4)

    def places_of(self, numbers: NDArray[np.intp]) -> NDArray[np.intp]:
        """Where among its triangles those of these numbers in the scene are; -1: nowhere, they have
        no area."""
        places = np.full(len(self.surfaces), -1)
        places[self.tree.order] = np.arange(len(self.tree.order))
        return places[numbers]

    @cached_property
    def faces(self) -> NDArray[np.float32]:
        """(K, 4) which triangles make quads, bound a solid, and have something lying on them, as
        native/src/faces.rs tells: found when first asked for, unless a thread finds them."""
        return self._ahead.pop().result() if self._ahead else self._find_faces()

    def find_faces(self) -> None:
        """Begin to find faces in a thread; who asks for them waits for it, and gets its errors."""
        if not self._ahead and "faces" not in vars(self):
            thread = ThreadPoolExecutor(1)
            self._ahead.append(thread.submit(self._find_faces))
            thread.shutdown(wait=False)

    @cached_property
    def _ahead(self) -> list[Future[NDArray[np.float32]]]:
        return []  # one, while a thread finds faces

    def _find_faces(self) -> NDArray[np.float32]:
        materials = np.zeros(len(self.surfaces), np.int32)
        materials[self.tree.order] = self.triangles["material"]
        tree, vertices = self.tree, self.frame.vertices(self.vertices)
        found = native.faces_of(
            tree.nodes, tree.order, vertices, tree.triangles, self.surfaces, materials
        )
        return found[tree.order]

    def meet(
        self,
        origins: NDArray[Any],
        directions: NDArray[Any],
        far: Any = np.inf,
        beside: Any = -1,
        any_hit: bool = False,
    ) -> NDArray[np.float32]:
        """(n, 4) what few rays (n, 3) meet that go so far, and pass through the triangle at that
        place in leaf order: how far away, that place + 1, u, v; zeros: nothing."""
        origin, direction = np.empty((2, len(origins), 4), np.float32)
        origin[:, :3], origin[:, 3] = origins, beside
        direction[:, :3], direction[:, 3] = directions, far
        return native.trace_few(self.tree.nodes, self.corners, origin, direction, any_hit)

    @staticmethod
    def build(
        scene: Scene, frame: Frame, old: Tree | None = None, movement: Movement | None = None
    ) -> Mesh:
        """Build the BVH natively, or refit an old one; SceneError if triangles are refused.
        `movement`: how the scene moves, whose extent that of the mesh then is."""
        vertices, triangles = frame.vertices(scene.vertices), np.ascontiguousarray(scene.triangles)
        try:
            tree = Tree.build(vertices, triangles, old)
        except ValueError as error:
            raise SceneError(f"scene geometry: {error}") from error
        order = tree.order
        corners = np.zeros((len(order), 3, 4), np.float32)
        corners[..., :3] = np.take(vertices, np.take(triangles, order, axis=0), axis=0)
        extent = [_greatest(corners[..., k]) for k in range(3)] if len(order) else [0.0] * 3
        if movement:
            extent = np.abs([*extent_of(movement, frame), extent]).max(axis=0)
        material = scene.material[order]
        triangle = corners.reshape(len(order), 12).view(TRIANGLE.dtype).reshape(len(order))
        triangle["material"] = material
        triangle["surface"] = scene.surface[order]
        triangle["number"] = order
        anisotropic = np.array([m.is_anisotropic for m in scene.materials], bool)
        turned = len(scene.corner_tangents) > 0 and anisotropic[material].any()
        diffuse = np.array([m.is_diffuse for m in scene.materials], bool)
        areas = np.zeros(len(triangles))  # in the scene's order: a sum of floats depends on it
        areas[order] = np.where(diffuse[material], _areas(corners), 0.0)
        return Mesh(
            tree,
            frame,
            scene.vertices,
            scene.surface,
            triangle,
            _normals(scene, tree),
            _at_corners(CORNER_TANGENTS, scene.corner_tangents, order if turned else order[:0]),
            _attributes(scene.corner_attributes, order),
            scene.visible[scene.surface[order]] if len(scene.visible) else scene.visible,
            area=float(areas.sum()),
            extent=np.array(extent, np.float32),
        )


def extent_of(movement: Movement, frame: Frame) -> NDArray[np.float64]:
    """The box (2, 3) that what moves is in [scene units]."""
    box = np.array(movement.box())
    return frame.points(box) if np.isfinite(box).all() else np.zeros((2, 3))


def _at_corners(
    record: Record, vectors: NDArray[np.float32], order: NDArray[np.int32]
) -> NDArray[Any]:
    """Vectors (T, 3, 3) of some triangles' corners, (len(order),) of a record.

    One that is not finite reads as none: the kernel then takes what the triangle has of its own.
    """
    texels = np.zeros((len(order), 3, 4), np.float32)
    if len(order):
        texels[..., :3] = np.take(vectors, order, axis=0)
    if not np.isfinite(texels.sum()):
        np.nan_to_num(texels, copy=False, posinf=0.0, neginf=0.0)
    return texels.reshape(len(order), 12).view(record.dtype).reshape(len(order))


def _normals(scene: Scene, tree: Tree) -> NDArray[Any]:
    """Of the scene's triangles in a tree, (K,) of CORNER_NORMALS."""
    normals = _at_corners(CORNER_NORMALS, scene.corner_normals, tree.order)
    has_own = len(scene.terminators) > 0
    normals["terminator"] = scene.terminators[scene.surface[tree.order]] if has_own else TERMINATOR
    flags = np.array([flags_of(material) for material in scene.materials], np.float32)
    normals["flags"] = flags[scene.material[tree.order]]
    return normals


def flags_of(material: Material) -> int:
    """Those of glsl/lib/triangle.glsl."""
    through = any(lobe.reflects and lobe_kinds()[lobe.kind].transmits for lobe in material.lobes)
    return OPAQUE * (not through) | PHOTONS_LAND * (material.is_diffuse or gather_some(material))


def _attributes(values: NDArray[np.float32], order: NDArray[np.int32]) -> NDArray[Any]:
    """Attributes (T, A, 3, 4) of some triangles, of CORNER_ATTRIBUTE; what is not finite is 0."""
    if not values.size:
        return CORNER_ATTRIBUTE.zeros(0)
    texels = np.nan_to_num(np.take(values, order, axis=0), posinf=0.0, neginf=0.0)
    return texels.reshape(-1, 12).view(CORNER_ATTRIBUTE.dtype).reshape(-1)


def _areas(corners: NDArray[np.float32]) -> NDArray[np.float64]:
    """The areas of triangles (T, 3, 3 or more); by pieces that fit the processor's cache."""
    areas = np.empty(len(corners))
    for at in range(0, len(corners), AREAS_AT_ONCE):
        piece = corners[at : at + AREAS_AT_ONCE]
        x, y, z = np.moveaxis(piece[:, 1:, :3] - piece[:, :1, :3], -1, 0)
        cross = (
            y[:, 0] * z[:, 1] - z[:, 0] * y[:, 1],
            z[:, 0] * x[:, 1] - x[:, 0] * z[:, 1],
            x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1],
        )
        areas[at : at + AREAS_AT_ONCE] = np.sqrt(sum(np.square(a, dtype=float) for a in cross)) / 2
    return areas


def _greatest(values: NDArray[Any]) -> float:
    """The largest magnitude; NaN if there is one."""
    return float(max(values.max(), -values.min()))
