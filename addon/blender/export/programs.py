# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a material, constant or not, and the program that finds those that are not.

Readers of nodes and shaders calculate with values. What is constant is calculated at once; what is
not becomes instructions, each of them once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...photon.scene import RGB, Instruction, Result, triple
from ...photon.scene.programs import Constant, Operand, Rows
from ...photon.stage.kinds import node_kinds
from .arithmetic import ARITHMETIC, FUNCTIONS

Fold = Callable[..., Any]  # of the operands (4,): the result (4,)
KEEP_UNITS = {"MULTIPLY", "MINIMUM", "MAXIMUM", "MIX", "SQRT"}  # as SUBTRACT from 1 does
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))


@dataclass
class Program:
    """A material's instructions so far."""

    instructions: list[Instruction] = field(default_factory=list)
    # How far beside the shading point values are asked for, along and across [footprints]
    # (lib/shading_point.glsl): what its kind has an operand `shift` for.
    shift: tuple[float, float] = (0.0, 0.0)
    units: set[int] = field(default_factory=set)  # instructions whose results are within [0, 1]
    _numbers: dict[Instruction, int] = field(default_factory=dict)

    def emit(self, kind: str, fold: Fold | None = None, /, **operands: Value | Table) -> Value:
        """What a node of a kind gives; `operands` by the names in its file's head. With `fold` it
        is calculated at once if all operands are constant."""
        declared = node_kinds()[kind]
        if any("shift" in names for names in declared.operands):
            operands = {"shift": Value.of((*self.shift, 0.0, 0.0)), **operands}
        given = {name.removesuffix(".xyz") for names in declared.operands for name in names}
        assert given == operands.keys(), f"{kind}: operands {sorted(given)}, got {sorted(operands)}"
        packed = [self._packed(names, operands) for names in declared.operands]
        constants = [each.constant for each in packed if each.constant is not None]
        if fold and len(constants) == len(packed):
            with np.errstate(all="ignore"):
                return Value.of(fold(*constants))
        return self._append(kind, packed)

    def _append(self, kind: str, operands: Sequence[Value | Table]) -> Value:
        instruction = Instruction(kind, tuple(value.operand for value in operands))
        if instruction not in self._numbers:
            self._numbers[instruction] = len(self.instructions)
            self.instructions.append(instruction)
        return Value(self, None, Result(self._numbers[instruction]))

    def _packed(self, names: tuple[str, ...], operands: dict[str, Value | Table]) -> Value | Table:
        """Several values in one operand."""
        if len(names) == 1 and not names[0].endswith(".xyz"):
            return operands[names[0]]
        slots: list[Value] = []
        for name in names:
            value = operands[name.removesuffix(".xyz")]
            assert isinstance(value, Value), f"{name}: a table is an operand of its own"
            slots += [value.part(p) for p in "xyz"] if name.endswith(".xyz") else [value]
        slots += [ZERO] * (4 - len(slots))
        if all(slot.constant is not None for slot in slots):
            return Value.of([slot.number for slot in slots])
        return self._append("combine", slots)

    def pruned(self, results: Iterable[Result]) -> tuple[tuple[Instruction, ...], dict[int, int]]:
        """The instructions that some results need, and the new number of each by its old one."""
        needed = {result.instruction for result in results}
        for number in range(len(self.instructions) - 1, -1, -1):
            if number in needed:
                operands = self.instructions[number].operands
                needed |= {each.instruction for each in operands if isinstance(each, Result)}
        numbers = {old: new for new, old in enumerate(sorted(needed))}
        return tuple(_renumbered(self.instructions[old], numbers) for old in numbers), numbers


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of four numbers (n, 4) that an instruction looks up."""

    constant: NDArray[np.float64]

    @property
    def operand(self) -> Rows:
        """As an instruction has it: what is not finite becomes 0."""
        rows = np.nan_to_num(self.constant, posinf=0.0, neginf=0.0).tolist()
        return Rows(tuple((x, y, z, w) for x, y, z, w in rows))


def _renumbered(instruction: Instruction, numbers: Mapping[int, int]) -> Instruction:
    return replace(
        instruction,
        operands=tuple(
            replace(each, instruction=numbers[each.instruction])
            if isinstance(each, Result)
            else each
            for each in instruction.operands
        ),
    )


@dataclass(frozen=True, eq=False)
class Value:
    """A number, a colour or a vector: four numbers. A single one stands in x, y and z."""

    program: Program | None
    constant: NDArray[np.float64] | None  # (4,)
    result: Result | None = None  # if it is no constant

    @staticmethod
    def of(value: Any) -> Value:
        """A constant: of a number, of three or of four."""
        numbers = np.asarray(value, np.float64).reshape(-1)
        if len(numbers) == 1:
            numbers = np.repeat(numbers, 3)
        filled = np.concatenate([numbers, np.ones(4)])[:4] if len(numbers) < 4 else numbers
        return Value(None, filled)

    @property
    def operand(self) -> Operand:
        """As an instruction has it: what is not finite becomes 0."""
        if self.result is not None:
            return self.result
        assert self.constant is not None
        x, y, z, w = map(float, np.nan_to_num(self.constant, posinf=0.0, neginf=0.0))
        found: Constant = (x, y, z, w)
        return found

    @property
    def is_constant(self) -> bool:
        return self.constant is not None

    @property
    def number(self) -> float:
        """Of a constant the first number."""
        assert self.constant is not None
        return float(self.constant[0])

    @property
    def colour(self) -> NDArray[np.float64]:
        """(3,), of a constant."""
        assert self.constant is not None
        return self.constant[:3]

    @property
    def rgb(self) -> RGB:
        """The same as a scene has it."""
        return triple(self.colour)

    def is_just(self, number: float) -> bool:
        """Whether it is this constant, in x, y and z."""
        return self.constant is not None and bool((self.constant[:3] == number).all())

    def may_exceed(self, number: float) -> bool:
        """Whether any channel may be more than that."""
        return self.constant is None or bool((self.constant[:3] > number).any())

    @property
    def is_unit(self) -> bool:
        """Whether it is known to be within [0, 1]."""
        if self.constant is not None:
            return bool(((self.constant[:3] >= 0.0) & (self.constant[:3] <= 1.0)).all())
        assert self.program is not None and self.result is not None
        return self.result.instruction in self.program.units

    def as_unit(self) -> Value:
        """The same, known to be within [0, 1]."""
        if self.program is not None and self.result is not None:
            self.program.units.add(self.result.instruction)
        return self

    def part(self, name: str) -> Value:
        """x, y, z or w, the luminance or the average, as a number."""
        if self.constant is not None:
            if name == "luminance":
                return Value.of(self.constant[:3] @ LUMINANCE)
            if name == "average":
                return Value.of(self.constant[:3].mean())
            return Value.of(self.constant["xyzw".index(name)])
        assert self.result is not None
        if self.result.part != "xyzw":  # a number already, in all three
            return self if name != "w" else ONE
        return Value(self.program, None, Result(self.result.instruction, name))

    def __add__(self, other: Value | float) -> Value:
        return math("ADD", self, other)

    def __radd__(self, other: float) -> Value:
        return math("ADD", other, self)

    def __sub__(self, other: Value | float) -> Value:
        return math("SUBTRACT", self, other)

    def __rsub__(self, other: float) -> Value:
        return math("SUBTRACT", other, self)

    def __mul__(self, other: Value | float) -> Value:
        return math("MULTIPLY", self, other)

    def __rmul__(self, other: float) -> Value:
        return math("MULTIPLY", other, self)

    def __truediv__(self, other: Value | float) -> Value:
        """0 where it is divided by 0."""
        return math("DIVIDE", self, other)

    def __rtruediv__(self, other: float) -> Value:
        return math("DIVIDE", other, self)

    def clamp(self, low: float = 0.0, high: float = 1.0) -> Value:
        return math("CLAMP", self, low, high)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Value):
            return NotImplemented
        if self.constant is None or other.constant is None:
            same = self.program is other.program and self.result == other.result
            return same and self.constant is other.constant
        return bool(np.array_equal(self.constant[:3], other.constant[:3]))

    def __hash__(self) -> int:
        return hash(self.result)


def value(number: Value | Any) -> Value:
    """As a value, if it is none."""
    return number if isinstance(number, Value) else Value.of(number)


ZERO, ONE = Value.of(0.0), Value.of(1.0)


def math(operation: str, *operands: Value | float) -> Value:
    """What an operation of ARITHMETIC or FUNCTIONS gives of values, each channel by itself."""
    values = [value(operand) for operand in operands]
    known, kind = (
        (ARITHMETIC, "arithmetic") if operation in ARITHMETIC else (FUNCTIONS, "functions")
    )
    number, function = known[operation]
    constants = [each.constant for each in values]
    if all(constant is not None for constant in constants):
        with np.errstate(all="ignore"):
            return Value.of(np.asarray(function(*constants), np.float64)[:3])
    if simple := _simplified(operation, values):
        return simple
    program = next(each.program for each in values if each.program)
    slots = dict(zip("abc" if kind == "arithmetic" else "ab", [*values, ZERO, ZERO], strict=False))
    choice = "operation" if kind == "arithmetic" else "function"
    found = program.emit(kind, **slots, **{choice: Value.of(number)})
    return found.as_unit() if _stays_unit(operation, values) else found


def _stays_unit(operation: str, values: list[Value]) -> bool:
    """Whether what is within [0, 1] stays so."""
    if operation == "CLAMP":
        return values[1].is_unit and values[2].is_unit
    if operation == "SUBTRACT":
        return values[0].is_just(1.0) and values[1].is_unit
    return operation in KEEP_UNITS and all(each.is_unit for each in values)


def _simplified(operation: str, values: list[Value]) -> Value | None:
    """What it is without an instruction, if it is."""
    a, b = values[0], values[1] if len(values) > 1 else ZERO
    match operation:
        case "ADD" if a.is_just(0.0) or b.is_just(0.0):
            return b if a.is_just(0.0) else a
        case "SUBTRACT" | "POWER" if b.is_just(0.0 if operation == "SUBTRACT" else 1.0):
            return a
        case "MULTIPLY" if a.is_just(0.0) or b.is_just(0.0):
            return ZERO
        case "MULTIPLY" if a.is_just(1.0) or b.is_just(1.0):
            return b if a.is_just(1.0) else a
        case "DIVIDE" if b.is_just(1.0):
            return a
        case "MIX" if values[2].is_just(0.0) or values[2].is_just(1.0):
            return a if values[2].is_just(0.0) else b
    return None


def mix(a: Value, b: Value, share: Value) -> Value:
    """From a to b."""
    return math("MIX", a, b, share)
