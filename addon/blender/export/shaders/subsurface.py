# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that scatters below a surface: the Subsurface Scattering node, and Principled's."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ..graph import Graph
from ..links import Scope
from ..programs import Value
from .bsdf import Bsdf, ShaderLobe, SpecularModel, clipped, roughness_of

PATH = 0.25 / math.pi  # the mean free path of a radius, but by WALK, where it is the radius itself
STEPS = 40  # of bisection
MOST_ONWARD = 0.99
LEAST_IOR, MOST_IOR = 1.01, 3.8
TYPICAL = 1.4, 0.25  # index and alpha where nodes tell them
WALK, SKIN, LEGACY = "RANDOM_WALK", "RANDOM_WALK_SKIN", "RANDOM_WALK_LEGACY"


def read(graph: Graph, node: bpy.types.Node, scope: Scope, model: SpecularModel) -> Bsdf:
    """Read the node's lobe."""
    far = graph.input(node, "Scale", scope) * graph.input(node, "Radius", scope)
    ior, rough = (graph.input(node, x, scope, y) for x, y in (("IOR", 1.4), ("Roughness", 1.0)))
    colour, method = graph.input(node, "Color", scope), _method(node, "falloff")
    onward = graph.input(node, "Anisotropy", scope, 0.0)
    far = _as_if_even(graph, far, onward, colour, method)
    return below(graph, colour, far, (ior, rough), method, model)


def of_principled(
    graph: Graph, node: bpy.types.Node, scope: Scope, colour: Value, ior: Value
) -> Bsdf:
    """The same of a Principled BSDF of a colour, whose interface has this index."""
    scale, radius = (graph.input(node, f"Subsurface {x}", scope) for x in ("Scale", "Radius"))
    far = scale * radius
    method = _method(node, "subsurface_method")
    if method == SKIN:
        ior = graph.input(node, "Subsurface IOR", scope)
    rough = roughness_of(graph, node, scope)
    entry = ior, rough * rough
    onward = graph.input(node, "Subsurface Anisotropy", scope, 0.0)
    far = _as_if_even(graph, far, onward, colour, method)
    return below(graph, colour, far, entry, method, SpecularModel.GGX)


def _method(node: bpy.types.Node, name: str) -> str:
    """A node's method; before Blender 5.2 Random Walk was what is called Legacy since."""
    method = str(getattr(node, name))
    known = node.bl_rna.properties[name].enum_items
    return LEGACY if method == WALK and LEGACY not in known else method


def below(
    graph: Graph,
    colour: Value,
    far: Value,
    entry: tuple[Value, Value],
    method: str,
    model: SpecularModel,
) -> Bsdf:
    """A surface of such an albedo. `far`: how far light goes below it [m]; `entry`: the index and
    alpha of microfacets that bend rays as they enter."""
    notes, owner = graph.notes, graph.owner
    if model is SpecularModel.PHONG or not far.is_constant:
        notes.approximated(owner, "Subsurface", "rendered as diffuse")
        return Bsdf(colour)
    if not far.may_exceed(0.0):
        return Bsdf(colour)
    ior, alpha = (x.number if x.is_constant else y for x, y in zip(entry, TYPICAL, strict=True))
    ior, alpha = min(max(ior, LEAST_IOR), MOST_IOR), min(max(alpha, 0.0), 1.0)
    names = ("index", "alpha")[: 1 + (method != SKIN)]  # which has an alpha of its own
    for name, given, typical in zip(names, entry, TYPICAL, strict=False):
        if not given.is_constant:
            notes.approximated(owner, "Subsurface", f"rays enter as by an {name} of {typical}")
    factors = [1.0 if method == WALK else PATH] * 3
    if method == "BURLEY":
        notes.approximated(owner, "Subsurface", "rendered as by the method Random Walk (Legacy)")
    elif method == SKIN:
        if not colour.is_constant:
            notes.approximated(owner, "Subsurface", "how far light goes is that of a grey of 0.5")
        albedos = clipped(colour).rgb if colour.is_constant else (0.5,) * 3
        factors = skin_paths(albedos, ior)
    paths = [factor * max(x, 0.0) for factor, x in zip(factors, far.rgb, strict=True)]
    numbers = {f"radius_{c}": path for c, path in zip("rgb", paths, strict=True)}
    numbers["entry"] = 2.0 if method == SKIN else alpha + 4.0 if method == WALK else alpha
    parameters = {name: Value.of(x) for name, x in numbers.items()}
    parameters |= {"albedo": clipped(colour), "ior": Value.of(ior)}
    return Bsdf(lobes=(ShaderLobe("subsurface", clipped(colour), parameters),))


def _as_if_even(graph: Graph, far: Value, onward: Value, colour: Value, method: str) -> Value:
    """How far light goes if it is scattered to all directions alike, and as it would that is
    scattered by an anisotropy (similarity theory; Wyman, Patterson & Wilson 1989)."""
    if onward.is_just(0.0):
        return far
    what = "all directions are alike to what scatters below"
    graph.notes.approximated(graph.owner, "Subsurface Anisotropy", what)
    if method != WALK or not onward.is_constant:
        return far  # other methods' radii are of that already
    albedo = clipped(colour) if colour.is_constant else Value.of(0.5)
    root = math.sqrt  # s: of the share that is not scattered (glsl/lib/random_walk.glsl)
    s = [4.20863 * x - root(9.59217 + 41.6808 * x + 17.7126 * x * x) + 4.09712 for x in albedo.rgb]
    g = min(max(onward.number, -MOST_ONWARD), MOST_ONWARD)
    return far * Value.of([(1.0 - g * x * x) / (1.0 - g) for x in s])


def skin_paths(albedos: Sequence[float], ior: float) -> list[float]:
    """What the radii of Random Walk (Skin) are multiplied by: they are diffusion lengths of the
    dipole whose reflectance is the albedo (Jensen et al. 2001)."""
    reflected = -1.440 / ior**2 + 0.710 / ior + 0.668 + 0.0636 * ior
    boundary = 4.0 / 3.0 * (1.0 + reflected) / (1.0 - reflected)

    def reflectance(of_scattering: float) -> float:
        s = math.sqrt(3.0 * (1.0 - of_scattering))
        return 0.5 * of_scattering * (1.0 + math.exp(-boundary * s)) * math.exp(-s)

    found = []
    for albedo in albedos:
        low, high = 0.0, 1.0
        for _ in range(STEPS):
            middle = (low + high) / 2.0
            low, high = (middle, high) if reflectance(middle) < albedo else (low, middle)
        found.append(math.sqrt(3.0 * (1.0 - min(low, 0.999999))))
    return found
