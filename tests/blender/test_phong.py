# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's lobes in place of Cycles' closures."""

from __future__ import annotations

import bpy
import pytest

from addon.blender.export import SpecularModel
from addon.photon.scene import MIRROR

from .build import features, shader_material
from .lobes import (
    BLACK,
    GLASS,
    GLOSSY,
    GOLD,
    METALLIC,
    PHONG,
    PRINCIPLED,
    RED,
    exponent,
    near,
    needs_metallic,
    specular,
)

pytestmark = pytest.mark.blender


def test_sharp_glossy_is_an_exact_mirror(convert) -> None:
    for model in SpecularModel:
        material, report = convert(shader_material(GLOSSY, Color=RED, Roughness=0.0), model)
        assert material.diffuse == BLACK
        assert specular(material) == near(RED[:3])
        assert exponent(material) == MIRROR
        assert features(report, "exact") == ["Shader"]
        bpy.data.objects.remove(bpy.data.objects["Plane"])


def test_rough_glossy_is_a_phong_lobe(convert) -> None:
    material, report = convert(shader_material(GLOSSY, Color=RED, Roughness=0.5), PHONG)
    assert exponent(material) == pytest.approx(2.0 / 0.5**4 - 2.0)
    assert features(report, "approximated") == ["Roughness 0.5"]


def test_hardly_rough_glossy_is_a_mirror_and_says_so(convert) -> None:
    material, report = convert(shader_material(GLOSSY, Roughness=0.01), PHONG)
    assert exponent(material) == MIRROR
    assert features(report, "approximated") == ["Roughness 0.01"]


@pytest.mark.parametrize(
    ("inputs", "diffuse", "reflected"),
    [
        ({"Metallic": 1.0}, 0.0, 0.5),
        ({"Specular_IOR_Level": 0.0}, 0.5, 0.0),
        ({}, 0.5 * (1 - 0.04), 0.04),
        ({"Metallic": 0.5}, 0.25 * (1 - 0.04), 0.25 + 0.02),
        ({"IOR": 2.0}, 0.5 * (1 - 1 / 9), 1 / 9),
    ],
)
def test_principled_as_phong(convert, inputs, diffuse, reflected) -> None:
    grey = (0.5, 0.5, 0.5, 1.0)
    node = {"Base_Color": grey, "IOR": 1.5, "Metallic": 0.0, "Roughness": 0.5} | inputs
    material, report = convert(shader_material(PRINCIPLED, **node), PHONG)
    assert material.diffuse == pytest.approx((diffuse,) * 3, abs=1e-6)
    assert specular(material) == pytest.approx((reflected,) * 3, abs=1e-6)
    if reflected:
        assert "Principled reflection" in features(report, "approximated")
        assert exponent(material) == pytest.approx(30.0)
    else:
        assert features(report, "exact") == ["Shader"]


@needs_metallic
def test_metallic_as_phong(convert) -> None:
    material, report = convert(shader_material(METALLIC, Base_Color=GOLD, Roughness=0.5), PHONG)
    assert (material.diffuse, specular(material)) == (BLACK, near(GOLD[:3]))
    assert exponent(material) == pytest.approx(30.0)
    assert "Metal" in features(report, "approximated")


@pytest.mark.parametrize("model", SpecularModel)
def test_glass_is_the_same_in_either_model(convert, model) -> None:
    material, report = convert(shader_material(GLASS, Color=RED, IOR=2.0, Roughness=0.5), model)
    assert [lobe.kind for lobe in material.lobes] == ["ggx_glass"]
    assert features(report, "exact") == ["Shader"]
