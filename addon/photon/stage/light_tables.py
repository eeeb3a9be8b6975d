# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as tables: lamps, emissive triangles, and their tree."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import TABLE_WIDTH, Device, Kernel, Stream, Table, Uniform, When
from ...streams.device import Layer
from ..kernels.lights import EXCLUDES, FOUND_BITS, IS_GLOW, IS_SOFT
from ..kernels.records import (
    FLUX,
    LIGHT,
    LIGHT_AXIS,
    LIGHT_HIGH,
    LIGHT_LOW,
)
from ..scene import GLOW, RGB, Light, Scene
from .emissive import Emission, triangle_lights
from .environments import Place
from .geometry import Frame, Mesh
from .kinds import WATTS, light_kinds, order
from .light_tree import AskedLights, Bounds, light_tree
from .media import MediaThere, from_afar
from .profiles import mean_of
from .switches import light_defines, made_lights
from .upload import Textures, texels_of, upload_table

LEAST_SHARE = 2.0**-22  # of photons that start at a light: sums below 1 are multiples of 2^-24
MOST_BY_LEAST = 0.1  # of photons, at lights of that share in all


def is_seen(light: Light) -> bool:
    """Whether any ray may meet the light itself."""
    found = "camera" in light.found_by or light.is_met_by_lobes
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
        row["found_by"] = sum(bits) + (IS_SOFT if light.parameters.get("soft") else 0)
        row["found_by"] += IS_GLOW * (light.kind == GLOW) + EXCLUDES * light.excludes
        if light.gobo is not None:
            row["gobo"], row["gobo_width"], row["gobo_height"] = places[light.gobo]
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
    """Let photons start at the lights of a table with these probabilities, or a little more where
    float32 would tell less than LEAST_SHARE from none: such a light, too, shall be found."""
    least = min(LEAST_SHARE, MOST_BY_LEAST / len(shares))
    if (shares[shares > 0.0] < least).any():
        shares = np.where(shares > 0.0, np.maximum(shares, least), 0.0)
        shares = shares / shares.sum()
    table["cdf"] = np.minimum(np.cumsum(shares), 1.0)
    last = np.flatnonzero(shares)[-1]
    table["cdf"][last:] = 1.0
    # What numbers of float32 between two of them draw: of a million lights not the share itself.
    table["chosen"] = np.diff(table["cdf"], prepend=np.float32(0.0))


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
    device: Device, layer: Layer, lights: NDArray[Any], asked: NDArray[np.int64], more: Textures
) -> tuple[Any, Any]:
    """The tree of a table's lights but those that are asked, and their places; see light_tree."""
    flux = flux_of(device, layer, lights, more).mean(axis=1).astype(np.float64)
    flux[lights["chosen"] == 0.0] = 0.0  # it lights nothing
    return light_tree(bounds_of(device, layer, lights, flux, more), asked)


def bounds_of(
    device: Device,
    layer: Layer,
    lights: NDArray[Any],
    flux: NDArray[np.float64],
    more: Textures,
) -> Bounds:
    """Where the lights of a table are, and where they shine; `flux`: how much each does."""
    found = _of_each(BoundsOfLights, device, layer, lights, more)
    low, high, axis = (of_one.astype(np.float64) for of_one in found)
    return Bounds(low[:, :3], high[:, :3], axis[:, :3], low[:, 3], high[:, 3], flux)


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


def _rank(lamp: Light) -> tuple[bool, int, bool]:
    return *order(light_kinds()[lamp.kind]), not is_seen(lamp)


def lights_of(
    device: Device,
    layer: Layer,
    scene: Scene,
    frame: Frame,
    mesh: Mesh,
    emission: Emission,
    places: tuple[Place, ...],
    more: Textures,
) -> tuple[tuple[Light, ...], NDArray[Any]]:
    """The lamps that emit, distant ones first, then by kind, and of each those that are seen first;
    and the table of LIGHT, one at least: theirs and that of triangles."""
    scatter = MediaThere.of(scene, scene.materials).scattering
    left = (x.where_media(scatter) for x in from_afar(scene.emitters, scene.air))
    lamps = tuple(sorted((lamp for lamp in left if lamp.found_by), key=_rank))
    bounds = float(np.linalg.norm(mesh.extent))
    of_mesh = triangle_lights(scene, mesh, emission)
    if not lamps and not len(of_mesh):
        return lamps, light_table(lamps, frame, bounds)
    of_lamps = light_table(lamps, frame, bounds, places)[: len(lamps)]
    flux = flux_of(device, layer, joined(of_lamps, of_mesh), more)
    shines = (flux[: len(lamps)] > 0.0).any(axis=1)  # a cone without width does not
    if not bounds:  # nothing is lit
        shines |= [light_kinds()[lamp.kind].is_distant for lamp in lamps]
    flux[: len(lamps)] *= np.array([[lamp.is_asked] for lamp in lamps]).reshape(-1, 1)
    kept = np.concatenate([shines, np.ones(len(of_mesh), bool)])
    lamps = tuple(lamp for lamp, is_on in zip(lamps, shines, strict=True) if is_on)
    of_lamps = light_table(lamps, frame, bounds, places)  # their profiles lie one after the other
    lights = joined(of_lamps[: len(lamps)], of_mesh)
    if not len(lights):
        lights = of_lamps
    choose_lights(lights, flux[kept])
    return lamps, lights


def light_trees(
    device: Device, layer: Layer, lights: NDArray[Any], asked: AskedLights, more: Textures
) -> dict[str, NDArray[Any]]:
    """The tables of a tree of lights, where some are drawn by one."""
    if not asked.drawn:
        return {}
    nodes, places = tree_of(device, layer, lights, asked.lights, more)
    return {"light_nodes": nodes, "light_places": places}
