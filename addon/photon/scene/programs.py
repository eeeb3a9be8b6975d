# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs: what of a material differs from point to point, as instructions for Shade."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import SceneError
from .checks import check_finite

Constant = tuple[float, float, float, float]
# What an operand may take of a result: all four numbers, or one in place of x, y and z.
PARTS = ("xyzw", "x", "y", "z", "w", "luminance", "average")
MOST_OPERANDS = 6


@dataclass(frozen=True)
class Result:
    """What an earlier instruction of the program gives, or a part of it."""

    instruction: int
    part: str = "xyzw"  # one of PARTS


@dataclass(frozen=True)
class Rows:
    """A table of constants, one at least, that an instruction looks up."""

    rows: tuple[Constant, ...]


Operand = Result | Constant | Rows


@dataclass(frozen=True)
class Instruction:
    """A node: one of the kinds of glsl/nodes, whose files say what the operands are. It gives four
    numbers; a single one stands in x, y and z."""

    kind: str
    operands: tuple[Operand, ...] = ()

    def check(self, who: str, number: int) -> None:
        """Raise SceneError naming the owner unless operands are finite, or of earlier ones."""
        for operand in self.operands:
            if isinstance(operand, Result):
                check_result(f"{who}: instruction {number}, {self.kind}", operand, number)
            else:
                rows = operand.rows if isinstance(operand, Rows) else [operand]
                for row in rows:
                    check_finite(f"{who}: instruction {number}, {self.kind}", row)


Program = tuple[Instruction, ...]
Varying = Mapping[str, Result]  # values of a record that its program gives, by their names


def check_program(who: str, program: Program, varying: Collection[Varying]) -> None:
    """Raise SceneError naming the owner of a program and the first thing in it that is wrong."""
    for number, instruction in enumerate(program):
        instruction.check(who, number)
    for results in varying:
        for name, result in results.items():
            check_result(f"{who}: {name}", result, len(program))


def check_result(who: str, result: Result, instructions: int) -> None:
    """Raise SceneError unless it is a part of one of so many instructions."""
    if result.part not in PARTS or result.instruction not in range(instructions):
        what = f"{result.part} of instruction {result.instruction}"
        raise SceneError(f"{who}: {what} is none of {instructions} instructions before it")


def read_program(values: Any) -> Program:
    """A program from a snapshot's header."""
    return tuple(
        Instruction(one["kind"], tuple(_read_operand(operand) for operand in one["operands"]))
        for one in values
    )


def read_varying(values: Mapping[str, Any]) -> Varying:
    """Results from a snapshot's header."""
    return {name: Result(**result) for name, result in values.items()}


def _read_operand(value: Any) -> Operand:
    if isinstance(value, Mapping):
        if "rows" in value:
            return Rows(tuple(map(_constant, value["rows"])))
        return Result(**value)
    return _constant(value)


def _constant(value: Any) -> Constant:
    x, y, z, w = map(float, value)
    return x, y, z, w
