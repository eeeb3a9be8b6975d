# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs of materials as tables (glsl/lib/program.glsl)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernels.records import CONSTANT, INSTRUCTION
from ..scene import Material, Result
from ..scene.programs import MOST_OPERANDS, PARTS, Constant, Varying
from .kinds import node_kinds

# More would not fit what GPUs have of memory for each thread that is quick.
MOST_REGISTERS = 64
OPERANDS = ("first", "second", "third", "fourth", "fifth", "sixth")[:MOST_OPERANDS]


@dataclass(frozen=True)
class Compiled:
    """One material's program: where it begins, and in which register each result is."""

    first: int
    registers: Mapping[int, int]  # by instruction, of those that someone asks for

    def code(self, result: Result) -> float:
        """How tables refer to a result."""
        return 1.0 + len(PARTS) * self.registers[result.instruction] + PARTS.index(result.part)

    def codes(self, varying: Varying, name: str) -> float:
        """The same of a value that may be none of the program's: 0 then."""
        return self.code(varying[name]) if name in varying else 0.0


@dataclass
class ProgramTables:
    """All materials' programs, one after the other."""

    instructions: NDArray[Any]  # of INSTRUCTION, one at least
    constants: NDArray[Any]  # of CONSTANT, one at least
    compiled: list[Compiled] = field(default_factory=list)  # by material


def program_tables(materials: Sequence[Material]) -> ProgramTables:
    """Make them; SceneError names the material whose program is too long."""
    count = sum(len(material.program) for material in materials)
    tables = ProgramTables(INSTRUCTION.zeros(max(count, 1)), CONSTANT.zeros(1))
    constants: dict[Constant, int] = {}
    first = 0
    for material in materials:
        registers = allocated(material)
        compiled = Compiled(first, registers)
        rows = tables.instructions[first : first + len(material.program)]
        for number, (row, instruction) in enumerate(zip(rows, material.program, strict=True)):
            row["kind"] = node_kinds()[instruction.kind].number
            row["result"] = registers.get(number, 0)
            for name, operand in zip(OPERANDS, instruction.operands, strict=False):
                if isinstance(operand, Result):
                    row[name] = compiled.code(operand)
                else:
                    row[name] = -1.0 - constants.setdefault(operand, len(constants))
        tables.compiled.append(compiled)
        first += len(rows)
    if constants:
        tables.constants = CONSTANT.zeros(len(constants))
        tables.constants["value"] = np.array(list(constants))
    return tables


def allocated(material: Material) -> dict[int, int]:
    """A register for each instruction of a material's program; a result's is free again after the
    last that asks for it. SceneError if there are too few."""
    ends = last_uses(material)
    registers: dict[int, int] = {}
    free: list[int] = []
    width = 0
    for number in range(len(material.program)):
        free += sorted(
            (registers[other] for other, end in ends.items() if end == number), reverse=True
        )
        if free:
            registers[number] = free.pop()
        else:
            registers[number], width = width, width + 1
        if number not in ends:  # nobody asks
            free.append(registers[number])
    if width > MOST_REGISTERS:
        raise SceneError(
            f"material {material.name!r}: its nodes hold {width} values at a time, "
            f"{MOST_REGISTERS} at most are possible"
        )
    return registers


def last_uses(material: Material) -> dict[int, int]:
    """By instruction, the last one that asks for its result; the program's length if the material
    does."""
    ends: dict[int, int] = {}
    for number, instruction in enumerate(material.program):
        for operand in instruction.operands:
            if isinstance(operand, Result):
                ends[operand.instruction] = number
    for varying in (material.varying, *(lobe.varying for lobe in material.lobes)):
        for result in varying.values():
            ends[result.instruction] = len(material.program)
    return ends


def registers_of(materials: Sequence[Material]) -> int:
    """How many registers the programs of materials need."""
    return max((1 + max(allocated(m).values(), default=-1) for m in materials), default=0)
