# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and spaces as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.records import (
    MATERIAL,
    MATERIAL_LOBE,
    SPACE,
)
from ..scene import TRANSPARENT, Lobe, Material, Scene, reflecting
from .geometry import Frame
from .kinds import lobe_kinds
from .panes import pane_of
from .programs import Compiled


def material_tables(
    materials: tuple[Material, ...], programs: Sequence[Compiled], metre: float = 1.0
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(M,) of MATERIAL and (L,) of MATERIAL_LOBE, one at least of each; `programs`: of each
    material; `metre`: what lengths are multiplied by."""
    lobes = [reflecting(material.lobes) for material in materials]
    table = MATERIAL.zeros(max(len(materials), 1))
    of_lobes = MATERIAL_LOBE.zeros(max(sum(map(len, lobes)), 1))
    first = 0
    for row, material, own, program in zip(table, materials, lobes, programs, strict=False):
        row["albedo"], row["first_lobe"], row["lobes"] = material.diffuse, first, len(own)
        row["emission"] = material.emission
        row["holdout"] = float(material.holdout)
        row["shades_lamps"] = float(material.filters_no_lamps)
        row["first_instruction"], row["instructions"] = program.first, len(material.program)
        row["first_constant"], row["shape"] = program.first_constant, program.shape
        row["albedo_from"] = program.codes(material.varying, "diffuse")
        row["normal_from"] = program.codes(material.varying, "normal")
        row["base_from"] = program.codes(material.varying, "base")
        row["emission_from"] = program.codes(material.varying, "emission")
        _fill_transmittance(row, own, program)
        row["pane"], row["pane_colour"] = pane_of(material) or (0.0, (0.0, 0.0, 0.0))
        row["two_sided"] = any(lobe_kinds()[lobe.kind].is_two_sided for lobe in own)
        for lobe_row, lobe in zip(of_lobes[first : first + len(own)], own, strict=True):
            _fill_lobe(lobe_row, lobe, program, metre)
        first += len(own)
    return table, of_lobes


def _fill_transmittance(row: Any, lobes: Sequence[Lobe], program: Compiled) -> None:
    """What a row of MATERIAL says of a material's transparent lobes: what a program gives of one,
    or else what all do together."""
    for lobe in lobes:
        if lobe.kind == TRANSPARENT:
            row["transmittance"] += lobe.weight * np.array(lobe.colour)
            code = program.codes(lobe.varying, "colour")
            row["transmittance_from"] = code or row["transmittance_from"]


def _fill_lobe(row: Any, lobe: Lobe, program: Compiled, metre: float) -> None:
    """A row of MATERIAL_LOBE."""
    kind = lobe_kinds()[lobe.kind]
    row["colour"], row["kind"] = lobe.colour, kind.number
    row["weight"], row["covered"] = lobe.weight, lobe.covered
    row["over"] = 0.0 if lobe.over is None else lobe.over + 1.0
    codes: dict[str, Any] = {}  # of parameters, colours as often as they have channels
    for name, value in lobe.parameters.items():
        code = program.codes(lobe.varying, name)
        codes[name] = _of_channels(lobe, name, program) if isinstance(value, tuple) else code
    for suffix, values, scale in (("", lobe.parameters, metre), ("_from", codes, 1.0)):
        numbers = [*kind.numbers(values, scale), *[0.0] * 8]
        row[f"parameters{suffix}"], row[f"more{suffix}"] = np.resize(numbers, (2, 4))
    for name in ("colour", "covered", "weight"):
        row[f"{name}_from"] = program.codes(lobe.varying, name)


def _of_channels(lobe: Lobe, name: str, program: Compiled) -> tuple[float, ...]:
    """What refers to each channel of a colour that the program may give."""
    if name not in lobe.varying or lobe.varying[name].part != "xyzw":
        return (program.codes(lobe.varying, name),) * 3
    return tuple(program.code(replace(lobe.varying[name], part=part)) for part in "xyz")


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
