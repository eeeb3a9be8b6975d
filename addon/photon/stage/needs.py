# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneNeeds: what a scene has a use for. Nothing else is compiled, allocated or run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

from ...streams import Defines, Made
from ..scene import RAY_BITS, RAYS, SUBSURFACE, TRANSPARENT
from .emissive import TRIANGLE
from .gathered import BLEND, SEEN_BLEND
from .kinds import PHASE, light_kinds, lobe_kinds
from .portals import MOST_PORTALS
from .programs import ProgramNeeds
from .spectrum import made_spectrum
from .switches import light_defines, made_bsdf, made_camera, made_lights

MOST_LOBES = 2  # of a visible point: more of a material are merged by chance
# In Cycles a path's pixel widens with all of its length, and photons' is seen by way of others.
PHOTONS_FARTHER = 2


@dataclass(frozen=True)
class SceneNeeds:
    """The scene summed up once; the pipeline is built from it."""

    surfaces: bool  # there are triangles to see
    shadow_rays: int  # of a visible point; none if photons carry the direct light
    drawn_rays: int  # those of them that go to lights by chance
    hidden_highlights: bool  # photons carry the direct light, and lobes would have reflected it
    photons: bool  # light can reach a diffuse surface by a path that photons stand for
    secondary_rays: bool  # a surface sends some
    emitters_seen: bool  # lights or the world, by the eye or by secondary rays
    emissive: bool  # some triangles are
    weighed: bool  # shadow rays and rays of lobes may find the same light
    chain_depth: int
    photon_bounces: int
    lobes: int  # that a visible point has at most, besides Lambert's
    lobe_kinds: frozenset[str]
    light_kinds: frozenset[str]
    layers: int = 0  # lobes of a material at most, of which some lie over others
    covers: bool = False  # some lie over Lambert's lobe
    tinted: bool = False  # such a layer colours what it lets through
    tangents: bool = False  # lobes turn with them
    illuminance: bool = False  # is asked for
    mist: bool = False  # is asked for
    features: bool = False  # which denoisers go by are asked for
    smooth: bool = False  # triangles stand for a bent surface
    camera_kind: str = "persp"
    lens: bool = False  # the camera has one: not all is in focus
    moves: bool = False  # it does, or something that it sees
    panorama: bool = False
    # Shadow rays go to the world: before pass 0 portals are looked for, with what aims photons.
    portals: bool = False
    gathered_lobes: bool = False  # some are broad enough to gather photons with
    gathering_kinds: frozenset[str] = frozenset()  # of those
    seen_send_rays: bool = False  # such lobes that the eye sees itself send rays, up to SEEN_BLEND
    profiles: bool = False  # lights are not equally bright in all directions
    gobos: bool = False  # or not of one colour, or not at all places
    arrivals: bool = False  # what photons bring hangs on where they first land
    linked: bool = False  # lights tell surfaces apart
    rays_apart: bool = False  # rays of some lobes find lights that those of others do not
    visibility: bool = False  # rays pass through some surfaces, or lights are limited
    first_hits: bool = False  # photons carry the direct light
    no_caustics: int = 0  # bits of CAUSTICS: by such lobes no light comes to diffuse surfaces
    programs: ProgramNeeds = ProgramNeeds()  # of the materials
    emission_programs: ProgramNeeds = ProgramNeeds()  # where what they emit differs by place
    transparent_depth: int = 0  # surfaces that a ray goes straight on through
    media: bool = False  # light is absorbed or scattered on its way, inside meshes or everywhere
    too_bright: bool = False  # some surfaces reflect more than they receive
    shaded_lamps: bool = False  # some surfaces are transparent, but not to lamps
    shadow_programs: ProgramNeeds = ProgramNeeds()  # where what they let through does
    caustics: bool = False  # are asked for, and there may be some
    scattering: bool = False  # media scatter light, too
    varying: bool = False  # and differ from place to place
    glowing: bool = False  # media emit light
    panes: bool = False  # light from afar may come straight through glass
    clamped: bool = False  # light of single samples is

    @cached_property
    def emitter_defines(self) -> Defines:
        """What kernels of images are compiled with."""
        return ({"EMITTERS": 1} if self.emitters_seen else {}) | self.rays("camera")

    @cached_property
    def combine_defines(self) -> Defines:
        """What kernels are compiled with that put a picture together."""
        found: dict[str, int | float] = {"PHOTON_MAP": 1} if self.photons else {}
        found |= {"FEATURES": 1} if self.features else {}
        found |= {"MIST": 1} if self.mist else {}
        found |= self.walk_defines | ({"CLAMPED": 1} if self.clamped else {})
        of_rays = {**self.emitter_defines, **self.gather_defines, **self.transparent_defines}
        return {**of_rays, **found, **self.caustic_defines, **self.media_defines}

    @property
    def noisy_emission(self) -> bool:
        """Whether chance decides what the eye sees of lamps, not only at their edges: where in a
        lens a ray begins, or when, or whether a medium scatters it."""
        return self.lens or self.moves or self.scattering

    @property
    def noisy_features(self) -> bool:
        """Whether chance decides what denoisers go by: as `noisy_emission` says, or as glass may
        reflect."""
        kinds = [lobe_kinds()[name] for name in self.lobe_kinds - {TRANSPARENT}]
        has_glass = any(kind.transmits and not kind.is_diffuse for kind in kinds)
        return self.noisy_emission or has_glass

    @property
    def caustic_defines(self) -> dict[str, int | float]:
        """What kernels are compiled with that tell caustics apart, where they are asked for."""
        return {"CAUSTICS": 1} if self.caustics else {}

    @cached_property
    def feature_defines(self) -> Defines:
        """What the kernel is compiled with that tells what denoisers go by."""
        return {**self.eye_defines, **self.emitter_defines}

    @cached_property
    def illuminance_defines(self) -> Defines:
        """What kernels are compiled with that tell illuminance, where it is asked for."""
        return {"ILLUMINANCE": 1} if self.illuminance else {}

    @cached_property
    def eye_defines(self) -> Defines:
        """What kernels of visible points are compiled with."""
        chains: dict[str, int | float] = {"CHAINS": 1} if self.transparent else {}
        chains |= {"DISPERSED_CHAINS": 1} if self.disperses else {}
        chains |= self.media_defines | self.walk_defines
        chains |= self._caustic_free_defines
        return self._point_defines | self.programs.defines | self._footprint(1) | chains

    def _footprint(self, times: int) -> dict[str, int | float]:
        """What Shade is compiled with where there are bumps: how many times as far as straight from
        the eye rays have come there."""
        return {"FOOTPRINT": times} if self.programs.bumps else {}

    @property
    def _point_defines(self) -> dict[str, int | float]:
        """What kernels are compiled with that know all of visible points but their materials."""
        return self._lobe_defines | self._gathered_defines("GATHERED_LOBES")

    @property
    def _lobe_defines(self) -> dict[str, int | float]:
        defines: dict[str, int | float]
        defines = {"EYE": 1, "LOBES": 1} | self._tangent_defines if self.lobes else {}
        defines |= {"TWO_LOBES": 1} if self.lobes > 1 else {}
        defines |= self._layer_defines
        defines |= self._kind_defines
        defines |= {"EYE": 1} | self.rays("camera") if self.visibility else {}
        return defines | ({"WEIGHED": 1} if self.weighed else {})

    @cached_property
    def gather_defines(self) -> Defines:
        """What kernels are compiled with that know of gathered lobes, where there are any."""
        bent = {"NORMALS": 1} if self.programs.normals else {}
        return {**(self.eye_defines if self.gathered_lobes else {}), **bent}

    @cached_property
    def direct_defines(self) -> Defines:
        """What kernels of shadow rays are compiled with: no lamp is seen in delta lobes."""
        broad = any(not lobe_kinds()[kind].is_delta for kind in self.lobe_kinds)
        defines = {"SHADOW_RAYS": self.shadow_rays}
        defines |= {"DRAWN": self.drawn_rays} if self.drawn_rays else {}
        defines |= {"PORTALS": MOST_PORTALS} if self.portals else {}
        defines |= {"SMOOTH": 1} if self.smooth or self.programs.normals else {}
        if any(lobe_kinds()[kind].is_two_sided for kind in self.lobe_kinds):
            defines |= {"TWO_SIDED": 1}
        # What a lobe gathers matters where rays and shadow rays share a light alone.
        by_lobes = {"SHADOW_RAYS_BY_LOBES": 1} if self.by_lobes else {}
        tells = self._point_defines if self.weighed or by_lobes else self._lobe_defines
        of_lobes = {**tells, **by_lobes} if broad else {}
        normals = {"NORMALS": 1} if self.programs.normals else {}
        shadow = {**self.illuminance_defines, **self.rays("shadow"), **normals}
        shadow |= self.walk_defines | ({"SHADED_LAMPS": 1} if self.shaded_lamps else {})
        shadow |= {"LINKED": 1} if self.linked else {}
        return {**defines, **self.light_defines, **of_lobes, **shadow, **self.shadow_filter_defines}

    @property
    def by_lobes(self) -> bool:
        """Whether shadow rays go to the world by lobes that gather photons, too."""
        return self.gathered_lobes and any(light_kinds()[x].is_world for x in self.light_kinds)

    def asking(self, kinds: Iterable[str], drawn_rays: int) -> SceneNeeds:
        """What shadow rays need that go to lights of these kinds alone; so many are drawn."""
        asked = frozenset(kinds)
        portals = self.portals and any(light_kinds()[kind].is_world for kind in asked)
        return replace(self, light_kinds=asked, portals=portals, drawn_rays=drawn_rays)

    @cached_property
    def light_defines(self) -> Defines:
        """What kernels that ask lights are compiled with."""
        profiles = {"PROFILES": 1} if self.profiles else {}
        area = light_kinds()["area"].number
        gobos = {"GOBOS": 1, "ENVIRONMENT": 1, "AREA_LIGHT": area} if self.gobos else {}
        triangle = light_kinds()[TRIANGLE]
        uneven = self.emission_programs.nodes and triangle.name in self.light_kinds
        shares = {"EMISSION_SHARES": 1, "TRIANGLE_LIGHT": triangle.number} if uneven else {}
        return {**light_defines(self.light_kinds), **profiles, **gobos, **shares}

    @cached_property
    def emitted_defines(self) -> Defines:
        """What the kernel that finds lights is compiled with."""
        defines = {**self.direct_defines, **({"EMISSIVE": 1} if self.emissive else {})}
        defines |= {"EMISSION_BY_PROGRAMS": 1} if self.emission_programs.nodes else {}
        defines |= {"RAYS_APART": 1} if self.rays_apart else {}
        shadow = {"PANES", "MEDIA"}
        for name in shadow if self.weighed else {*shadow, "TWO_SIDED", "PORTALS"}:
            defines.pop(name, None)
        defines |= self.media_defines | ({"GLOWING": 1} if self.glowing else {})
        return defines | ({"SURFACES": 1} if self.emissive or self.weighed else {})

    @cached_property
    def surface_emission_defines(self) -> Defines:
        """What the kernel is compiled with that tells eye rays what surfaces emit."""
        return {"EYE": 1, **self.emission_programs.defines, **self.transparent_defines}

    def shade_defines(self, portals: Defines) -> Defines:
        """What Shade is compiled with besides where photons go through portals: it draws their way,
        too, where what lies over Lambert's lobe is weighed by that."""
        return portals if self.covers or self.layers else {}

    @cached_property
    def photon_defines(self) -> Defines:
        """What kernels of photons are compiled with. A photon meets one lobe besides Lambert's."""
        defines: dict[str, int | float]
        defines = {"PHOTONS": 1, "LOBES": 1} | self._tangent_defines if self.lobes else {}
        defines |= self._layer_defines
        defines |= ({"MEDIA": 1} if self.carries_medium else {}) | self._scattering_defines
        defines |= {"LIGHT_STARTS": 1} if self.media else {}
        defines |= self._pane_defines
        defines |= self._kind_defines
        if self.visibility and self.first_hits:
            defines |= {"FIRST_HITS": 1}
        defines |= self._caustic_free_defines
        if self.visibility or self.directions or self.panes:
            defines |= {"INCOMING": 1}
        defines |= {"CONSERVING": 1, "TINTED": 1} if self.too_bright and self.lobes else {}
        defines |= {"SHADED_LAMPS": 1} if self.shaded_lamps else {}
        defines |= self.rays(*RAYS) | (BLEND if self.gathered_lobes else {})
        defines |= {"DIRECTIONS": 1} if self.directions else {}
        defines |= self.caustic_defines
        return {
            **defines,
            **self.arrival_defines,
            **self.programs.defines,
            **self._footprint(PHOTONS_FARTHER),
        }

    @property
    def _caustic_free_defines(self) -> dict[str, int]:
        return {"NO_CAUSTICS": self.no_caustics} if self.no_caustics else {}

    @cached_property
    def media_defines(self) -> dict[str, int | float]:
        """What kernels of the eye's rays are compiled with where there are media."""
        return {"MEDIA": 1, **self._scattering_defines} if self.media else {}

    @property
    def _scattering_defines(self) -> dict[str, int | float]:
        if not self.scattering:
            return {}
        varying = {"VARYING": 1} if self.varying else {}
        return {"SCATTERING": 1, "PHASE": lobe_kinds()[PHASE].number, **varying}

    def flight_defines(self, whose: str) -> Defines:
        """What the kernel is compiled with that ends ways in media, of EYE or PHOTONS."""
        walks = self.walk_defines if whose == "EYE" else {}
        dispersion = {"DISPERSION": 1} if self.disperses else {}
        return {whose: 1, **self.media_defines, **walks, **dispersion}

    @property
    def carries_medium(self) -> bool:
        """Whether photons carry what they are in."""
        return self.media or self.panes

    @property
    def _pane_defines(self) -> dict[str, int | float]:
        return {"PANES": 1} if self.panes else {}

    @property
    def emits_by_cosine(self) -> bool:
        """Whether photons of some lights leave a surface by the cosine."""
        return any(light_kinds()[kind].emits_by_cosine for kind in self.light_kinds)

    @property
    def shades_long(self) -> bool:
        """Whether the device shades photons apart from tracing them."""
        return bool(self.programs.nodes) or self.layers > 0

    def rays(self, *names: str) -> dict[str, int]:
        """What a kernel is compiled with that traces rays of these names, if it makes a difference:
        their bits."""
        return {"VISIBILITY": sum(RAY_BITS[name] for name in names)} if self.visibility else {}

    @property
    def rays_of_chains(self) -> dict[str, int]:
        """The same of secondary rays from the eye, each of which says what it is."""
        return {**self.rays(*RAYS), "BY_REACH": 1} if self.visibility else {}

    @property
    def directions(self) -> bool:
        """Whether photons say where they came from: who gathers them asks for it."""
        return self.gathered_lobes or self.programs.normals

    def _gathered_defines(self, whose: str) -> dict[str, int | float]:
        seen = SEEN_BLEND if self.seen_send_rays else {}
        return {whose: 1, **BLEND, **seen} if self.gathered_lobes else {}

    @cached_property
    def arrival_defines(self) -> Defines:
        """What kernels of photons that land are compiled with."""
        linked = {"LINKED": 1} if self.linked else {}
        return {"ARRIVALS": 1, **linked, **light_defines(self.light_kinds)} if self.arrivals else {}

    @cached_property
    def camera_defines(self) -> Defines:
        """What kernels of the camera are compiled with."""
        lens = {"LENS": 1} if self.lens else {}
        return lens | ({"PANORAMIC": 1} if self.panorama else {})

    @property
    def projects(self) -> bool:
        """Whether places of the scene have one place on the screen, where splats are drawn, which
        know no normals but the mesh's."""
        return not (self.lens or self.panorama or self.programs.normals)

    @property
    def _kind_defines(self) -> dict[str, int | float]:
        some = any(lobe_kinds()[kind].transmits for kind in self.lobe_kinds)
        found: dict[str, int | float] = {"TRANSMITS": 1} if some else {}
        found |= {"DISPERSION": 1} if self.disperses else {}
        known = sorted(self.lobe_kinds & {SUBSURFACE, TRANSPARENT})
        return found | {name.upper(): lobe_kinds()[name].number for name in known}

    @property
    def walk_defines(self) -> dict[str, int]:
        """What kernels of the eye's rays are compiled with where they walk below surfaces."""
        walks = SUBSURFACE in self.lobe_kinds and self.secondary_rays and self.chain_depth > 0
        return {"WALKS": 1} if walks else {}

    @property
    def disperses(self) -> bool:
        """Whether paths have wavelengths."""
        return any(lobe_kinds()[kind].disperses for kind in self.lobe_kinds)

    @property
    def transparent(self) -> bool:
        """Whether light goes straight on through surfaces."""
        return TRANSPARENT in self.lobe_kinds

    @property
    def shadow_rays_go_on(self) -> bool:
        """Whether they may, behind what they have met."""
        return self.transparent or self.panes

    @property
    def shadow_filter_defines(self) -> dict[str, int | float]:
        """What kernels are compiled with that let shadow rays pass."""
        more = {**self._pane_defines, **self.media_defines}
        return {**self.transparent_defines, **self.shadow_programs.defines, **more}

    @property
    def transparent_defines(self) -> dict[str, int | float]:
        """What kernels are compiled with that know of that: the number of the kind."""
        return {TRANSPARENT.upper(): lobe_kinds()[TRANSPARENT].number} if self.transparent else {}

    @property
    def _layer_defines(self) -> dict[str, int | float]:
        layers: dict[str, int | float] = {"LAYERS": self.layers} if self.layers else {}
        return layers | ({"TINTED": 1} if self.tinted else {})

    @property
    def _tangent_defines(self) -> dict[str, int | float]:
        return {"TANGENTS": 1} if self.tangents else {}

    @cached_property
    def made(self) -> Made:
        """The includes that are made for the scene's kinds of lobes, lights and cameras."""
        return {
            **made_bsdf(self.lobe_kinds),
            **made_lights(self.light_kinds),
            **made_camera(self.camera_kind),
            **self.programs.made,
            **(made_spectrum() if self.disperses else {}),
        }

    @cached_property
    def surface_emission_made(self) -> Made:
        """Those of the kernel that tells what surfaces emit."""
        return {**self.made, **self.emission_programs.made}

    @cached_property
    def shadow_made(self) -> Made:
        """Those of kernels that let shadow rays pass."""
        return {**self.made, **self.shadow_programs.made}
