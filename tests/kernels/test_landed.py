# SPDX-License-Identifier: GPL-3.0-or-later
"""Few photons with their numbers are those of a pass, however they are traced."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.photons.importance import importance_of
from addon.photon.photons.landed import mean_flux, trace_few
from addon.photon.photons.mapper import Mapper, PhotonBatch
from addon.photon.photons.view import View
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.settings import Settings
from addon.streams import Device
from tests.physics.test_glass import glass
from tests.scenes import Builder, camera, cornell, plain_light, plain_material

SETTINGS = Settings(width=8, height=8, photons=3000, seed=5)


def mapper_of(renderer: Renderer) -> Mapper:
    assert renderer.photons
    return renderer.photons.mapper


@pytest.mark.parametrize("way", ["fragment", "compute", "resident", "native"])
def test_numbers_and_first_hits(device: Device, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if way == "resident":
        monkeypatch.setattr(device, "prefers_native", False)
    backend: Any = "compute" if way == "resident" else way
    scene, settings = cornell(mirror=True, lobe=True), replace(SETTINGS, backend=backend)
    renderer = prepare(scene, settings, device)
    few = trace_few(mapper_of(renderer), 3, 3000)
    mapper_of(renderer).start(PhotonBatch(3, 3000))
    bounced = mapper_of(renderer).finish().count
    renderer.release()
    # The photons that a pass has, if direct light is deposited, too.
    renderer = prepare(scene, replace(settings, direct_by_photons=True), device)
    mapper_of(renderer).start(PhotonBatch(3, 3000))
    place, deposit = mapper_of(renderer).finish().arrays()
    np.testing.assert_array_equal(few.places, place)
    np.testing.assert_array_equal(few.facing, deposit[:, 3])
    np.testing.assert_array_equal(few.flux, mean_flux(deposit))
    renderer.release()
    assert 1000 < few.first == len(place) - bounced
    bounces = np.split(few.numbers, np.flatnonzero(np.diff(few.numbers) <= 0) + 1)
    assert len(bounces) > 3 and len(bounces[0]) == few.first  # each photon's once
    for later, earlier in zip(bounces[2:], bounces[1:], strict=False):
        assert len(later) < len(earlier)
    other: Any = "native" if way != "native" else "fragment"
    renderer = prepare(scene, replace(settings, backend=other), device)
    others = trace_few(mapper_of(renderer), 3, 3000)
    renderer.release()
    first, their_first = (one.numbers[: one.first] for one in (few, others))
    assert len(np.setxor1d(first, their_first)) <= 2  # by rounding, at edges


def test_no_first_hit_lands(device: Device) -> None:
    """Of a lamp in a glass ball."""
    built = Builder().sphere((0, 0, 2), 0.3, 0, "ball", subdivisions=3)
    built.quad((-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0), 1, "floor")
    grey, lamp = (
        plain_material("grey", (0.5,) * 3),
        plain_light("lamp", "POINT", (0, 0, 2), (9,) * 3),
    )
    scene = built.scene(camera((0, -7, 3), (0, 0, 1), 50), (lamp,), (glass(), grey))
    renderer = prepare(scene, SETTINGS, device)
    few = trace_few(mapper_of(renderer), 3, 3000)
    renderer.release()
    assert few.first == 0 and len(few.places) > 300


def test_direct_light_counts_where_photons_bring_it(device: Device) -> None:
    """Of the photons that land on what is shown some have not bounced."""
    scene = cornell(mirror=False)
    renderer = prepare(scene, SETTINGS, device)
    mapper, tables = mapper_of(renderer), renderer._device_scene.tables
    few = trace_few(mapper, 3, 3000)
    view = View(0.01, None, few.places[:, :3].astype(float), *np.ones((2, len(few.places))))
    found = [
        importance_of(mapper, tables, view, 5, 3, 3000, 1.0, direct) for direct in (False, True)
    ]
    renderer.release()
    by_others, by_all = (len(importance.mass) for importance in found if importance)
    assert by_others == len(np.unique(few.numbers[few.first :]))
    assert by_all == len(np.unique(few.numbers)) > by_others
