# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of colours on a sheet."""

from __future__ import annotations

from .node_cases import COLOUR, OTHER, Build, Case, U, V, node, scaled, three

MIX, OLD_MIX, HUE = "ShaderNodeMix", "ShaderNodeMixRGB", "ShaderNodeHueSaturation"
BLENDS = (
    *("MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY"),
    *("SOFT_LIGHT", "LINEAR_LIGHT", "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE"),
    *("SATURATION", "COLOR", "VALUE"),
)
BEYOND = scaled(U, -0.5, 1.5)
CONSTANT = (0.8, 0.3, 0.1, 1.0)
# Colours beyond what a screen shows.
STRONG = three(scaled(U, -0.4, 1.8), V, scaled(V, 1.5, -0.2))


def _mix(share: object, a: object = COLOUR, b: object = OTHER, **options: object) -> Build:
    of = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}[str(options["data_type"])]
    by_channel = options.get("factor_mode") == "NON_UNIFORM"
    factor = "Factor_Vector" if by_channel else "Factor_Float"
    inputs = {factor: share, f"A_{of}": a, f"B_{of}": b}
    return node(MIX, inputs, f"Result_{of}", **options)


def _colours(blend: str) -> tuple[Case, ...]:
    """With a share that is constant and one that is not, and of constants alone but one."""
    plain = {"data_type": "RGBA", "blend_type": blend, "clamp_factor": True}
    ends = (-1.0, 2.0) if blend in ("SUBTRACT", "ADD", "DIVIDE", "LINEAR_LIGHT") else (0.0, 1.0)
    return (
        Case(f"Mix: {blend} whole", _mix(1.0, **plain), *ends),
        Case(f"Mix: {blend} partly", _mix(scaled(V, 0.2, 0.8), **plain), *ends),
        Case(f"Mix: {blend} of constants", _mix(U, CONSTANT, (0.4, 0.6, 0.7, 1.0), **plain), *ends),
    )


def _constant(build: Build) -> Build:
    """Constants that are folded, made to vary by what follows."""
    inputs = {"Factor_Float": U, "A_Color": build, "B_Color": (0.0, 0.2, 0.4, 1.0)}
    return node(MIX, inputs, "Result_Color", data_type="RGBA")


def _folded(blend: str) -> Case:
    inputs = {0: 0.7, 1: CONSTANT, 2: (0.4, 0.6, 0.7, 1.0)}
    built = _constant(node(OLD_MIX, inputs, blend_type=blend))
    return Case(f"Mix: folded {blend}", built, -0.5, 1.5)


def _hue(name: str, colour: object = COLOUR, **inputs: object) -> Case:
    return Case(f"Hue/Saturation: {name}", node(HUE, {**inputs, "Color": colour}), 0.0, 1.6)


def _modes(mode: str) -> tuple[Case, ...]:
    separate, combine = "ShaderNodeSeparateColor", "ShaderNodeCombineColor"
    constant = _constant(node(combine, {0: 0.15, 1: 0.6, 2: 0.7}, mode=mode))
    return (
        *(
            Case(f"Separate Color: {mode} {i}", node(separate, {0: COLOUR}, i, mode=mode))
            for i in range(3)
        ),
        Case(f"Combine Color: {mode}", node(combine, {0: U, 1: V, 2: 0.6}, mode=mode)),
        Case(
            f"Combine Color: {mode} beyond",
            node(combine, {0: scaled(U, -0.3, 1.3), 1: 0.8, 2: V}, mode=mode),
        ),
        Case(f"Combine Color: {mode} folded", constant),
    )


CONTRAST = "ShaderNodeBrightContrast"
CASES = (
    *(case for blend in BLENDS for case in _colours(blend)),
    *map(_folded, BLENDS),
    Case("Mix: beyond", _mix(BEYOND, data_type="RGBA", clamp_factor=False), -1.0, 2.0),
    Case("Mix: clamped", _mix(1.0, data_type="RGBA", blend_type="ADD", clamp_result=True)),
    Case("Mix: numbers", _mix(BEYOND, V, 0.3, data_type="FLOAT", clamp_factor=False), -1.0, 1.0),
    Case("Mix: vectors", _mix(BEYOND, data_type="VECTOR", clamp_factor=True)),
    Case(
        "Mix: by-channel",
        _mix(STRONG, data_type="VECTOR", factor_mode="NON_UNIFORM", clamp_factor=False),
        -1.0,
        2.0,
    ),
    Case("MixRGB: old", node(OLD_MIX, {0: BEYOND, 1: COLOUR, 2: OTHER}, blend_type="MULTIPLY")),
    Case(
        "MixRGB: clamped",
        node(OLD_MIX, {0: 1.0, 1: COLOUR, 2: OTHER}, blend_type="SUBTRACT", use_clamp=True),
    ),
    _hue("turned", Hue=0.8, Saturation=0.7, Value=1.2),
    _hue("strong", STRONG, Hue=U, Saturation=1.5, Factor=V),
    Case("Hue/Saturation: folded", _constant(node(HUE, {"Hue": 0.1, "Color": CONSTANT}))),
    Case("Bright/Contrast: varying", node(CONTRAST, {0: COLOUR, 1: scaled(V, -0.5, 0.5), 2: 0.4})),
    Case("Bright/Contrast: strong", node(CONTRAST, {0: STRONG, 1: 0.1, 2: U}), 0.0, 3.0),
    Case("Gamma: fixed", node("ShaderNodeGamma", {0: STRONG, 1: 2.2}), -0.5, 3.0),
    Case("Gamma: varying", node("ShaderNodeGamma", {0: COLOUR, 1: scaled(V, 0.0, 3.0)})),
    Case("Gamma: folded", _constant(node("ShaderNodeGamma", {0: CONSTANT, 1: 0.5}))),
    Case("Invert", node("ShaderNodeInvert", {0: V, 1: COLOUR})),
    Case("Invert: whole", node("ShaderNodeInvert", {0: 1.0, 1: COLOUR})),
    Case("RGB to BW", node("ShaderNodeRGBToBW", {0: COLOUR})),
    *(case for mode in ("RGB", "HSV", "HSL") for case in _modes(mode)),
    Case("Blackbody: folded", _constant(node("ShaderNodeBlackbody", {0: 4321.0})), 0.0, 1.4),
    Case("Wavelength: folded", _constant(node("ShaderNodeWavelength", {0: 612.0}))),
)
