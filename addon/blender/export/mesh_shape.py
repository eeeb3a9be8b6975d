# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles finds in the shape of a mesh: how pointed it is, and of what islands it is."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from .hashes import WHOLE, hashed_one
from .triangles import positions_of, read, unit

Numbers = NDArray[np.float64]
Ints = NDArray[np.int64]


def pointiness(mesh: bpy.types.Mesh) -> Numbers:
    """(V, 1): the angle of a vertex' normal to its edges over pi, blurred over neighbours."""
    normals = read(mesh.vertex_normals, "vector", 3 * len(mesh.vertices))
    unique, one_of = np.unique(positions_of(mesh), axis=0, return_inverse=True)
    one_of = one_of.reshape(-1)  # vertices in one place are one
    normal = _summed(one_of, normals.reshape(-1, 3).astype(np.float64), len(unique))
    edges = np.unique(np.sort(one_of[_edges(mesh)], axis=1), axis=0)
    a, b = edges[edges[:, 0] != edges[:, 1]].T
    way = unit(unique[b].astype(np.float64) - unique[a])
    ways = _summed(a, way, len(unique)) - _summed(b, way, len(unique))
    degree = np.bincount(a, minlength=len(unique)) + np.bincount(b, minlength=len(unique))
    cosine = (unit(normal) * ways).sum(axis=1) / np.maximum(degree, 1)
    raw = np.where(degree > 0, np.arccos(cosine.clip(-1.0, 1.0)) / np.pi, 0.0)
    blurred = raw + np.bincount(a, raw[b], len(unique)) + np.bincount(b, raw[a], len(unique))
    found: Numbers = (blurred / (degree + 1))[one_of, None]
    return found


def random_per_island(mesh: bpy.types.Mesh) -> Numbers:
    """(V, 1), from 0 to 1: vertices that edges join have the same."""
    return hashed_one(_islands(_edges(mesh), len(mesh.vertices)))[:, None] / WHOLE


def _islands(edges: Ints, count: int) -> Ints:
    """(V,): of each vertex one of its island, the same as Cycles takes: which one that is hangs on
    the order of the edges, so they are joined one after the other."""
    parents, ranks = list(range(count)), [0] * count

    def root(vertex: int) -> int:
        while parents[vertex] != vertex:
            parents[vertex] = parents[parents[vertex]]
            vertex = parents[vertex]
        return vertex

    for a, b in edges.tolist():
        a, b = root(a), root(b)
        if a == b:
            continue
        if ranks[a] < ranks[b]:
            a, b = b, a
        parents[b] = a
        ranks[a] += ranks[a] == ranks[b]
    return np.array([root(vertex) for vertex in range(count)], np.int64)


def of_vertices(mesh: bpy.types.Mesh, values: Numbers) -> Numbers:
    """Numbers of edges (E, n) as those of vertices (V, n): the mean of what meets there."""
    edges = _edges(mesh)
    total = sum(_summed(edges[:, side], values, len(mesh.vertices)) for side in (0, 1))
    degree = np.bincount(edges.reshape(-1), minlength=len(mesh.vertices))
    found: Numbers = total / np.maximum(degree, 1)[:, None]
    return found


def _edges(mesh: bpy.types.Mesh) -> Ints:
    """(E, 2) vertices."""
    found = read(mesh.edges, "vertices", 2 * len(mesh.edges), np.int32)
    return found.reshape(-1, 2).astype(np.int64)


def _summed(where: Ints, values: Numbers, count: int) -> Numbers:
    """Rows of values (N, n) added where (N,) they belong (count, n)."""
    return np.stack([np.bincount(where, column, count) for column in values.T], axis=1)
