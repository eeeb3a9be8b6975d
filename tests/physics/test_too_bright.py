# SPDX-License-Identifier: GPL-3.0-or-later
"""Lobes that together reflect more than they receive: photons, which bounce until they are
absorbed, meet no more than all of it; the eye sees them as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from addon.photon.scene import (
    Instruction,
    Lobe,
    Material,
    Result,
    phong,
    point_light,
    sun_light,
)
from addon.streams import Device
from tests.measure import fallen, render, rendered
from tests.scenes import Builder, camera, plain_material

BACKENDS = ["fragment", "native", pytest.param("compute", marks=pytest.mark.thorough)]


def by_nodes(material: Material) -> Material:
    """The same, of which a program gives the diffuse albedo and the first lobe's colour."""
    program = tuple(
        Instruction("combine", (*((x,) * 4 for x in colour), (1.0,) * 4))
        for colour in (material.diffuse, material.lobes[0].colour)
    )
    first = Lobe(material.lobes[0].kind, (1.0,) * 3, dict(material.lobes[0].parameters))
    varied = Lobe(first.kind, first.colour, first.parameters, varying={"colour": Result(1)})
    lobes = (varied, *material.lobes[1:])
    return Material("nodes", (0.5,) * 3, lobes, program=program, varying={"diffuse": Result(0)})


def indirect(device: Device, material: Material, **settings: Any) -> Any:
    """Mean of a closed room."""
    built = Builder().box((-1, -1, -1), (1, 1, 1), 0)
    lamp = point_light("lamp", (0.2, 0.1, 0.3), (10.0,) * 3)
    scene = built.scene(camera((0, -0.9, 0), (0, 0, 0), 60), (lamp,), (material,))
    settings = {"passes": 2, "photons": 4000, "mirror_depth": 1} | settings
    image = render(device, scene, width=16, height=16, **settings)["Indirect"]
    return image.astype(float).mean(axis=(0, 1))[:3]


@pytest.mark.stability(29)
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "diffuse, colour",
    (
        ((0.8, 0.8, 0.8), (0.8, 0.8, 0.8)),
        ((0.9, 0.2, 0.1), (0.9, 0.1, 0.2)),  # in the mean of channels they do not gain
        ((0.3, 0.3, 0.3), (0.2, 0.4, 0.3)),
    ),
)
def test_closed_rooms_by_numbers_and_by_nodes(
    device: Device, monkeypatch: Any, backend: str, diffuse: Any, colour: Any
) -> None:
    """Photons fill a room as they do one of halves; by nodes as by numbers."""
    monkeypatch.setattr(device, "prefers_native", backend == "native")
    total = np.maximum(np.add(diffuse, colour), 1.0)
    material = plain_material("room", diffuse, colour, 4.0)
    scaled = plain_material("scaled", np.divide(diffuse, total), np.divide(colour, total), 4.0)
    found = indirect(device, material, backend=backend)
    nodes = indirect(device, by_nodes(material), backend=backend)
    expected = indirect(device, scaled, backend=backend)
    # The eye sees all of Lambert's albedo, and of the lobe's: each more than the room of halves.
    assert (found >= expected * 0.99).all() and (found <= expected * total * 1.01).all()
    assert nodes == pytest.approx(found, rel=5e-3)


def test_what_goes_straight_on_is_not_scaled(device: Device) -> None:
    """Direct light below such a sheet by photons is as by shadow rays."""
    lobes = (phong((0.6, 0.6, 0.6)), Lobe("transparent", (0.7, 0.5, 0.3)))
    sheet = Material("sheet", (0.5, 0.5, 0.5), lobes)
    built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), 1)
    built.quad((-2, -2, 0.5), (2, -2, 0.5), (2, 2, 0.5), (-2, 2, 0.5), 0)
    sun = sun_light("sun", (2.0,) * 3, (0.3, 0.2, -1.0))
    dim = plain_material("floor", (0.01,) * 3)
    scene = built.scene(camera((0, -1.5, 0.2), (0, 0, 0.1), 40), (sun,), (sheet, dim))
    found = []
    for by_photons in (False, True):
        settings: Any = {"passes": 8, "photons": 40000, "direct_by_photons": by_photons}
        image = render(device, scene, width=16, height=16, **settings)["Direct"]
        found.append(image.astype(float)[8:, :, :3].mean(axis=(0, 1)))
    assert found[1] == pytest.approx(found[0], rel=0.02)


def test_sheets_in_a_room_make_no_noise(device: Device) -> None:
    """Photons that pass such sheets carry no more than the same of lobes that share."""
    found = []
    for reflected, straight in ((0.9, 0.7), (0.15, 0.7)):
        mirror, clear = phong((reflected,) * 3), Lobe("transparent", (straight,) * 3)
        sheet = Material("sheet", (reflected,) * 3, (mirror, clear))
        built = Builder().box((-1, -1, -1), (1, 1, 1), 0)
        for z in (-0.6, -0.3, 0.0, 0.3):
            built.quad((-1, -1, z), (1, -1, z), (1, 1, z), (-1, 1, z), 1)
        lamp = point_light("lamp", (0.2, 0.1, 0.5), (10.0,) * 3)
        walls = plain_material("walls", (0.7,) * 3)
        scene = built.scene(camera((0, -0.9, 0), (0, 0, 0), 60), (lamp,), (walls, sheet))
        settings: Any = {"width": 8, "height": 8, "photons": 2000, "direct_by_photons": True}
        fluxes = []
        for seed in range(6):
            with rendered(device, scene, seed=seed, **settings) as renderer:
                fluxes.append(fallen(renderer)[0][0])
        found.append((np.mean(fluxes), np.std(fluxes) / np.mean(fluxes)))
    assert found[0][1] < 0.08 and found[0][0] == pytest.approx(found[1][0], rel=0.08)


def test_sheen_beside_what_reflects(device: Device) -> None:
    """What is bright at grazing angles alone: light in a closed room of it is bounded, too."""
    sheen = Lobe("sheen", (1.0,) * 3, {"roughness": 1.0})
    room = Material("room", (0.8,) * 3, (sheen,))
    assert room.may_be_too_bright and not room.is_too_bright
    white = plain_material("white", (1.0,) * 3)
    assert indirect(device, room).max() < 1.5 * indirect(device, white).max()
