# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's properties and the renderer's settings say the same."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import get_args

import bpy
import pytest

from addon.blender import properties
from addon.blender.export import SpecularModel
from addon.blender.settings import settings_from
from addon.photon.settings import BackendName, Estimator, Filter, Settings, SplatShape

pytestmark = pytest.mark.blender

BLEND_SCENES = Path(__file__).resolve().parents[2] / "blend_scenes"

# Set by the frame, the region and the film, or of no use in Blender.
NOT_PROPERTIES = {"width", "height", "region", "first_pass", "transparent", "caller_bytes"}
NOT_PROPERTIES |= {"transparent_depth", "volume_bounces"}
# Asked for by passes.
NOT_PROPERTIES |= {"caustics", "illuminance", "denoising_data", "mist"}
# Cycles' properties, as the fixture's scene has them.
OF_CYCLES = {
    "pixel_filter": "blackman_harris",
    "pixel_width": 1.5,
    "exposure": 1.0,
    "clamp_direct": 0.0,
    "clamp_indirect": 0.0,
}


def test_defaults_agree(scene) -> None:
    settings, default = settings_from(scene, (512, 512)), Settings()
    for field in fields(Settings):  # Blender keeps numbers as float32
        expected = getattr(default, field.name)
        expected = OF_CYCLES.get(field.name, expected)
        if isinstance(expected, float):
            expected = pytest.approx(expected, rel=1e-7)
        assert getattr(settings, field.name) == expected


def test_every_setting_has_a_property(scene) -> None:
    names = {field.name for field in fields(Settings)} - NOT_PROPERTIES - OF_CYCLES.keys()
    assert names <= set(scene.photon_stream.bl_rna.properties.keys())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("passes", 7),
        ("radius_decay", 0.5),
        ("seed", 3),
        ("estimator", "SPLAT"),
        ("backend", "COMPUTE"),
        ("filter", "CONE"),
        ("splat_shape", "POINT"),
        ("photon_bounces", 5),
        ("boundary_correction", False),
        ("direct_by_photons", True),
        ("denoise", True),
        ("device_index", 1),
        ("time_limit", 2.5),
        ("min_passes", 12),
    ],
)
def test_each_property_arrives(scene, name, value) -> None:
    setattr(scene.photon_stream, name, value)
    settings = settings_from(scene, (512, 512))
    expected = value.lower() if isinstance(value, str) else value
    assert getattr(settings, name) == expected
    settings.check()


def test_old_names_are_kept(scene, tmp_path) -> None:
    """What an older file stored under another name."""
    settings = scene.photon_stream
    stored = settings
    if hasattr(settings, "bl_system_properties_get"):  # Blender 5
        stored = settings.bl_system_properties_get(do_create=True)
    stored["radius_shrink"] = 0.25
    stored["layer"] = 3
    settings.mirror_depth = 3  # before it had a switch
    path = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    found = settings_from(bpy.context.scene, (512, 512))
    assert (found.radius_decay, found.backend, found.mirror_depth) == (0.25, "native", 3)


def test_fewer_min_passes_of_an_older_file(scene) -> None:
    """A stored value below today's least is not clamped by Blender."""
    scene.photon_stream.min_passes = 9  # so that it is stored
    try:
        stored = scene.bl_system_properties_get()["photon_stream"]
    except AttributeError:  # before Blender 5.0
        stored = scene.photon_stream
    stored["min_passes"] = 4
    assert scene.photon_stream.min_passes == 4
    settings_from(scene, (512, 512)).check()


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("BOX", "box"), ("GAUSSIAN", "gauss"), ("BLACKMAN_HARRIS", "blackman_harris")],
)
def test_the_film_is_that_of_cycles(scene, kind, expected) -> None:
    cycles = scene.cycles
    cycles.pixel_filter_type, cycles.filter_width, cycles.film_exposure = kind, 0.0, 0.0
    settings = settings_from(scene, (8, 8))
    settings.check()
    assert settings.pixel_filter == expected
    assert settings.pixel_width == pytest.approx(0.01) and settings.exposure == 0.0


def test_radius_needs_its_switch(scene) -> None:
    scene.photon_stream.radius = 0.25
    assert settings_from(scene, (8, 8)).radius == 0.0
    scene.photon_stream.use_radius = True
    assert settings_from(scene, (8, 8)).radius == 0.25


def test_photons_need_their_switch(scene) -> None:
    scene.photon_stream.photons = 1000
    assert settings_from(scene, (8, 8)).photons is None
    scene.photon_stream.use_photons = True
    assert settings_from(scene, (8, 8)).photons == 1000


def test_mirror_depth_needs_its_switch(scene) -> None:
    """Without, it is Cycles' Max Bounces."""
    scene.photon_stream.mirror_depth, scene.cycles.max_bounces = 3, 31
    assert settings_from(scene, (8, 8)).mirror_depth == 31
    scene.photon_stream.use_mirror_depth = True
    assert settings_from(scene, (8, 8)).mirror_depth == 3


def test_noise_threshold_needs_its_switch(scene) -> None:
    scene.photon_stream.noise_threshold = 0.5
    assert settings_from(scene, (8, 8)).noise_threshold == 0.0
    scene.photon_stream.use_noise_threshold = True
    assert settings_from(scene, (8, 8)).noise_threshold == 0.5


def test_animated_seed(scene) -> None:
    scene.photon_stream.use_animated_seed = True
    seeds = set()
    for frame in (1, 2):
        scene.frame_set(frame)
        seeds.add(settings_from(scene, (8, 8)).seed)
    assert len(seeds) == 2


@pytest.mark.parametrize(
    ("items", "kind"),
    [
        (properties.ESTIMATORS, Estimator),
        (properties.BACKENDS, BackendName),
        (properties.FILTERS, Filter),
        (properties.SPLAT_SHAPES, SplatShape),
    ],
)
def test_enum_items_are_the_settings(items, kind) -> None:
    assert tuple(item[0].lower() for item in items) == get_args(kind)
    assert [item[3] for item in items] == list(range(len(items)))


def test_specular_models_are_the_exporters(scene) -> None:
    """By the numbers that files store; a new scene is rendered as Cycles renders it."""
    items = properties.SPECULAR_MODELS
    assert [SpecularModel(item[0]) for item in items] == list(SpecularModel)
    assert [item[3] for item in items] == list(range(len(items)))
    assert SpecularModel(scene.photon_stream.specular_model) is SpecularModel.GGX


@pytest.mark.parametrize("path", sorted(BLEND_SCENES.glob("*.blend")), ids=lambda path: path.stem)
def test_our_scenes_keep_their_lobes(path) -> None:
    """Those whose glossy materials are the paper's say so; the others are as Cycles has them."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    paper = path.stem in ("cornell_box", "glossy_room")
    assert bpy.context.scene.photon_stream.specular_model == ("PHONG" if paper else "GGX")


def test_ranges_agree(scene) -> None:
    known = scene.photon_stream.bl_rna.properties
    for name in (
        "passes",
        "min_passes",
        "photons",
        "photon_bounces",
        "mirror_depth",
        "device_index",
    ):
        for value in (known[name].hard_min, known[name].hard_max):
            Settings(**{name: value}).check()
