# SPDX-License-Identifier: GPL-3.0-or-later
"""Every program that the renderer can build, for offline checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product
from typing import get_args

from ..streams import Defines, DrawKernel, Kernel, Made
from ..streams.draw import AddPart
from .film.device_resolver import DECLARATIONS as RESOLVER_DECLARATIONS
from .film.device_resolver import resolver_defines
from .film.film import Accumulate, AccumulateBatches, AccumulateTwo
from .kernels import mixture
from .kernels.add_chain import AddChain
from .kernels.bent_base import BentBase
from .kernels.combine import CombineAll, CombineCaustics, CombineMirror, CombinePrimary
from .kernels.coverage import Coverage
from .kernels.cuts import Cuts
from .kernels.direct import LOOKS, Direct, ShadowLeft, ShadowRays, ShadowThrough
from .kernels.displacement import Displace
from .kernels.emitted import Emitted
from .kernels.eye_rays import EyeRays
from .kernels.features import Features
from .kernels.free_flight import FreeFlight
from .kernels.gather import Gather
from .kernels.gather_radius import GatherRadius
from .kernels.generator import Generator
from .kernels.plain_lobe import PlainLobe
from .kernels.plain_microfacets import PlainMicrofacets
from .kernels.projector import Projector
from .kernels.reflector import Reflector
from .kernels.resolve import ErrorParts, FirstHalf, Resolve
from .kernels.scatter import Scatter
from .kernels.shade import Shade
from .kernels.splat import Splat
from .kernels.surface_emission import SurfaceEmission
from .kernels.tracer import Tracer
from .kernels.walk import Walk
from .photons.bounces import Bounces, declarations
from .photons.device_photon_mapper import MEDIA_DEFINE
from .photons.device_radii import DECLARATIONS
from .photons.grid_sort import PROGRAMS as GRID_PROGRAMS
from .scene import ALL_RAYS, TRANSPARENT
from .settings import FILTER_DEFINES, PIXEL_FILTER_DEFINES, Settings, SplatShape, filter_define
from .stage.displacement import defines_of
from .stage.emissive import TRIANGLE
from .stage.kinds import PHASE, camera_kinds, light_kinds, lobe_kinds, node_kinds
from .stage.light_tables import BoundsOfLights, LightFlux
from .stage.light_tree import DRAWN_RAYS
from .stage.needs import MOST_LOBES, SceneNeeds
from .stage.portals import PORTALS_BY_SHARE_DEFINES, PORTALS_FOR_ABSORBED_DEFINES
from .stage.programs import ProgramNeeds
from .stage.switches import light_defines, made_camera

# Those that no define changes.
PLAIN: tuple[type[Kernel], ...] = (
    Cuts,
    Accumulate,
    AccumulateTwo,
    AccumulateBatches,
    GatherRadius,
    AddPart,
    mixture.SplitHalves,
    mixture.FiltersCompared,
    mixture.MixtureTold,
    mixture.BoxMean,
    mixture.MixtureKept,
    BentBase,
    Walk,
)
COMPUTE = (
    "scan_blocks",
    "scan_add",
    "compact_count",
    "compact_move",
    "paths_count",
    "paths_move",
    *GRID_PROGRAMS,
    "fill_zero",
    "fill_texture",
    "radius_box",
    "radius_sides",
    "radius_count",
    "radius_sum",
    "radius_sum_rows",
    "radius_find",
    "radius_flatten",
    "radius_flatten_rows",
    "radius_summary",
)


def needs() -> Iterator[SceneNeeds]:
    """Every kind of scene, as far as programs tell them apart: no lobes, each kind alone and all
    together, one of them at a point or two, with tangents and without; each kind of light alone and
    all together; lights that are all asked, and lights that are drawn; lobes that send
    rays, and lobes that gather photons; surfaces that not all rays meet; lobes under others. What
    does not meet in one function is not crossed: single lobes with emissive triangles, say."""
    all_lights, all_lobes = frozenset(light_kinds()), frozenset(lobe_kinds())
    dark = all_lights - {TRIANGLE}
    for drawn in (False, True):
        for of_lights in (*(frozenset({kind}) for kind in light_kinds()), dark, all_lights):
            yield _needs(0, frozenset(), of_lights, drawn)
        for of_lights in (all_lights, dark):
            yield from _of_lobes(all_lobes, of_lights, drawn)
        for kind in lobe_kinds():
            yield from _of_lobes(frozenset({kind}), dark, drawn)
    for count in range(MOST_LOBES + 1):
        of_lobes = all_lobes if count else frozenset()
        for first_hits in (False, True):
            some = _needs(count, of_lobes, all_lights, drawn=True)
            some = replace(some, visibility=True, first_hits=first_hits)
            yield some
            if count and not first_hits:
                yield replace(some, panes=True, media=True)
                foggy = replace(some, media=True, scattering=True, clamped=True)
                yield from (foggy, replace(foggy, varying=True, glowing=True))
                yield replace(foggy, panes=True, gathered_lobes=True, caustics=True)
                yield replace(foggy, lobe_kinds=frozenset({PHASE}), visibility=False)
                yield replace(some, panes=True, media=True, shaded_lamps=True)
                yield replace(some, panes=True, gathered_lobes=True)
                yield replace(some, panes=True, gathered_lobes=True, seen_send_rays=True)
            if count:
                yield replace(some, chain_depth=0)
                yield replace(some, shaded_lamps=True, too_bright=True)
                yield replace(some, caustics=True)
                bare = replace(some, lobe_kinds=of_lobes - {TRANSPARENT}, visibility=False)
                yield replace(bare, caustics=True, gathered_lobes=True)
                yield replace(some, no_caustics=1 + first_hits)
                yield replace(some, no_caustics=2, gathered_lobes=True, panes=True)
                yield replace(some, no_caustics=3, too_bright=True)
                yield replace(some, gathered_lobes=True)
                yield replace(some, gathered_lobes=True, seen_send_rays=True)
            if count > 1:
                layered = replace(some, layers=3, tangents=True)
                yield layered
                yield replace(layered, no_caustics=3)
                yield replace(layered, tinted=True)
                yield replace(layered, too_bright=True)
                hidden = replace(layered, lobe_kinds=of_lobes - {TRANSPARENT}, visibility=False)
                yield replace(hidden, tinted=True, gathered_lobes=True)
                yield replace(hidden, tinted=True, gathered_lobes=True, seen_send_rays=True)


def _of_lobes(
    of_lobes: frozenset[str], of_lights: frozenset[str], drawn: bool
) -> Iterator[SceneNeeds]:
    turns = any("turn" in lobe_kinds()[kind].parameters for kind in of_lobes)
    for count in range(1, MOST_LOBES + 1):
        for tangents in (False, True)[: 1 + turns]:
            scene = replace(_needs(count, of_lobes, of_lights, drawn), tangents=tangents)
            yield scene
            for weighed in {scene.weighed, False}:  # no rays, where all lobes gather
                yield replace(scene, gathered_lobes=True, weighed=weighed)


def program_needs() -> Iterator[SceneNeeds]:
    """Scenes with programs: of each kind of node alone without lobes, and of all kinds with them;
    with attributes and normals, and without."""
    lobes, lights = frozenset(lobe_kinds()), frozenset(light_kinds())
    alone = [(0, frozenset({kind})) for kind in node_kinds()]
    for count, nodes in [*alone, *((count, frozenset(node_kinds())) for count in (0, 1, 2))]:
        some = _needs(count, lobes if count else frozenset(), lights, drawn=False)
        for attributes in (0, 2)[: 1 + ("attribute" in nodes)]:
            own = ProgramNeeds(nodes, registers=8, attributes=attributes, normals=attributes > 0)
            yield replace(some, programs=own, emission_programs=own)


def _needs(
    lobes: int, of_lobes: frozenset[str], of_lights: frozenset[str], drawn: bool
) -> SceneNeeds:
    emissive = TRIANGLE in of_lights
    return SceneNeeds(
        surfaces=True,
        shadow_rays=DRAWN_RAYS if drawn else 2,
        drawn_rays=DRAWN_RAYS if drawn else 0,
        hidden_highlights=False,
        photons=True,
        secondary_rays=lobes > 0,
        emitters_seen=True,
        emissive=emissive,
        weighed=any(not lobe_kinds()[kind].is_delta for kind in of_lobes),
        chain_depth=1,
        photon_bounces=1,
        lobes=lobes,
        lobe_kinds=of_lobes,
        light_kinds=of_lights,
        portals=any(light_kinds()[kind].is_world for kind in of_lights),
        visibility=TRANSPARENT in of_lobes,
    )


def kernels() -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """Each kernel with each of its defines and includes, once."""
    known = set()
    for kernel, defines, made in _kernels():
        own = frozenset((name, defines[name]) for name in kernel.structure if name in defines)
        if (program := (kernel, own, frozenset(made.items()))) not in known:
            known.add(program)
            yield kernel, defines, made


def _kernels() -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """The same, some of them again and again."""
    for kernel in PLAIN:
        yield kernel, {}, {}
    by_reach: Defines = {"VISIBILITY": ALL_RAYS, "BY_REACH": 1}
    yield Tracer, by_reach, {}
    for defines in ({}, {"VISIBILITY": ALL_RAYS}):
        yield Tracer, defines, {}
        yield Tracer, {**defines, "ANY_HIT": 1}, {}
    lenses: tuple[Defines, ...] = ({}, {"LENS": 1})
    for camera, lens, name in product(camera_kinds(), lenses, PIXEL_FILTER_DEFINES):
        yield EyeRays, {**lens, name: 1}, made_camera(camera)
    for kernel, name in product((Gather, Coverage), FILTER_DEFINES):
        yield kernel, {name: 1}, {}
    lux: Defines = {"ILLUMINANCE": 1}
    mapped: Defines = {"PHOTON_MAP": 1}
    misty: Defines = {"MIST": 1, "TRANSPARENT": 1, "VISIBILITY": 1}
    seen: tuple[Defines, ...] = ({}, {"EMITTERS": 1}, mapped, {"EMITTERS": 1, **mapped})
    for kernel, asked in product((CombinePrimary, CombineMirror, CombineAll), seen):
        yield from ((kernel, {**asked, **more}, {}) for more in ({}, {"VISIBILITY": 1}, misty))
    walks: tuple[Defines, ...] = ({"WALKS": 1}, {"WALKS": 1, "TRANSPARENT": 1})
    clamped = product((CombinePrimary, CombineMirror), ({}, {"TRANSPARENT": 1}, *walks))
    yield from ((kernel, {"EMITTERS": 1, "CLAMPED": 1, **more}, {}) for kernel, more in clamped)
    around: Defines = {"PANORAMIC": 1}
    for asked in seen:
        yield CombinePrimary, {**asked, **lux}, {}
        yield CombinePrimary, {**asked, **around}, {}
        yield CombinePrimary, {**asked, **lux, **around, "MIST": 1}, {}
    behind: Defines = {"TRANSPARENT": 1}
    told: Defines = {**mapped, "CAUSTICS": 1}
    added: tuple[Defines, ...] = (
        {},
        mapped,
        behind,
        {**mapped, **behind},
        told,
        {**told, **behind},
    )
    added += tuple({**first, "FEATURES": 1} for first in added)
    added += tuple({**first, **misty} for first in added)
    yield from ((AddChain, first, {}) for first in added)
    halves: tuple[Defines, ...] = ({}, {"EMISSION_APART": 1})
    yield from ((mixture.Mixture, apart, {}) for apart in halves)
    for count in range(4):
        for names in combinations(("mirror", "emission", "blur"), count):
            yield Resolve, resolver_defines(names), {}
            yield ErrorParts, resolver_defines(names), {}
            yield from ((FirstHalf, {**resolver_defines(names), **apart}, {}) for apart in halves)
    passing: tuple[Defines, ...] = (behind, {"PANES": 1}, {**behind, "PANES": 1})
    there: tuple[Defines, ...] = ({}, {"MEDIA": 1}, {"MEDIA": 1, "VARYING": 1})
    for asked, passed, within in product(({}, lux), passing, there):
        yield ShadowThrough, {**asked, **passed, **within}, {}
    yield from ((ShadowLeft, within, {}) for within in there[1:])
    for scene in program_needs():
        yield from _of_programs(scene)
    for scene in needs():
        yield from _of_scene(scene)


def _of_programs(scene: SceneNeeds) -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """Kernels that run programs of materials."""
    yield Displace, defines_of(scene.programs), scene.made
    yield SurfaceEmission, scene.programs.defines, scene.made
    yield SurfaceEmission, scene.surface_emission_defines, scene.made
    yield Shade, scene.photon_defines, scene.made
    yield Shade, scene.eye_defines, scene.made
    yield Emitted, scene.emitted_defines, scene.made
    if scene.programs.normals:
        yield Direct, scene.direct_defines, scene.made
        yield ShadowRays, scene.direct_defines, scene.made
        yield Reflector, scene.photon_defines, scene.made
        yield Gather, {**filter_define(Settings()), **scene.gather_defines}, scene.made
        if scene.lobes:
            gathering = replace(scene, gathered_lobes=True)
            for others in ({}, {"OTHER_LOBES": 1}):
                defines = {**filter_define(Settings()), **gathering.gather_defines, **others}
                yield Gather, defines, scene.made
            for media in (False, True):
                asked = replace(gathering, media=media)
                yield Scatter, asked.eye_defines, scene.made
    yield ShadowThrough, {**scene.transparent_defines, **scene.programs.defines}, scene.made
    if scene.transparent:
        filtering = replace(scene, shadow_programs=scene.programs)
        for kernel in (Direct, ShadowRays):
            yield kernel, filtering.direct_defines, scene.made
        for look, asked in zip(LOOKS, (scene, filtering), strict=True):
            stopping = replace(asked, shaded_lamps=True)
            yield Direct, {**stopping.direct_defines, look: 1}, scene.made
            for lux in ({}, {"ILLUMINANCE": 1}):
                yield Direct, {**asked.direct_defines, **lux, look: 1}, scene.made


def _of_scene(scene: SceneNeeds) -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """Kernels of a scene; with all that lights and pictures may ask, and with flat surfaces, where
    no kind of lobe is alone: what one kind's file lacks, it lacks with any of these."""
    alone = len(scene.lobe_kinds) == 1
    kernel: type[Kernel]
    for kernel in (LightFlux, BoundsOfLights):
        yield kernel, light_defines(scene.light_kinds), scene.made
    lit = [scene]
    if not alone:
        uneven = ProgramNeeds(frozenset({"geometry"}), registers=1)
        coloured = replace(scene, gobos=True, emission_programs=uneven)
        lit += [replace(scene, profiles=True), coloured]
    for found in lit:
        for media, aimed in product((False, True), ({}, {"AIMED": 1})):
            asked = replace(found, media=media or scene.media)
            emitting: Defines = {**asked.light_defines, **asked.photon_defines}
            yield Generator, {**emitting, **aimed}, scene.made
            if asked.emits_by_cosine:
                yield Generator, {**emitting, **aimed, **PORTALS_BY_SHARE_DEFINES}, scene.made
        smooth = replace(found, smooth=True)
        for bent in (smooth,) if alone else (found, smooth):
            telling = replace(bent, linked=True, visibility=True)
            apart = [telling, replace(bent, rays_apart=True)] * (scene.lobes > 0 and not alone)
            for one in (bent, *apart):
                yield Emitted, one.emitted_defines, scene.made
                yield Emitted, {**one.emitted_defines, "BY_KIND": 1}, scene.made
            for kernel in (Direct, ShadowRays):
                yield kernel, bent.direct_defines, scene.made
                if not (alone or bent.smooth):
                    yield kernel, {**telling.direct_defines, "ILLUMINANCE": 1}, scene.made
    if scene.media:
        yield from _of_media(scene)
    for kernel in (Shade, Projector, Reflector):
        for arrivals, media in product((False, True), repeat=2):
            linked, some = arrivals and scene.visibility, media or scene.media
            asked = replace(scene, arrivals=arrivals, linked=linked, media=some)
            yield kernel, asked.photon_defines, scene.made
            if arrivals or media:
                continue
            if kernel is Reflector:
                yield kernel, {**asked.photon_defines, **PORTALS_FOR_ABSORBED_DEFINES}, scene.made
                yield kernel, {**asked.photon_defines, **PORTALS_BY_SHARE_DEFINES}, scene.made
            if kernel is Shade and asked.lobes:
                yield kernel, {**asked.photon_defines, **PORTALS_BY_SHARE_DEFINES}, scene.made
    yield Shade, scene.eye_defines, scene.made
    if scene.gathered_lobes:
        for others in ({}, {"OTHER_LOBES": 1}):
            defines = {**filter_define(Settings()), **scene.gather_defines, **others}
            yield Gather, defines, scene.made
        yield PlainLobe, scene.gather_defines, scene.made
        yield PlainMicrofacets, scene.gather_defines, scene.made
    yield from _of_pictures(scene)
    if scene.lobes:
        for media in (False, True):
            yield Scatter, replace(scene, media=media or scene.media).eye_defines, scene.made


def _of_pictures(scene: SceneNeeds) -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """Kernels that put pictures together."""
    kernel: type[Kernel]
    for kernel in (CombinePrimary, CombineMirror):
        for emitters in ({}, scene.emitter_defines):
            for more in ({}, scene.transparent_defines):
                yield kernel, {**emitters, **scene.gather_defines, **more}, {}
                yield kernel, {**emitters, **scene.gather_defines, **more, "PHOTON_MAP": 1}, {}
    for emitters in ({}, scene.emitter_defines):
        yield Features, {**scene.eye_defines, **emitters}, scene.made
    if scene.caustics:
        yield CombineCaustics, scene.combine_defines, {}


def _of_media(scene: SceneNeeds) -> Iterator[tuple[type[Kernel], Defines, Made]]:
    """Kernels that know what rays are in."""
    for whose in ("EYE", "PHOTONS"):
        yield FreeFlight, scene.flight_defines(whose), {}
    kernel: type[Kernel]
    for kernel in (CombinePrimary, CombineMirror):
        yield kernel, scene.combine_defines, {}
        yield kernel, {**scene.combine_defines, "MIST": 1, "TRANSPARENT": 1}, {}


def compute_programs() -> Iterator[tuple[str, str, Made]]:
    """Each program that is no kernel, what it is compiled with, and its includes."""
    for stem in COMPUTE:
        yield stem, {**DECLARATIONS, **GRID_PROGRAMS}.get(stem, ""), {}
    yield "paths_move", MEDIA_DEFINE, {}
    yield "sum_texels", RESOLVER_DECLARATIONS, {}
    for scene in (*needs(), *program_needs()):
        for arrivals, media in ((False, False), (False, True), (True, False)):
            linked, some = arrivals and scene.visibility, media or scene.media
            asked = replace(scene, arrivals=arrivals, linked=linked, media=some)
            yield Bounces.stem, declarations(asked.photon_defines), scene.made
            if not (arrivals or media or scene.programs.nodes):
                for portals in (PORTALS_FOR_ABSORBED_DEFINES, PORTALS_BY_SHARE_DEFINES):
                    defines = declarations({**asked.photon_defines, **portals})
                    yield Bounces.stem, defines, scene.made


def drawn() -> Iterator[tuple[type[DrawKernel], SplatShape, Defines]]:
    """Each kernel that draws, what it may draw, and each of its defines."""
    for shape in get_args(SplatShape):
        for name in FILTER_DEFINES:
            yield Splat, shape, {name: 1}
