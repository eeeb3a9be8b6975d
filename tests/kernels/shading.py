# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a material as Shade writes them, on a single triangle."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from addon.photon.kernels.records import CORNER_NORMALS, SPACE, TRIANGLE
from addon.photon.kernels.shade import Shade
from addon.photon.scene import Material
from addon.photon.stage.geometry import flags_of
from addon.photon.stage.material_tables import material_tables
from addon.photon.stage.programs import program_tables
from addon.photon.stage.switches import made_bsdf
from addon.streams import Made
from tests.kernels.conftest import Bench

SURFACE = 5
PHOTONS = {"PHOTONS": 1, "LOBES": 1}
EYE = {"EYE": 1, "LOBES": 1, "TWO_LOBES": 1}
BLACK = Material("black", (0.0, 0.0, 0.0))


def tables(material: Material) -> dict[str, NDArray[Any]]:
    """A triangle in z = 0 that wears the second of two materials."""
    triangle = TRIANGLE.zeros(1)
    triangle["a"][0, :2], triangle["b"][0, :2] = (-0.5, -0.5), (0.5, -0.5)
    triangle["c"][0, :2] = 0.0, 0.5
    triangle["material"], triangle["surface"] = 1, SURFACE
    normals = CORNER_NORMALS.zeros(1)
    for corner in "abc":
        normals[corner] = 0.0, 0.0, 1.0
    normals["flags"] = flags_of(material)
    both = (BLACK, material)
    programs = program_tables(both)
    materials, lobes = material_tables(both, programs.compiled)
    return {
        "instructions": programs.instructions,
        "constants": programs.constants,
        "spaces": SPACE.zeros(SURFACE + 2),
        "triangles": triangle,
        "corner_normals": normals,
        "materials": materials,
        "material_lobes": lobes,
    }


def made_for(material: Material) -> Made:
    """The kinds of lobes that it has."""
    return made_bsdf({lobe.kind for lobe in material.lobes})


def shade(
    bench: Bench,
    material: Material,
    inputs: dict[str, NDArray[Any]],
    uniforms: dict[str, Any],
    defines: dict[str, int | float],
) -> dict[str, Any]:
    """`inputs`, directions, hits and fluxes, and what Shade makes of them."""
    values = {"depth": 0, "frame_size": (Bench.WIDTH, Bench.WIDTH)}
    return inputs | bench.run(
        Shade, inputs, values | uniforms, tables(material), defines, made=made_for(material)
    )
