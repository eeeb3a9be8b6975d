# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs as straight code, a function for each shape: where they are few that runs many times
sooner than the interpreter, which asks at each instruction which one it is.

Materials whose programs differ in constants alone have one shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..scene import Instruction, Material, Result
from ..scene.programs import Constant, Operand, Program, Rows
from .kinds import NodeKind, node_kinds

# Instructions of all shapes together up to which they are written out: drivers take longer the more
# there are, and where branches are not jumped over, as on llvmpipe, each point runs all.
MOST_INSTRUCTIONS = 64
# As so many counts one that is long to compile: 0.05 s on llvmpipe, 0.2 s on an H100.
LONG = 8
_SLOTS = "xyzw"
NONE: Constant = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """What of a material's program is code."""

    instructions: Program  # with 0 for constants that tell no choice
    asked: tuple[int, ...]  # those whose results stand for values, in the order of their registers


def shape_of(material: Material) -> Shape:
    """That of a material's program."""
    varying = material.varying, *(lobe.varying for lobe in material.lobes)
    asked = sorted({result.instruction for each in varying for result in each.values()})
    return Shape(tuple(map(_bare, material.program)), tuple(asked))


def shapes_of(materials: Sequence[Material]) -> tuple[Shape, ...]:
    """The shapes of materials' programs, each once; none if they are too long together."""
    found = dict.fromkeys(shape_of(material) for material in materials if material.program)
    length = sum(_length(shape) for shape in found)
    return tuple(found) if length <= MOST_INSTRUCTIONS else ()


def _length(shape: Shape) -> int:
    kinds = (node_kinds()[instruction.kind] for instruction in shape.instructions)
    return sum(LONG if kind.is_long else 1 for kind in kinds)


def made_programs(shapes: Sequence[Shape]) -> str:
    """GLSL of the shapes, and `run_program` that runs a material's."""
    lines: list[str] = []
    for number, shape in enumerate(shapes, 1):
        lines += _function(number, shape)
    lines.append("void run_program(Material material) {")
    for number in range(1, len(shapes) + 1):
        call = f"run_program_{number}(int(material.first_constant))"
        lines.append(f"    if (material.shape == {number}.0) {call};")
    return "\n".join([*lines, "}"]) + "\n"


def _bare(instruction: Instruction) -> Instruction:
    declared = node_kinds()[instruction.kind]
    operands: list[Operand] = []
    for names, operand in zip(declared.operands, instruction.operands, strict=True):
        if isinstance(operand, Rows):
            operand = NONE
        elif not isinstance(operand, Result):
            x, y, z, w = (
                number if is_choice else 0.0
                for number, is_choice in zip(operand, _choices(names, declared), strict=True)
            )
            operand = (x, y, z, w)
        operands.append(operand)
    return Instruction(instruction.kind, tuple(operands))


def _choices(names: tuple[str, ...], declared: NodeKind) -> list[bool]:
    """Which of an operand's four numbers are choices."""
    if len(names) == 1 and not names[0].endswith(".xyz"):
        return [names[0] in declared.choices] * 4
    slots: list[bool] = []
    for name in names:
        slots += [False] * 3 if name.endswith(".xyz") else [name in declared.choices]
    return [*slots, *[False] * 4][:4]


def _function(number: int, shape: Shape) -> list[str]:
    lines, constants = [f"void run_program_{number}(int first) {{"], 0
    for at, instruction in enumerate(shape.instructions):
        declared = node_kinds()[instruction.kind]
        given = []
        for names, operand in zip(declared.operands, instruction.operands, strict=True):
            if isinstance(operand, Result):
                given.append(_part(operand))
            else:
                assert not isinstance(operand, Rows)
                given.append(_constant(operand, _choices(names, declared), constants))
                constants += 1
        lines.append(f"    vec4 v{at} = run_{instruction.kind}({', '.join(given)});")
    lines += [f"    registers[{register}] = v{at};" for register, at in enumerate(shape.asked)]
    return [*lines, "}"]


def _constant(operand: Sequence[float], choices: list[bool], number: int) -> str:
    """A constant by its place among the material's, and choices as they are."""
    read = f"constant_at(first + {number}).value"
    if not any(choices):
        return read
    if all(choices):
        return f"vec4({', '.join(map(repr, operand))})"
    slots = zip(operand, choices, "xyzw", strict=True)
    parts = [f"{own!r}" if is_choice else f"{read}.{slot}" for own, is_choice, slot in slots]
    return f"vec4({', '.join(parts)})"


def _part(result: Result) -> str:
    name = f"v{result.instruction}"
    match result.part:
        case "xyzw":
            return name
        case "luminance":
            return f"vec4(luminance({name}.xyz))"
        case "average":
            return f"vec4(mean({name}.xyz))"
    return f"{name}.{result.part * 4}"
