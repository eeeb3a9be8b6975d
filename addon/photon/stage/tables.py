# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as tables: what kernels read, in scene units (geometry.py)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Device, Kernel, Stream, Table, Uniform, When
from ...streams.device import Layer
from ..errors import SceneError
from ..kernels.records import (
    FLUX,
    LIGHT,
    LIGHT_AXIS,
    LIGHT_HIGH,
    LIGHT_LOW,
    MATERIAL,
    MATERIAL_LOBE,
    SPACE,
)
from ..scene import FOUND_BY, RGB, TRANSPARENT, Light, Lobe, Material, Scene, reflecting
from .aims import Aims
from .environments import Place, environment_table
from .geometry import Frame, Mesh
from .glow import mean_glow, triangle_lights
from .kinds import WATTS, light_defines, light_kinds, lobe_kinds, made_lights
from .light_tree import MOST_ASKED, Bounds, light_tree
from .limits import knows_rays, limit_table, visibility_table
from .profiles import mean_of, profile_table
from .programs import Compiled, program_tables

Textures = dict[str, moderngl.Texture]
TEXELS = "texels"  # the table of all textures'

# Bits of a light's found_by in GLSL (lib/light.glsl).
FOUND_BITS = {name: 1 << bit for bit, name in enumerate(FOUND_BY)}
IS_WORLD = 1 << len(FOUND_BY)
IS_SOFT = 2 * IS_WORLD


def is_seen(light: Light) -> bool:
    """Whether any ray may meet the light itself."""
    found = "camera" in light.found_by or "chains" in light.found_by
    return found and light_kinds()[light.kind].is_met(light.parameters)


def light_table(
    lights: tuple[Light, ...], frame: Frame, bounds: float = 0.0, places: tuple[Place, ...] = ()
) -> NDArray[Any]:
    """(L,) of LIGHT, one at least; which of them photons start at is not said yet. `bounds`: the
    radius of a sphere about the scene [scene units]; `places`: of its images."""
    table = LIGHT.zeros(max(len(lights), 1))
    kinds = light_kinds()
    for row, light in zip(table, lights, strict=False):
        kind = kinds[light.kind]
        axis = np.asarray(light.direction, np.float64)
        row["position"] = frame.points(light.position)
        row["kind"] = kind.number
        row["axis"] = axis / np.linalg.norm(axis)
        row["across"] = _across(axis, light.across)
        row["power"] = np.asarray(light.power) / (frame.scale**2 if kind.power == WATTS else 1.0)
        numbers = kind.numbers(light.parameters, 1.0 / frame.scale, bounds, places)
        row["parameters"], row["more"] = np.resize([*numbers, *[0.0] * 8], (2, 4))
        bits = [FOUND_BITS[name] for name in light.found_by]
        more = (IS_WORLD if kind.is_world else 0) + (IS_SOFT if light.parameters.get("soft") else 0)
        row["found_by"] = sum(bits) + more
        row["falloff"], row["smoothing"] = light.falloff, light.smoothing / frame.scale**2
        # The distance is one of scene units, and the profile's mean 1.
        row["power"] *= frame.scale**light.falloff * mean_of(light)
    profiles = [np.shape(light.profile) if light.profile else (0, 0) for light in lights]
    table["rows"][: len(lights)], table["columns"][: len(lights)] = np.reshape(profiles, (-1, 2)).T
    sizes = np.prod(np.reshape(profiles, (-1, 2)), axis=1)
    table["first"][: len(lights)] = np.cumsum(sizes) - sizes
    return table


def _across(axis: NDArray[np.float64], across: RGB) -> NDArray[np.float64]:
    """`across` made perpendicular to an axis, and unit; any such if it goes along."""
    axis = axis / np.linalg.norm(axis)
    for given in (across, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        beside = np.asarray(given, np.float64) - np.dot(given, axis) * axis
        if np.linalg.norm(beside) > 1e-6 * np.linalg.norm(given):
            break
    unit: NDArray[np.float64] = beside / np.linalg.norm(beside)
    return unit


def choose_lights(table: NDArray[Any], flux: NDArray[Any]) -> None:
    """Let photons start at the lights of a table by their fluxes (L, 3)."""
    power = np.zeros(len(table))
    power[: len(flux)] = flux.mean(axis=1)
    if power.sum() > 0:
        set_shares(table, power / power.sum())


def set_shares(table: NDArray[Any], shares: NDArray[np.float64]) -> None:
    """Let photons start at the lights of a table with these probabilities."""
    table["cdf"] = np.minimum(np.cumsum(shares), 1.0)
    last = np.flatnonzero(shares)[-1]
    table["cdf"][last:] = 1.0
    # What numbers of float32 between two of them draw: of a million lights not the share itself.
    table["chosen"] = np.diff(table["cdf"], prepend=np.float32(0.0))


def material_tables(
    materials: tuple[Material, ...], programs: Sequence[Compiled]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(M,) of MATERIAL and (L,) of MATERIAL_LOBE, one at least of each; `programs`: of each
    material."""
    lobes = [reflecting(material.lobes) for material in materials]
    table = MATERIAL.zeros(max(len(materials), 1))
    of_lobes = MATERIAL_LOBE.zeros(max(sum(map(len, lobes)), 1))
    first = 0
    for row, material, own, program in zip(table, materials, lobes, programs, strict=False):
        row["albedo"], row["first_lobe"], row["lobes"] = material.diffuse, first, len(own)
        row["emission"] = material.emission
        row["holdout"] = float(material.holdout)
        row["first_instruction"], row["instructions"] = program.first, len(material.program)
        row["first_constant"], row["shape"] = program.first_constant, program.shape
        row["albedo_from"] = program.codes(material.varying, "diffuse")
        row["normal_from"] = program.codes(material.varying, "normal")
        row["base_from"] = program.codes(material.varying, "base")
        row["emission_from"] = program.codes(material.varying, "emission")
        _fill_transmittance(row, own, program)
        row["two_sided"] = any(lobe_kinds()[lobe.kind].is_two_sided for lobe in own)
        for lobe_row, lobe in zip(of_lobes[first : first + len(own)], own, strict=True):
            _fill_lobe(lobe_row, lobe, program)
        first += len(own)
    return table, of_lobes


def _fill_transmittance(row: Any, lobes: Sequence[Lobe], program: Compiled) -> None:
    """What a row of MATERIAL says of the one transparent lobe that a material has."""
    for lobe in lobes:
        if lobe.kind == TRANSPARENT:
            row["transmittance"] = lobe.weight * np.array(lobe.colour)
            row["transmittance_from"] = program.codes(lobe.varying, "colour")


def _fill_lobe(row: Any, lobe: Lobe, program: Compiled) -> None:
    """A row of MATERIAL_LOBE."""
    kind = lobe_kinds()[lobe.kind]
    row["colour"], row["kind"] = lobe.colour, kind.number
    row["weight"], row["covered"] = lobe.weight, lobe.covered
    row["over"] = 0.0 if lobe.over is None else lobe.over + 1.0
    codes: dict[str, Any] = {}  # of parameters, colours as often as they have channels
    for name, value in lobe.parameters.items():
        code = program.codes(lobe.varying, name)
        codes[name] = (code,) * 3 if isinstance(value, tuple) else code
    for suffix, values in (("", lobe.parameters), ("_from", codes)):
        numbers = [*kind.numbers(values), *[0.0] * 8]
        row[f"parameters{suffix}"], row[f"more{suffix}"] = np.resize(numbers, (2, 4))
    for name in ("colour", "covered", "weight"):
        row[f"{name}_from"] = program.codes(lobe.varying, name)


def space_table(scene: Scene, frame: Frame) -> NDArray[Any]:
    """(1 + S,) of SPACE: world space, and each surface's object's."""
    table = SPACE.zeros(1 + len(scene.objects))
    to_world = np.eye(4)
    to_world[:3] = np.column_stack((frame.scale * np.eye(3), frame.centre))
    rows = np.concatenate([np.eye(4)[None, :3], scene.objects[:, :3]]) @ to_world
    table["x"], table["y"], table["z"] = np.moveaxis(rows, 1, 0)
    table["colour"][1:] = scene.objects[:, 3]
    table["location"][1:], table["random"][1:] = scene.objects[:, 4, :3], scene.objects[:, 4, 3]
    table["index"][1:] = scene.objects[:, 5, 0]
    return table


def texels_of(table: NDArray[Any]) -> NDArray[np.float32]:
    """A table's elements as float32 (..., 4)."""
    return table.view(np.float32).reshape(-1, 4)


def upload_table(device: Device, data: NDArray[Any]) -> moderngl.Texture:
    """`data` (..., 4) float32 or (n,) uint32 as a texture TABLE_WIDTH texels wide."""
    texels = data.reshape(-1, 4) if data.dtype == np.float32 else data.reshape(-1, 1)
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    if rows > device.texture_limit:
        raise SceneError(
            f"{len(texels)} table entries do not fit a texture of {device.name} "
            f"({TABLE_WIDTH * device.texture_limit} at most)"
        )
    kind = "f4" if data.dtype == np.float32 else "u4"
    texture: moderngl.Texture = device.texture((TABLE_WIDTH, rows), texels.shape[1], kind)
    write_table(texture, texels)
    return texture


def write_table(texture: moderngl.Texture, texels: NDArray[Any]) -> None:
    """Write texels (n, channels) from a table's beginning; what is left of the last row is 0."""
    whole = len(texels) // TABLE_WIDTH
    if whole:
        texture.write(texels[: whole * TABLE_WIDTH], viewport=(0, 0, TABLE_WIDTH, whole))
    if whole < texture.size[1]:
        rest = np.zeros((TABLE_WIDTH, texels.shape[1]), texels.dtype)
        rest[: len(texels) - whole * TABLE_WIDTH] = texels[whole * TABLE_WIDTH :]
        texture.write(rest, viewport=(0, whole, TABLE_WIDTH, 1))


def kinds_of(lights: NDArray[Any]) -> set[str]:
    """Those of a table's lights."""
    numbers = set(lights["kind"])
    return {name for name, kind in light_kinds().items() if kind.number in numbers}


class LightFlux(Kernel):
    """The flux that each light emits."""

    stem = "light_flux"
    structure = ("ENVIRONMENT",)
    outputs = {"flux": FLUX}
    uniforms = {"light_count": Uniform("int")}
    tables = {"lights": Table(LIGHT), "environments": When("ENVIRONMENT", Table())}


class BoundsOfLights(Kernel):
    """Where each light is, and where it shines."""

    stem = "light_bounds"
    outputs = {"low": LIGHT_LOW, "high": LIGHT_HIGH, "axis": LIGHT_AXIS}
    uniforms = {"light_count": Uniform("int")}
    structure = ("ENVIRONMENT",)
    tables = {"lights": Table(LIGHT), "environments": When("ENVIRONMENT", Table())}


def flux_of(
    device: Device, layer: Layer, lights: NDArray[Any], more: Textures
) -> NDArray[np.float32]:
    """What the lights of a table emit, (L, 3) [W / scene units^2]; `more`: the other tables that
    lights ask."""
    (flux,) = _of_each(LightFlux, device, layer, lights, more)
    return flux[:, :3]


def tree_of(
    device: Device, layer: Layer, lights: NDArray[Any], extent: float, more: Textures
) -> tuple[Any, Any]:
    """The tree of a table's lights, of which the distant ones are the first, and their places in
    it; see light_tree."""
    flux = flux_of(device, layer, lights, more).mean(axis=1).astype(np.float64)
    flux[lights["chosen"] == 0.0] = 0.0  # it lights nothing
    found = _of_each(BoundsOfLights, device, layer, lights, more)
    low, high, axis = (of_one.astype(np.float64) for of_one in found)
    bounds = Bounds(low[:, :3], high[:, :3], axis[:, :3], low[:, 3], high[:, 3], flux)
    first = count_distant(lights)
    return light_tree(bounds.at(np.s_[first:]), flux[:first], extent)


def joined(*tables: NDArray[Any]) -> NDArray[Any]:
    """Tables of LIGHT as one; numpy's own joints lose what fills a record up to whole texels."""
    table, first = LIGHT.zeros(sum(map(len, tables))), 0
    for part in tables:
        table[first : first + len(part)] = part
        first += len(part)
    return table


def count_distant(lights: NDArray[Any]) -> int:
    """How many of a table's lights are: the first ones."""
    numbers = [kind.number for kind in light_kinds().values() if kind.is_distant]
    return int(np.isin(lights["kind"], numbers).sum())


def _of_each(
    kind: type[Kernel], device: Device, layer: Layer, lights: NDArray[Any], more: Textures
) -> list[NDArray[np.float32]]:
    """A kernel's outputs, run once for each light of a table, (L, 4) each."""
    kinds, count = kinds_of(lights), len(lights)
    kernel = kind(device, layer, light_defines(kinds), made=made_lights(kinds))
    table = upload_table(device, texels_of(lights))
    size = min(count, TABLE_WIDTH), -(-count // TABLE_WIDTH)
    own = {name: of_one for name, of_one in more.items() if name in kernel.tables}
    streams = {name: Stream(device, record, size) for name, record in kernel.outputs.items()}
    kernel.run(streams, {"lights": table, **own}, {"light_count": count})
    found = [stream.download().reshape(-1, 4)[:count] for stream in streams.values()]
    for stream in streams.values():
        stream.release()
    kernel.release()
    device.put_back(table)
    return found


def _rank(lamp: Light) -> tuple[bool, bool]:
    return not light_kinds()[lamp.kind].is_distant, not is_seen(lamp)


def lights_of(
    device: Device,
    layer: Layer,
    scene: Scene,
    frame: Frame,
    mesh: Mesh,
    glow: NDArray[np.float64],
    places: tuple[Place, ...],
    more: Textures,
) -> tuple[tuple[Light, ...], NDArray[Any]]:
    """The lamps that emit, distant ones first and then those that are seen; and the table of LIGHT,
    one at least: theirs and that of triangles, which glow with a radiance (n, 3)."""
    lamps = tuple(sorted(scene.emitters, key=_rank))
    bounds = float(np.linalg.norm(mesh.extent))
    of_mesh = triangle_lights(scene, mesh, glow)
    if not lamps and not len(of_mesh):
        return lamps, light_table(lamps, frame, bounds)
    of_lamps = light_table(lamps, frame, bounds, places)[: len(lamps)]
    flux = flux_of(device, layer, joined(of_lamps, of_mesh), more)
    shines = (flux[: len(lamps)] > 0.0).any(axis=1)  # a cone without width does not
    if not bounds:  # nothing is lit
        shines |= [light_kinds()[lamp.kind].is_distant for lamp in lamps]
    flux[: len(lamps)] *= np.array([[lamp.lights_surfaces] for lamp in lamps]).reshape(-1, 1)
    kept = np.concatenate([shines, np.ones(len(of_mesh), bool)])
    lamps = tuple(lamp for lamp, is_on in zip(lamps, shines, strict=True) if is_on)
    of_lamps = light_table(lamps, frame, bounds, places)  # their profiles lie one after the other
    lights = joined(of_lamps[: len(lamps)], of_mesh)
    if not len(lights):
        lights = of_lamps
    choose_lights(lights, flux[kept])
    return lamps, lights


def light_trees(
    device: Device, layer: Layer, lights: NDArray[Any], mesh: Mesh, more: Textures
) -> dict[str, NDArray[Any]]:
    """The tables of a tree of lights, where there are enough for one."""
    if len(lights) <= MOST_ASKED:
        return {}
    nodes, places = tree_of(device, layer, lights, float(np.linalg.norm(mesh.extent)), more)
    return {"light_nodes": nodes, "light_places": places}


def _surface_tables(scene: Scene, frame: Frame, mesh: Mesh) -> dict[str, NDArray[Any]]:
    """Triangles and what they are made of, by the tables' names."""
    programs = program_tables(scene.materials)
    materials, lobes = material_tables(scene.materials, programs.compiled)
    tables = {
        "triangles": mesh.triangles,
        "corner_normals": mesh.normals,
        "materials": materials,
        "material_lobes": lobes,
    }
    if len(mesh.tangents):
        tables["corner_tangents"] = mesh.tangents
    if any(material.program for material in scene.materials):
        tables["instructions"], tables["constants"] = programs.instructions, programs.constants
        tables["spaces"] = space_table(scene, frame)
        if len(mesh.attributes):
            tables["corner_attributes"] = mesh.attributes
    return tables


class Tables:
    """The scene's textures on a device."""

    def __init__(
        self,
        device: Device,
        textures: dict[str, moderngl.Texture],
        emitters: tuple[Light, ...],
        lights: NDArray[Any],
        places: tuple[Place, ...] = (),
    ) -> None:
        """`emitters`: the lamps that emit; `lights`: of LIGHT, theirs and those of triangles, as
        the texture of that name holds them; `places`: of the scene's images."""
        self._device, self.textures, self._places = device, textures, places
        self.emitters, self.lights = emitters, lights
        self.by_flux = lights["chosen"].astype(np.float64)  # as the scene has them
        self._flux_now = self._shares = self.by_flux

        self.aims: Aims | None = None
        seen = [number for number, lamp in enumerate(emitters) if is_seen(lamp)]
        self.seen_lights = max(seen, default=-1) + 1  # they are among these first ones
        self.distant_lights = count_distant(lights) if emitters else 0  # the first ones

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
        """Make them; `reads_tree`: whether kernels do; `texels`: of the scene's textures, if it has
        any, which stay the caller's."""
        environments, places = environment_table(scene.images)
        more = {"environments": upload_table(device, environments)} if places else {}
        tables = _surface_tables(scene, frame, mesh)
        textures = {"nodes": upload_table(device, mesh.tree.nodes)} if reads_tree else {}
        textures |= {TEXELS: texels} if texels else {}
        textures |= {name: upload_table(device, texels_of(t)) for name, t in tables.items()}
        glow = mean_glow(device, layer, mesh, scene, textures)
        emitters, lights = lights_of(device, layer, scene, frame, mesh, glow, places, more)
        tables = {"lights": lights, **light_trees(device, layer, lights, mesh, more)}
        if knows_rays(scene, emitters):
            tables["visibility"] = visibility_table(scene)
            tables["light_limits"] = limit_table(emitters, len(lights))
        if any(light.profile for light in emitters):
            tables["profiles"] = profile_table(emitters)
        textures |= {name: upload_table(device, texels_of(t)) for name, t in tables.items()}
        textures |= more
        return Tables(device, textures, emitters, lights, places)

    def choose(self, shares: NDArray[np.float64]) -> None:
        """Let photons start at lights with these probabilities; where triangles that glow have
        moved, with as much more as their flux has grown."""
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
        those that have moved glow."""
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

    def _relight(self, layer: Layer, scene: Scene, frame: Frame, mesh: Mesh) -> None:
        """Let the triangles that glow be lights where they are now."""
        device, places = self._device, self._places
        more = {name: self.textures[name] for name in ("environments",) if places}
        glow = mean_glow(device, layer, mesh, scene, self.textures)
        _, self.lights = lights_of(device, layer, scene, frame, mesh, glow, places, more)
        self._flux_now = self.lights["chosen"].astype(np.float64)
        set_shares(self.lights, self._shares_now())
        tables = {"lights": self.lights, **light_trees(device, layer, self.lights, mesh, more)}
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

    def starts(self) -> bytes:
        """How photons start at lights, for comparison."""
        return self.lights["chosen"].tobytes() + (self.aims.bytes() if self.aims else b"")

    def of(self, kernel: Any) -> dict[str, moderngl.Texture]:
        """Those tables that a kernel declares."""
        return {name: self.textures[name] for name in kernel.tables if name in self.textures}

    def release(self) -> None:
        """Put the textures back."""
        for name, texture in self.textures.items():
            if name != TEXELS:
                self._device.put_back(texture)
