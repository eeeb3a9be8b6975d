# SPDX-License-Identifier: GPL-3.0-or-later
"""Which caustics a scene asks for, and who casts some."""

from __future__ import annotations

import bpy
import numpy as np

from ...photon.scene import CAUSTICS, SUBSURFACE, TRANSPARENT, Lobe, Material, Scene
from ...photon.stage.gathered import GATHERED_FROM
from ...photon.stage.kinds import lobe_kinds
from .report import Notes

MOST_NAMES = 12  # in a line
LEAST = 0.1  # head-on, of what a caster reflects: varnish is none


def caustics_of(scene: bpy.types.Scene, materials: list[Material], notes: Notes) -> tuple[str, ...]:
    """Those that the scene's switches leave on; what the others take away is noted."""
    cycles = getattr(scene, "cycles", None)
    wanted = tuple(name for name in CAUSTICS if getattr(cycles, f"caustics_{name}", True))
    owner = f"Scene '{scene.name}'"
    for name in CAUSTICS:
        if name not in wanted:
            what = "off: no light comes to diffuse surfaces by such lobes"
            notes.exact(owner, f"{name.capitalize()} caustics", what)
    if len(wanted) == 1:  # else glass is left out as a whole
        _note_glass(owner, wanted[0], [x for material in materials for x in material.lobes], notes)
    return wanted


def _note_glass(owner: str, wanted: str, lobes: list[Lobe], notes: Notes) -> None:
    """Write down what is not exact by glass where caustics of one kind alone are wanted."""
    glass = [lobe for lobe in lobes if _refracts(lobe)]
    layered = any(lobe.may_be("covered") or lobe.over is not None for lobe in lobes)
    if glass and layered and wanted == "refractive":
        what = (
            "what lies below gloss lights diffuse surfaces through glass as if there was no gloss"
        )
        notes.approximated(owner, "Reflective caustics", what)
    # Lambert's is no such lobe, nor do walks below a surface send any.
    sends = any(lobe_kinds()[x.kind].is_diffuse for x in lobes if x.kind != SUBSURFACE)
    if sends and any(not lobe_kinds()[lobe.kind].is_delta for lobe in glass):
        what = (
            "rays that Translucent and rough diffuse BSDFs send see rough glass lit from both sides"
        )
        notes.approximated(owner, "Caustics", what)


def note_casters(owner: str, scene: Scene, is_blurred: bool, notes: Notes) -> None:
    """Write in one line which objects cast caustics, and by which materials; `is_blurred`: Cycles
    makes casters rougher for diffuse rays."""
    if not scene.lights and not any(material.emits for material in scene.materials):
        return
    pairs = np.unique(np.stack([scene.surface, scene.material], -1), axis=0).tolist()
    told: list[str] = []
    for verb, switch, casts in (
        ("refracts", "refractive", _refracts),
        ("reflects", "reflective", _reflects),
    ):
        by: dict[str, dict[str, None]] = {}
        for surface, number in pairs if switch in scene.caustics else ():
            material = scene.materials[number]
            if any(casts(lobe) for lobe in material.lobes if lobe.reflects):
                by.setdefault(scene.surfaces[surface], {})[material.name] = None
        told += [f"'{name}' {verb} by {_listed(materials)}" for name, materials in by.items()]
    if told:
        rest = len(told) - MOST_NAMES
        more = [f"and {rest} more"] if rest > 0 else []
        notes.exact(owner, "Caustics", "; ".join([*told[:MOST_NAMES], *more]))
    if told and is_blurred:
        notes.ignored(owner, "Filter Glossy", "caustics are as sharp as what casts them")


def _listed(names: dict[str, None]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _refracts(lobe: Lobe) -> bool:
    kind = lobe_kinds()[lobe.kind]
    return kind.transmits and not kind.is_diffuse and lobe.kind != TRANSPARENT


def _reflects(lobe: Lobe) -> bool:
    """Whether it is so sharp that it is followed by rays, and no varnish."""
    kind = lobe_kinds()[lobe.kind]
    if kind.transmits or kind.is_diffuse or lobe.roughness[0] >= GATHERED_FROM:
        return False
    return "colour" in lobe.varying or bool(lobe.reflected_head_on().max() >= LEAST)
