# SPDX-License-Identifier: GPL-3.0-or-later
"""Math, Vector Math, Separate and Combine XYZ on a sheet."""

from __future__ import annotations

from .node_cases import COLOUR, OTHER, UV, VECTOR, Case, U, V, node, scaled

MATH, VECTOR_MATH = "ShaderNodeMath", "ShaderNodeVectorMath"
X, Y = scaled(U, -1.93, 2.06), scaled(V, -1.52, 1.46)  # so that none is whole
SECOND = node(
    VECTOR_MATH, {0: OTHER, 1: (2.0, 2.0, 2.0), 2: (-0.7, -0.7, -0.7)}, operation="MULTIPLY_ADD"
)

# Operations of numbers, the third of which is 0.4; what they may give.
MATHS = {
    **dict.fromkeys(("ADD", "SUBTRACT", "MULTIPLY_ADD", "ARCTAN2"), (-4.0, 4.0)),
    **dict.fromkeys(("MULTIPLY", "MINIMUM", "MAXIMUM", "SMOOTH_MIN", "SMOOTH_MAX"), (-3.0, 3.0)),
    **dict.fromkeys(("DIVIDE", "POWER", "LOGARITHM", "TANGENT", "TANH", "SINH"), (-5.0, 5.0)),
    **dict.fromkeys(("SQRT", "INVERSE_SQRT", "EXPONENT", "COSH"), (0.0, 8.0)),
    **dict.fromkeys(("ROUND", "FLOOR", "CEIL", "TRUNC", "SNAP", "SIGN", "ABSOLUTE"), (-3.0, 3.0)),
    **dict.fromkeys(("LESS_THAN", "GREATER_THAN", "COMPARE", "FRACT"), (-0.5, 1.5)),
    **dict.fromkeys(("MODULO", "FLOORED_MODULO", "WRAP", "PINGPONG"), (-2.0, 2.0)),
    **dict.fromkeys(("SINE", "COSINE", "ARCSINE", "ARCCOSINE", "ARCTANGENT"), (-2.0, 3.5)),
    **dict.fromkeys(("RADIANS",), (-0.1, 0.1)),
    **dict.fromkeys(("DEGREES",), (-120.0, 120.0)),
}
# Of vectors.
VECTORS = {
    **dict.fromkeys(("ADD", "SUBTRACT", "MULTIPLY_ADD", "CROSS_PRODUCT", "REFLECT"), (-4.0, 4.0)),
    **dict.fromkeys(("MULTIPLY", "PROJECT", "MINIMUM", "MAXIMUM", "SCALE"), (-3.0, 3.0)),
    **dict.fromkeys(("DIVIDE", "POWER", "TANGENT"), (-5.0, 5.0)),
    **dict.fromkeys(("NORMALIZE", "REFRACT", "FACEFORWARD", "SIGN", "ABSOLUTE"), (-1.6, 1.6)),
    **dict.fromkeys(("FLOOR", "CEIL", "FRACTION", "MODULO", "WRAP", "SNAP"), (-3.0, 3.0)),
    **dict.fromkeys(("SINE", "COSINE"), (-1.0, 1.0)),
    **dict.fromkeys(("DOT_PRODUCT", "DISTANCE", "LENGTH"), (-4.0, 4.0)),
}
# What makes all but jumps of second operands that come near 0, or to the first.
STEADY = {
    **{name: {1: (0.43, -0.71, 0.37)} for name in ("MODULO", "SNAP")},
    "WRAP": {1: (1.1, 0.9, -0.2), 2: (0.1, -0.2, 0.5)},
}
GIVES_A_NUMBER = {"DOT_PRODUCT", "DISTANCE", "LENGTH"}


def _maths(operation: str) -> Case:
    built = node(MATH, {0: X, 1: Y, 2: 0.4}, operation=operation)
    return Case(f"Math: {operation}", built, *MATHS[operation])


def _vectors(operation: str) -> Case:
    output = "Value" if operation in GIVES_A_NUMBER else "Vector"
    inputs = {0: VECTOR, 1: SECOND, 2: COLOUR, "Scale": 0.8} | STEADY.get(operation, {})
    built = node(VECTOR_MATH, inputs, output, operation=operation)
    return Case(f"Vector Math: {operation}", built, *VECTORS[operation])


CASES = (
    *map(_maths, MATHS),
    Case("Math: clamped", node(MATH, {0: X, 1: Y}, operation="ADD", use_clamp=True)),
    *map(_vectors, VECTORS),
    *(Case(f"Separate XYZ: {x}", node("ShaderNodeSeparateXYZ", {0: COLOUR}, x)) for x in "XYZ"),
    Case("Combine XYZ", node("ShaderNodeCombineXYZ", {0: U, 1: 0.3, 2: V})),
    Case("UV as a number", node(MATH, {0: UV, 1: 1.0}, operation="MULTIPLY")),
    Case("Colour as a number", node(MATH, {0: node("ShaderNodeRGB"), 1: U}, operation="MULTIPLY")),
)
