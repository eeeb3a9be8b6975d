# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as tables: what kernels read, in scene units (geometry.py)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property, partial
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Defines, Device
from ...streams.device import Layer
from ..kernels.lights import IS_ASKED
from ..kernels.records import PORTAL
from ..scene import Light, Scene
from .aims import Aims
from .emission import SAMPLES_OF_MOVED, emission_of
from .emissive import are_one_lamp
from .environments import Place, environment_table
from .geometry import Frame, Mesh
from .kinds import light_kinds
from .light_tables import bounds_of, count_distant, is_seen, light_trees, lights_of, set_shares
from .light_tree import AskedLights, asked_lights, groups_of, is_of_media, leaves_for
from .limits import knows_rays, limit_table, visibility_table
from .material_tables import material_tables, space_table
from .media import Media, beams
from .panes import pane_of
from .portals import (
    FACES,
    MOST_PORTALS,
    PORTALS_BY_SHARE_DEFINES,
    PORTALS_FOR_ABSORBED_DEFINES,
    WORLD_RAYS,
)
from .profiles import profile_table
from .programs import program_tables
from .upload import texels_of, upload_table, write_table

TEXELS = "texels"  # the table of all textures'
ASKED = "faces"  # that which is made when it is first asked for


def _surface_tables(
    scene: Scene, frame: Frame, mesh: Mesh, media: Media
) -> dict[str, NDArray[Any]]:
    """Triangles and what they are made of, by the tables' names."""
    programs = program_tables(scene.materials)
    materials, lobes = material_tables(scene.materials, programs.compiled, 1.0 / frame.scale)
    materials["interior"][: len(scene.materials)] = media.of_materials
    tables = {
        "triangles": mesh.triangles,
        "corner_normals": mesh.normals,
        "materials": materials,
        "material_lobes": lobes,
    }
    if media.count or any(map(pane_of, scene.materials)):  # behind which photons know what is
        tables["interiors"] = media.table
    if len(media.grids):
        tables["grids"], tables["voxels"] = media.grids, media.voxels
    if len(media.glows):
        tables["glows"] = media.glows
    if len(mesh.tangents):
        tables["corner_tangents"] = mesh.tangents
    if any(material.program for material in scene.materials):
        tables["instructions"], tables["constants"] = programs.instructions, programs.constants
        tables["spaces"] = space_table(scene, frame)
        if len(mesh.attributes):
            tables["corner_attributes"] = mesh.attributes
    return tables


def _wear(mesh: Mesh, of_material: Iterable[bool]) -> NDArray[np.bool_]:
    """(K,) which triangles of a mesh wear materials of a kind."""
    of_each = np.array([*of_material], bool)
    found: NDArray[np.bool_] = of_each[mesh.triangles["material"].astype(int)]
    return found


class Tables:
    """The scene's textures on a device."""

    def __init__(
        self,
        device: Device,
        textures: dict[str, moderngl.Texture],
        mesh: Mesh,
        emitters: tuple[Light, ...],
        lights: NDArray[Any],
        asked: AskedLights,
        places: tuple[Place, ...],
        media: Media,
    ) -> None:
        """`mesh`: whose triangles they hold; `emitters`: the lamps that emit; `lights`: of LIGHT,
        theirs and those of triangles, as the texture of that name holds them; `asked`: those that
        visible points ask; `places`: of the scene's images."""
        self._device, self.textures, self._places = device, textures, places
        self.media, self.beam_count = media, 0
        self._mesh = mesh
        self.emitters, self.lights, self.asked = emitters, lights, asked
        self.by_flux = lights["chosen"].astype(np.float64)  # as the scene has them
        self._flux_now = self._shares = self.by_flux

        self.aims: Aims | None = None
        self.portals = PORTAL.zeros(MOST_PORTALS)
        self.photon_portals = PORTAL.zeros(0)  # through which photons go on
        self._around = False  # these are faces of a box
        # How wide a pixel is to the eye, for photons that meet bumps: EyeCamera.widths.
        self.footprint: Mapping[str, tuple[float, ...]] = {}
        # (K,) which of the mesh's triangles are, which of these stop lamps, which are clear glass
        self.transparent = self.shades_lamps = self.clear = np.zeros(0, bool)
        seen = [number for number, lamp in enumerate(emitters) if is_seen(lamp)]
        self.seen_lights = max(seen, default=-1) + 1  # they are among these first ones
        self.distant_lights = count_distant(lights) if emitters else 0  # the first ones

    @cached_property
    def light_groups(self) -> list[NDArray[np.int64]]:
        """The lights that photons may start at, by what was close together at first."""
        middles = self.lights["position"].astype(np.float64)
        return groups_of(middles, self.by_flux, self.distant_lights)

    @property
    def light_leaves(self) -> int:
        """How many leaves the tree of lights has, if there is one."""
        return leaves_for(len(self.lights) - len(self.asked.lights))

    @staticmethod
    def upload(
        device: Device,
        layer: Layer,
        scene: Scene,
        frame: Frame,
        mesh: Mesh,
        reads_tree: bool = True,
        texels: Any = None,
    ) -> Tables:
        """Make them; `reads_tree`: whether tracers do; `texels`: of the scene's textures, if it has
        any, which stay the caller's."""
        environments, places = environment_table(scene.images)
        more = {"environments": upload_table(device, environments)} if places else {}
        media = Media(scene, frame)
        tables = _surface_tables(scene, frame, mesh, media)
        textures = {"nodes": upload_table(device, mesh.tree.nodes)} if reads_tree else {}
        textures |= {TEXELS: texels} if texels else {}
        textures |= {name: upload_table(device, texels_of(t)) for name, t in tables.items()}
        emission = emission_of(device, layer, mesh, scene, textures)
        emitters, lights = lights_of(device, layer, scene, frame, mesh, emission, places, more)
        flux = lights["chosen"].astype(np.float64)
        distant = count_distant(lights) if emitters else 0
        are_one = partial(are_one_lamp, lights)
        asked = asked_lights(flux, distant, is_of_media(lights), are_one)
        tables = {"lights": lights, **light_trees(device, layer, lights, asked, more)}
        if any(material.emits_by_program for material in scene.materials):
            tables["emission_shares"] = emission.table
        if knows_rays(scene, emitters):
            tables["visibility"] = visibility_table(scene)
            tables["light_limits"] = limit_table(emitters, len(lights))
        if any(light_kinds()[lamp.kind].is_world for lamp in emitters):
            tables["portals"] = PORTAL.zeros(MOST_PORTALS)
        if any(light.profile for light in emitters):
            tables["profiles"] = profile_table(emitters)
        textures |= more
        made = Tables(device, textures, mesh, emitters, lights, asked, places, media)
        tables |= made._light_media(layer, scene)
        textures |= {name: upload_table(device, texels_of(t)) for name, t in tables.items()}
        made._tell_passable(scene, mesh)
        return made

    def _tell_passable(self, scene: Scene, mesh: Mesh) -> None:
        self.transparent = _wear(mesh, (x.is_transparent for x in scene.materials))
        self.shades_lamps = _wear(mesh, (x.filters_no_lamps for x in scene.materials))
        self.clear = _wear(mesh, (pane_of(x) is not None for x in scene.materials))

    def around_eye(self, place: NDArray[np.float64]) -> NDArray[np.float32]:
        """Which media the camera (3,) [scene units] is in, (2,) as MEDIUM has it."""
        inside: NDArray[np.float32] = self.media.around(place[None], self._mesh, "camera")[0]
        return inside

    def choose(self, shares: NDArray[np.float64]) -> None:
        """Let photons start at lights with these probabilities; where emissive triangles have
        moved, with as much more as their flux has grown."""
        if shares is self._shares:
            return
        self._shares = shares
        set_shares(self.lights, self._shares_now())
        write_table(self.textures["lights"], texels_of(self.lights))

    def _shares_now(self) -> NDArray[np.float64]:
        if self._flux_now is self.by_flux:
            return self._shares
        there = self.by_flux > 0.0
        gain = np.divide(self._shares, self.by_flux, out=np.ones(len(there)), where=there)
        grown: NDArray[np.float64] = self._flux_now * gain
        return grown / grown.sum() if grown.any() else self._shares

    def move(
        self, layer: Layer, scene: Scene, now: Scene, frame: Frame, mesh: Mesh, relit: bool
    ) -> None:
        """Let triangles be where a mesh of the scene has them, as it is `now`; `relit`: some of
        those that have moved are emissive."""
        self._mesh = mesh
        self._tell_passable(scene, mesh)
        if ASKED in self.textures:
            self._device.put_back(self.textures.pop(ASKED))
        tables = {
            "triangles": mesh.triangles,
            "corner_normals": mesh.normals,
            "corner_tangents": mesh.tangents,
            "corner_attributes": mesh.attributes,
        }
        tables = {name: table for name, table in tables.items() if name in self.textures}
        if "spaces" in self.textures:
            tables["spaces"] = space_table(now, frame)
        for name, table in tables.items():
            self._renew(name, texels_of(table))
        if "nodes" in self.textures:
            self._renew("nodes", mesh.tree.nodes)
        if relit:
            self._relight(layer, scene, frame, mesh)
        for name, table in self._light_media(layer, scene).items():
            self._renew(name, texels_of(table))

    def _light_media(self, layer: Layer, scene: Scene) -> dict[str, NDArray[Any]]:
        """What media know of the lights, by the tables' names."""
        if not self.media.count:
            return {}
        lights, distant = self.lights, self.distant_lights
        tables = {"light_starts": self.media.starts(scene, lights, distant, self._mesh)}
        if self.media.scatters:
            more = {x: self.textures[x] for x in ("environments",) if x in self.textures}
            bounds = bounds_of(self._device, layer, lights, self._flux_now, more)
            tables["beams"] = beams(scene, lights, bounds, distant)
            self.beam_count = len(tables["beams"])
        return tables

    def _relight(self, layer: Layer, scene: Scene, frame: Frame, mesh: Mesh) -> None:
        """Let the emissive triangles be lights where they are now."""
        device, places = self._device, self._places
        more = {name: self.textures[name] for name in ("environments",) if places}
        emission = emission_of(device, layer, mesh, scene, self.textures, SAMPLES_OF_MOVED)
        _, self.lights = lights_of(device, layer, scene, frame, mesh, emission, places, more)
        self._flux_now = self.lights["chosen"].astype(np.float64)
        set_shares(self.lights, self._shares_now())
        tables = {
            "lights": self.lights,
            **light_trees(device, layer, self.lights, self.asked, more),
        }
        if "emission_shares" in self.textures:
            tables["emission_shares"] = emission.table
        for name, table in tables.items():
            self._renew(name, texels_of(table))

    def _renew(self, name: str, data: NDArray[np.float32]) -> None:
        texels, texture = data.reshape(-1, 4), self.textures[name]
        if texture.size[1] == max(1, -(-len(texels) // TABLE_WIDTH)):
            write_table(texture, texels)
        else:
            self._device.put_back(texture)
            self.textures[name] = upload_table(self._device, texels)

    def aim(self, aims: Aims | None) -> None:
        """Let photons start where aims say, or None: anywhere."""
        if aims is self.aims:
            return
        for name in ("light_aims", "aim_nodes"):
            if name in self.textures:
                self._device.put_back(self.textures.pop(name))
        self.aims = aims
        if aims:
            self.textures["light_aims"] = upload_table(self._device, texels_of(aims.lights))
            self.textures["aim_nodes"] = upload_table(self._device, texels_of(aims.nodes))

    def set_photon_portals(self, portals: NDArray[Any], around: bool = False) -> None:
        """Let photons go on from diffuse surfaces through portals, (n,) of PORTAL, or none;
        `around`: they are faces of a box about what is shown."""
        if (portals.tobytes(), around) == (self.photon_portals.tobytes(), self._around):
            return
        self.photon_portals, self._around = portals, around
        if (name := "photon_portals") in self.textures:
            self._device.put_back(self.textures.pop(name))
        if len(portals):
            found = PORTAL.zeros(FACES)
            found[: len(portals)] = portals
            self.textures[name] = upload_table(self._device, texels_of(found))

    def portal_defines(self, covers: bool) -> Defines:
        """What kernels of photons are compiled with besides, where these go on through portals;
        `covers`: something lies over Lambert's lobe."""
        if not len(self.photon_portals):
            return {}
        return PORTALS_BY_SHARE_DEFINES if self._around or covers else PORTALS_FOR_ABSORBED_DEFINES

    @property
    def faces_defines(self) -> Defines:
        """What kernels are compiled with that send photons through the faces of a box."""
        return PORTALS_BY_SHARE_DEFINES if self._around else {}

    @property
    def has_world(self) -> bool:
        """Whether there is one that lights."""
        return "portals" in self.textures

    @cached_property
    def world_light(self) -> int:
        """The number of the only world that shadow rays go to; -1: there is none, or several."""
        kinds = [kind.number for kind in light_kinds().values() if kind.is_world]
        asked = self.asked.lights
        found = self.lights["found_by"][asked].astype(int) & IS_ASKED > 0
        worlds = asked[found & np.isin(self.lights["kind"][asked], kinds)]
        return int(worlds[0]) if len(worlds) == 1 else -1

    @property
    def world_rays(self) -> int:
        """How many shadow rays of a point go to that one."""
        is_through = self.world_light >= 0 and bool((self.portals["width"] > 0.0).any())
        return WORLD_RAYS if is_through else 1

    def set_shadow_portals(self, portals: NDArray[Any]) -> None:
        """Let shadow rays go through portals, (n,) of PORTAL."""
        found = PORTAL.zeros(MOST_PORTALS)
        found[: len(portals)] = portals
        if found.tobytes() == self.portals.tobytes():
            return
        self.portals = found
        write_table(self.textures["portals"], texels_of(found))

    def starts(self) -> bytes:
        """How photons start at lights, where they are led, and how fine what they meet is, for
        comparison."""
        aims = self.aims.bytes() if self.aims else b""
        led = self.photon_portals.tobytes() + repr(self.footprint).encode()
        return self.lights["chosen"].tobytes() + aims + led

    def of(self, kernel: Any) -> dict[str, moderngl.Texture]:
        """Those tables that a kernel declares. That of faces is made for the first that does."""
        if ASKED in kernel.tables and ASKED not in self.textures:
            self.textures[ASKED] = upload_table(self._device, self._mesh.faces)
        return {name: self.textures[name] for name in kernel.tables if name in self.textures}

    def release(self) -> None:
        """Put the textures back."""
        for name, texture in self.textures.items():
            if name != TEXELS:
                self._device.put_back(texture)
