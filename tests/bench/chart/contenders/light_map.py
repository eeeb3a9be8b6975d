# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics of smooth glass and metal without photons' radii: for references, no contender.

Light is traced from a scene's lamp by way of glass and metal to where it first falls on something
diffuse (tests/regression/light_tracer.py), and what falls on each cell of a fine grid over each
plane is made an image, which Cycles takes for light that the plane emits: it finds all that comes
after. What Cycles itself finds of a lamp without size are shadow rays, which no glass lets through.
So the picture is right but for what cells of a few tenths of a pixel blur. Everything else than
glass and metal has to be diffuse, and flat in large pieces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np

from addon.photon.scene import Light, Scene
from tests.blender.build import add_node
from tests.regression.cycles import render_loaded
from tests.regression.light_tracer import arrivals, is_caster

from .cycles import open_scene
from .steps import Budget, Step, now

METHODS = {"Light map and Cycles": "path"}
RAYS = 1 << 20  # at a time
COARSE, FINE = 512, 2048  # cells a side of a plane; of the part of it where most light falls
MOST = 0.98  # of the light
LIGHT = 0.5  # of the budget, for tracing it; Cycles has the other half
FIRST = 4  # samples, which tell how many there is time for


class Plane(NamedTuple):
    """Triangles of one material and one plane."""

    material: str
    normal: Any
    across: Any  # unit, as `up`
    up: Any
    low: Any  # (2,) along these [m], and (2,) of the opposite corner
    high: Any
    at: float  # of all its points along the normal [m]


class Engine:
    """A light tracer with one scene loaded, and Cycles."""

    def __init__(self) -> None:
        self.about = f"light map and Cycles of Blender {bpy.app.version_string}"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Remember which; each picture opens the .blend anew."""
        self.name, self.size = blend.stem, size

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """One picture, which takes all of the budget."""
        begun, whole = now(), budget.left
        scene = open_scene(self.name, self.size)
        planes, of_triangle = planes_of(scene)
        (lamp,) = (light for light in scene.lights if light.kind != "world")
        maps = traced(scene, lamp, planes, of_triangle, seed, LIGHT * whole)
        for thing in bpy.data.objects:
            thing.cycles.is_caustics_caster = False  # else Cycles has of some caustics a part
        for material in bpy.data.materials:
            own = [(p, m) for p, m in zip(planes, maps, strict=True) if p.material == material.name]
            if own:
                make_shine(material, own)
        start = now()
        render_loaded(FIRST, 0)
        samples = max(FIRST, int(FIRST * (1 - LIGHT) * whole / (now() - start).wall))
        picture = render_loaded(samples, seed).astype(float)
        yield Step(samples, now() - begun, lambda: picture)


def planes_of(scene: Scene) -> tuple[list[Plane], Any]:
    """The planes of what is neither glass nor metal, and which each triangle is of, or -1."""
    corners = scene.vertices[scene.triangles].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    extent = np.ptp(scene.vertices, axis=0).max()
    found: dict[Any, int] = {}
    planes: list[Plane] = []
    of_triangle = np.full(len(corners), -1)
    for triangle, number in enumerate(scene.material):
        if is_caster(scene.materials[number]):
            continue
        normal, at = normals[triangle], float(normals[triangle] @ corners[triangle, 0])
        key = (int(number), *np.round(normal, 3), round(at / extent, 4))
        if key not in found:
            found[key] = len(planes)
            across = np.eye(3)[int(np.argmin(np.abs(normal)))]
            across = across - (across @ normal) * normal
            across /= np.linalg.norm(across)
            up, name = np.cross(normal, across), scene.materials[number].name
            planes.append(Plane(name, normal, across, up, None, None, at))
        of_triangle[triangle] = found[key]
    for i, plane in enumerate(planes):
        places = flat(plane, corners[of_triangle == i].reshape(-1, 3))
        planes[i] = plane._replace(low=places.min(axis=0), high=places.max(axis=0))
    return planes, of_triangle


def flat(plane: Plane, points: Any) -> Any:
    """(n, 2): where they are on a plane [m]."""
    return np.stack([points @ plane.across, points @ plane.up], -1)


class Map(NamedTuple):
    """What falls on a part of a plane: (rows, columns, 3) [W/m^2], and where that is [m]."""

    irradiance: Any
    low: Any
    high: Any


def traced(
    scene: Scene, lamp: Light, planes: list[Plane], of_triangle: Any, seed: int, seconds: float
) -> list[list[Map]]:
    """What a lamp sends to each plane, by so many seconds of light: coarse, and fine where most of
    it falls."""
    casters = scene.material[:, None] == [
        i for i, material in enumerate(scene.materials) if is_caster(material)
    ]
    points = scene.vertices[scene.triangles[casters.any(axis=1)]].reshape(-1, 3).astype(float)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = 1.001 * float(np.linalg.norm(points - middle, axis=1).max())
    fine: list[Any] = [None] * len(planes)  # lowest and highest corner, in coarse cells
    sums: list[Any] = [None] * len(planes)
    begun, launches = now(), 0
    while not launches or (now() - begun).wall < seconds:
        number = seed * 1_000_003 + launches
        at, flux, triangles, index = arrivals(scene, lamp, RAYS, middle, radius, number)
        flux = flux / index[:, None] ** 2  # Cycles has as bright in glass what is bright outside it
        launches += 1
        for i, plane in enumerate(planes):
            own = of_triangle[triangles] == i
            if not own.any():
                continue
            cells = (flat(plane, at[own]) - plane.low) / (plane.high - plane.low) * COARSE
            if sums[i] is None:
                fine[i] = bright_part(cells, flux[own].sum(axis=1))
                sums[i] = [np.zeros((COARSE, COARSE, 3)), np.zeros((FINE, FINE, 3))]
            within = ((cells >= fine[i][0]) & (cells < fine[i][1])).all(axis=1)
            inner = (cells[within] - fine[i][0]) / (fine[i][1] - fine[i][0]) * FINE
            sums[i][0] += histogram(cells[~within], flux[own][~within], COARSE)
            sums[i][1] += histogram(inner, flux[own][within], FINE)
    maps = []
    for plane, box, both in zip(planes, fine, sums, strict=True):
        if both is None:
            maps.append([])
            continue
        cell = (plane.high - plane.low) / COARSE
        low, high = plane.low + cell * box[0], plane.low + cell * box[1]
        parts = ((both[0], plane.low, plane.high), (both[1], low, high))
        maps.append(
            [
                Map(total / launches * (total.shape[0] ** 2 / np.prod(to - start)), start, to)
                for total, start, to in parts
            ]
        )
    return maps


def bright_part(cells: Any, weights: Any) -> Any:
    """Whole coarse cells, lowest and highest corner (2, 2), between which most of the light is."""
    low, high = [], []
    for k in range(2):
        order = np.argsort(cells[:, k])
        share = np.cumsum(weights[order]) / weights.sum()
        first, last = np.searchsorted(share, [(1 - MOST) / 2, (1 + MOST) / 2])
        low.append(math.floor(cells[order[first], k]))
        high.append(math.ceil(cells[order[min(last, len(order) - 1)], k] + 1e-9))
    return np.clip(np.array([low, high], float), 0, COARSE)


def histogram(cells: Any, flux: Any, count: int) -> Any:
    """(count, count, 3): the flux of each cell, across last but one; what is beside is kept at the
    edge."""
    columns, rows = np.clip(cells.astype(int), 0, count - 1).T
    place = rows * count + columns
    sums = [np.bincount(place, flux[:, c], count * count) for c in range(3)]
    return np.stack(sums, -1).reshape(count, count, 3)


def make_shine(material: bpy.types.Material, own: list[tuple[Plane, list[Map]]]) -> None:
    """Have a diffuse material emit what it reflects of what falls on its planes."""
    tree = material.node_tree
    (diffuse,) = (node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    (output,) = (node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    (link,) = output.inputs["Surface"].links
    assert link.from_node == diffuse and len(tree.nodes) > 1
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    position, true_normal = geometry.outputs["Position"], geometry.outputs["True Normal"]
    total: Any = (0.0, 0.0, 0.0)
    for plane, maps in own:
        near = 1e-3 * float(np.linalg.norm(plane.high - plane.low))
        on_plane = _math(tree, "COMPARE", _dot(tree, position, plane.normal), plane.at, near)
        facing = _math(tree, "ABSOLUTE", _dot(tree, true_normal, plane.normal))
        here = _math(tree, "MULTIPLY", on_plane, _math(tree, "GREATER_THAN", facing, 0.99))
        for part in maps:
            where = tree.nodes.new("ShaderNodeCombineXYZ")
            for axis, (way, low, high) in enumerate(
                zip((plane.across, plane.up), part.low, part.high, strict=True)
            ):
                along = _math(tree, "SUBTRACT", _dot(tree, position, way), float(low))
                tree.links.new(_math(tree, "DIVIDE", along, float(high - low)), where.inputs[axis])
            texture = add_node(tree, "ShaderNodeTexImage", Vector=where.outputs[0])
            texture.image = image_of(part.irradiance / math.pi)
            texture.interpolation, texture.extension = "Closest", "CLIP"
            shown = _vector(tree, "SCALE", texture.outputs["Color"], Scale=here)
            total = _vector(tree, "ADD", total, shown)
    colour = diffuse.inputs["Color"]
    albedo = colour.links[0].from_socket if colour.links else tuple(colour.default_value)[:3]
    emission = add_node(
        tree, "ShaderNodeEmission", Color=_vector(tree, "MULTIPLY", total, albedo), Strength=1.0
    )
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(diffuse.outputs[0], both.inputs[0])
    tree.links.new(emission.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"


def image_of(pixels: Any) -> bpy.types.Image:
    """Of linear colours, the lowest row first."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new("light", width, height, float_buffer=True, is_data=True)
    whole = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)
    image.pixels.foreach_set(whole.astype(np.float32).ravel())
    image.update()
    return image


def _dot(tree: bpy.types.NodeTree, socket: Any, way: Any) -> Any:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "DOT_PRODUCT"
    tree.links.new(socket, node.inputs[0])
    node.inputs[1].default_value = way
    return node.outputs["Value"]


def _math(tree: bpy.types.NodeTree, operation: str, *inputs: Any) -> Any:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    _feed(tree, node, inputs)
    return node.outputs[0]


def _vector(tree: bpy.types.NodeTree, operation: str, *inputs: Any, **named: Any) -> Any:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    _feed(tree, node, inputs)
    for name, socket in named.items():
        tree.links.new(socket, node.inputs[name])
    return node.outputs["Vector"]


def _feed(tree: bpy.types.NodeTree, node: bpy.types.Node, inputs: Any) -> None:
    for i, x in enumerate(inputs):
        if isinstance(x, bpy.types.NodeSocket):
            tree.links.new(x, node.inputs[i])
        else:
            node.inputs[i].default_value = x
