# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs of materials as tables (glsl/lib/program.glsl), and which results are where."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Made
from ..errors import SceneError
from ..kernels.records import CONSTANT, INSTRUCTION
from ..scene import TRANSPARENT, Material, Result, Scene
from ..scene.programs import MOST_OPERANDS, PARTS, Constant, Rows, Varying
from .kinds import node_kinds
from .straight import NO_CODE, NONE, StraightCode, made_programs, needed, shape_of, straight_code
from .switches import made_nodes
from .textures import TEXTURE_NODE

# More would not fit what GPUs have of memory for each thread that is quick.
MOST_REGISTERS = 64
BUMPS = {"bump", "object_bump"}  # kinds of nodes that ask for heights beside a point
OPERANDS = ("first", "second", "third", "fourth", "fifth", "sixth")[:MOST_OPERANDS]


@dataclass(frozen=True)
class ProgramNeeds:
    """What programs need of the kernels that run them."""

    nodes: frozenset[str] = frozenset()  # kinds
    code: StraightCode = NO_CODE  # without shapes: interpreted
    registers: int = 0
    attributes: int = 0  # that a triangle's corners have
    normals: bool = False  # some give those

    @staticmethod
    def of(scene: Scene) -> ProgramNeeds:
        """Those of all materials."""
        code = straight_code(scene.materials)
        return ProgramNeeds(
            frozenset(node.kind for material in scene.materials for node in material.program),
            code,
            registers_of(scene.materials, code),
            scene.corner_attributes.shape[1],
            any(material.varying.keys() & {"base", "normal"} for material in scene.materials),
        )

    @staticmethod
    def of_some(scene: Scene, asked: Callable[[Material], Iterable[Result]]) -> ProgramNeeds:
        """Those of some of each material's results: compilers take long for nodes, and points for
        those of materials that they are not of."""
        results = [tuple(asked(material)) for material in scene.materials]
        code = straight_code(scene.materials, results)
        nodes = frozenset(
            material.program[number].kind
            for material, own in zip(scene.materials, results, strict=True)
            for number in needed(material.program, own)
        )
        attributes = scene.corner_attributes.shape[1]
        return ProgramNeeds(nodes, code, registers_of(scene.materials, code), attributes)

    @property
    def bumps(self) -> bool:
        """Whether heights are asked for beside a point."""
        return not BUMPS.isdisjoint(self.nodes)

    @property
    def defines(self) -> dict[str, int | float]:
        """What they are compiled with; nothing where there is no program."""
        if not self.nodes:
            return {}
        some: dict[str, int | float] = {"ATTRIBUTES": self.attributes} if self.attributes else {}
        some |= {"NORMALS": 1} if self.normals else {}
        some |= {"BUMPS": 1} if self.bumps else {}
        some |= {"TEXTURES": 1} if TEXTURE_NODE in self.nodes else {}
        return {"PROGRAMS": max(self.registers, 1), **some}

    @property
    def made(self) -> Made:
        """What they include."""
        return made_nodes(self.nodes, made_programs(self.code) if self.code else "")


@dataclass(frozen=True)
class Compiled:
    """One material's program: where it begins, and in which register each result is."""

    first: int  # instruction
    first_constant: int
    shape: int  # the number of its straight code; 0: none
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
    constants = _Constants()
    code, first = straight_code(materials), 0
    for material in materials:
        compiled = _compiled(material, first, len(constants.values), code)
        if compiled.shape:
            _fill_constants(material, code, compiled.shape - 1, constants)
        else:
            _fill(tables.instructions[first:], material, compiled, constants)
        tables.compiled.append(compiled)
        first += len(material.program)
    values = constants.with_rows()
    if values:
        tables.constants = CONSTANT.zeros(len(values))
        tables.constants["value"] = np.array(values)
    return tables


@dataclass
class _Constants:
    """The table of constants so far: those of operands in their order, and then all rows."""

    values: list[Constant] = field(default_factory=list)
    _tables: dict[int, Rows] = field(default_factory=dict)  # that values stand for

    def add(self, operand: Constant | Rows) -> int:
        """How many there are then."""
        if isinstance(operand, Rows):
            self._tables[len(self.values)] = operand
            operand = NONE
        self.values.append(operand)
        return len(self.values)

    def with_rows(self) -> list[Constant]:
        """All. The constant that stands for rows says which is their first, and how many they are;
        the same rows are there once."""
        found = list(self.values)
        places: dict[Rows, Constant] = {}
        for number, table in self._tables.items():
            if table not in places:
                places[table] = (float(len(found)), float(len(table.rows)), 0.0, 0.0)
                found += table.rows
            found[number] = places[table]
        return found


def _fill(
    rows: NDArray[Any], material: Material, compiled: Compiled, constants: _Constants
) -> None:
    """The first rows of INSTRUCTION; constants go to the end of all."""
    for number, (row, instruction) in enumerate(zip(rows, material.program, strict=False)):
        row["kind"] = node_kinds()[instruction.kind].number
        row["result"] = compiled.registers.get(number, 0)
        for name, operand in zip(OPERANDS, instruction.operands, strict=False):
            if isinstance(operand, Result):
                row[name] = compiled.code(operand)
            else:
                row[name] = -float(constants.add(operand))


def _fill_constants(
    material: Material, code: StraightCode, shape: int, constants: _Constants
) -> None:
    """A constant for each operand of the code's nodes, to the end of all: those of a material."""
    firsts = code.first_operands()
    own: list[Constant | Rows] = [NONE] * firsts[-1]
    for instruction, place in zip(material.program, code.places[shape], strict=True):
        for number, operand in enumerate(instruction.operands):
            if not isinstance(operand, Result):
                own[firsts[place] + number] = operand
    for operand in own:
        constants.add(operand)


def _compiled(material: Material, first: int, first_constant: int, code: StraightCode) -> Compiled:
    if not (code and material.program):
        return Compiled(first, first_constant, 0, allocated(material))
    shape = shape_of(material)
    registers = {number: register for register, number in enumerate(shape.asked)}
    return Compiled(first, first_constant, 1 + code.shapes.index(shape), registers)


def allocated(material: Material) -> dict[int, int]:
    """A register for each instruction of a material's program. SceneError if there are too few."""
    registers, width = _allocated(material), width_of(material)
    if width > MOST_REGISTERS:
        raise SceneError(
            f"material {material.name!r}: its nodes hold {width} values at a time, "
            f"{MOST_REGISTERS} at most are possible"
        )
    return registers


def width_of(material: Material) -> int:
    """How many registers its program needs."""
    return 1 + max(_allocated(material).values(), default=-1)


def _allocated(material: Material) -> dict[int, int]:
    """A result's register is free again after the last instruction that asks for it."""
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


def of_emission(material: Material) -> list[Result]:
    """The result that says what a material emits, if one does."""
    return [result for name, result in material.varying.items() if name == "emission"]


def of_transmittance(material: Material) -> list[Result]:
    """That of its transparent lobe."""
    return [
        result
        for lobe in material.lobes
        for name, result in lobe.varying.items()
        if lobe.kind == TRANSPARENT and name == "colour"
    ]


def registers_of(materials: Sequence[Material], code: StraightCode) -> int:
    """How many registers the programs of materials need, as straight code if there is any."""
    if code:
        return code.registers
    return max((1 + max(allocated(m).values(), default=-1) for m in materials), default=0)
