# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept: only what changed is made again, and the picture is a fresh render's to the bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.photons.deposits import HostDeposits
from addon.photon.photons.kept import Kept, same_but_view
from addon.photon.prepare import prepare
from addon.photon.scene import Scene
from addon.streams import Device
from tests.scenes import cornell, plain_light, plain_material
from tests.unit.kept_frames import ALL, SCENE_STEPS, SETTINGS, WAYS, moved, render, widened

# What few photons tell of where others shall start is asked for each view anew.
pytestmark = pytest.mark.usefixtures("not_aimed")
# Of SCENE_STEPS, by other backends than the native one: one of each kind of what is kept.
FEW_STEPS = {"camera", "object", "material", "nothing more"}
SETTING_STEPS: list[tuple[dict[str, Any], int]] = [  # changes, and passes of photons they take
    ({"width": 12, "height": 16}, 0),
    ({"region": (2, 3, 7, 9)}, 0),
    ({"radius": 0.5}, 0),
    ({"radius_decay": 1.0, "filter": "cone", "boundary_correction": False}, 0),
    ({"mirror_depth": 1, "transparent": True}, 0),
    ({"passes": 4}, 2),
    ({"first_pass": 3}, 1),
    ({"seed": 1}, ALL),
    ({"photons": 3000}, ALL),
    ({"photons": None}, ALL),
    ({"photons": None, "width": 80, "height": 60}, ALL),  # more pixels, so more photons
    ({"photons": None, "width": 60, "height": 80}, 0),
    ({"photon_bounces": 1}, ALL),
    ({"volume_bounces": 2}, ALL),
    ({"direct_by_photons": True}, ALL),
    ({}, ALL),
]
FEW_SETTINGS = ("region", "passes", "seed")  # where deposits stay on the device, likewise


@pytest.mark.thorough("compute-splat")
@pytest.mark.parametrize(("backend", "estimator", "on_host"), WAYS)
def test_scene_changes(
    device: Device,
    kept: Kept,
    monkeypatch: pytest.MonkeyPatch,
    backend: Any,
    estimator: Any,
    on_host: bool,
    thorough: bool,
) -> None:
    """One change after the other: photons are traced for those that they meet, and no others."""
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    settings = replace(SETTINGS, backend=backend, estimator=estimator)
    scene = cornell(mirror=True)
    assert render(device, scene, settings, kept).traced == ALL
    pictures = [b""]
    for name, change, retraced in SCENE_STEPS:
        if not (backend == "native" or thorough or name in FEW_STEPS):
            continue
        scene = change(scene)
        frame, fresh = render(device, scene, settings, kept), render(device, scene, settings)
        assert frame.traced == (ALL if retraced else 0), name
        assert fresh.traced == ALL
        assert frame.images == fresh.images, name
        assert frame.info == fresh.info and frame.info["unfinished_photons"] > 0, name
        assert (frame.images["Combined"] == pictures[-1]) == (name == "nothing more"), name
        pictures.append(frame.images["Combined"])


@pytest.mark.thorough("False")
@pytest.mark.parametrize("on_host", [True, False])
def test_settings_changes(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch, on_host: bool, thorough: bool
) -> None:
    if not on_host and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    base = SETTINGS if on_host else replace(SETTINGS, backend="compute")
    scene = cornell(mirror=True, lobe=True)
    render(device, scene, base, kept)
    for changes, traced in SETTING_STEPS:
        if not (on_host or thorough or next(iter(changes), "photons") in FEW_SETTINGS):
            continue
        settings = replace(base, **changes)
        frame, fresh = render(device, scene, settings, kept), render(device, scene, settings)
        assert frame.traced == traced, changes
        assert frame.images == fresh.images and frame.info == fresh.info, changes


def test_layers_keep_their_own(device: Device, kept: Kept) -> None:
    """On GPUs their photons differ by rounding."""
    for backend in ("native", "fragment", "native"):
        settings = replace(SETTINGS, backend=backend)  # type: ignore[arg-type]
        frame = render(device, cornell(), settings, kept)
        assert frame.traced == ALL
        assert frame.images == render(device, cornell(), settings).images


def test_animation_traces_photons_once(device: Device, kept: Kept) -> None:
    """24 frames with a still light; then the light moves."""
    settings = replace(SETTINGS, backend="fragment")
    launches: list[dict[str, int]] = []
    for frame in range(25):
        scene = moved(cornell(), 0.05 * frame)
        renderer = prepare(scene if frame < 24 else widened(scene, 0.1), settings, device, kept)
        for _ in range(settings.passes):
            renderer.render_pass()
        launches.append(renderer.launches())
        renderer.release()
    for stem in ("generator", "projector", "reflector"):
        assert launches[0][stem] == launches[24][stem] > 0
        assert [counts[stem] for counts in launches[1:24]] == [0] * 23
    assert launches[0]["generator"] == ALL
    # Eye rays are traced in every frame.
    assert all(counts["tracer"] == settings.passes for counts in launches[1:24])


def test_dropped_photons_are_counted_again(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Deposits that are not finite fall out once, and show in each render's account."""
    append = HostDeposits.append

    def spoil(self: HostDeposits, place: Any, deposit: Any, *more: Any) -> None:
        fluxes = deposit.download()
        y, x = np.argwhere(place.download()[..., 3] != 0)[10]
        fluxes[y, x, 1] = np.nan
        deposit.upload(fluxes)
        append(self, place, deposit, *more)

    settings = replace(SETTINGS, backend="fragment")
    monkeypatch.setattr(HostDeposits, "append", spoil)
    frames = [render(device, moved(cornell(), x), settings, kept) for x in (0.0, 0.0, 1.0)]
    assert [frame.traced for frame in frames] == [ALL, 0, 0]
    dropped = {frame.info["dropped_photons"] for frame in frames}
    assert len(dropped) == 1 and dropped.pop() >= SETTINGS.passes


def test_same_but_view() -> None:
    scene = cornell()
    other = cornell()
    assert same_but_view(scene, other)
    for name, change, retraced in SCENE_STEPS:
        assert same_but_view(scene, change(other)) != retraced, name
    nan = scene.vertices.copy()
    nan[0] = np.nan
    assert same_but_view(replace(scene, vertices=nan), replace(scene, vertices=nan.copy()))
    assert not same_but_view(replace(scene, vertices=nan), scene)
    assert not same_but_view(scene, replace(scene, surfaces=(*scene.surfaces, "more")))
    assert not same_but_view(scene, replace(scene, lights=()))
    assert not same_but_view(scene, replace(scene, triangles=scene.triangles[:-1]))


@pytest.mark.parametrize("where", ["light", "material", "vertex", "parameter"])
def test_zeros_have_signs(where: str) -> None:
    """-0.0 == 0.0, but a frame about an axis (0, 0, -0.0) is another."""

    def scene(zero: float) -> Scene:
        signed = dict.fromkeys(("light", "material", "vertex", "parameter"), 0.0) | {where: zero}
        made = cornell()
        vertices = made.vertices.copy()
        vertices[0] = signed["vertex"]
        light = plain_light("l", "SPOT", (0, 0, 0), (1, 1, 1), (1.0, 0.0, signed["light"]))
        light = replace(light, parameters={**light.parameters, "radius": signed["parameter"]})
        material = plain_material("m", (0.5, signed["material"], 0.5))
        return replace(
            made, vertices=vertices, lights=(light,), materials=(material, *made.materials)
        )

    assert scene(0.0).lights == scene(-0.0).lights and scene(0.0).materials == scene(-0.0).materials
    assert same_but_view(scene(-0.0), scene(-0.0))
    assert not same_but_view(scene(0.0), scene(-0.0))
