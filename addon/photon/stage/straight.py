# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs as straight-line code: all materials' merged into one sequence of nodes, each of which
serves every program that has such a node there. That runs many times sooner than the interpreter,
which asks at each instruction which one it is; where branches are not jumped over, as on llvmpipe,
most of all.

Materials whose programs differ in constants alone have one shape.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from ..scene import Instruction, Material, Result
from ..scene.programs import Constant, Operand, Program, Rows
from .kinds import NodeKind, node_kinds

# Nodes up to which the sequence is written out: drivers take longer the more there are.
MOST_INSTRUCTIONS = 96
# As so many counts one that is long to compile: 0.05 s on llvmpipe, 0.2 s on an H100.
LONG = 8
NONE: Constant = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """What of a material's program is code."""

    instructions: Program  # with 0 for constants that tell no choice
    asked: tuple[int, ...]  # those whose results stand for values, in the order of their registers


# A node of the sequence: a kind, and of each operand its choices, or None where it is a result.
Node = tuple[str, tuple[Constant | None, ...]]


@dataclass(frozen=True)
class StraightCode:
    """The nodes of all shapes, and where each shape's instructions are among them."""

    nodes: tuple[Node, ...]
    shapes: tuple[Shape, ...]
    places: tuple[tuple[int, ...], ...]  # by shape and instruction
    wanted: tuple[frozenset[int], ...] = ()  # instructions by shape, if not all are code

    def __bool__(self) -> bool:
        return bool(self.shapes)

    @property
    def registers(self) -> int:
        """How many hold results that stand for values."""
        return max((len(shape.asked) for shape in self.shapes), default=0)

    def wants(self, shape: int, instruction: int) -> bool:
        """Whether an instruction of a shape is code."""
        return not self.wanted or instruction in self.wanted[shape]

    def first_operands(self) -> list[int]:
        """At which of a material's constants the operands of each node are, and how many there are
        in all: each operand has its own, whether it is one or not."""
        firsts = [0]
        for kind, _ in self.nodes:
            firsts.append(firsts[-1] + len(node_kinds()[kind].operands))
        return firsts


NO_CODE = StraightCode((), (), ())


def shape_of(material: Material) -> Shape:
    """That of a material's program."""
    varying = material.varying, *(lobe.varying for lobe in material.lobes)
    asked = sorted({result.instruction for each in varying for result in each.values()})
    return Shape(_bare_program(material.program), tuple(asked))


def straight_code(
    materials: Sequence[Material], asked: Sequence[Iterable[Result]] | None = None
) -> StraightCode:
    """That of materials' programs; without any shape if it were too long. `asked`: some of each
    one's results, if no others need to be there."""
    shapes = dict.fromkeys(shape_of(material) for material in materials if material.program)
    code = _merged_code(tuple(shapes), MOST_INSTRUCTIONS)
    if asked is None:
        return code
    wanted: dict[Shape, frozenset[int]] = dict.fromkeys(code.shapes, frozenset())
    for material, results in zip(materials, asked, strict=True):
        if material.program and code:
            wanted[shape_of(material)] |= needed(material.program, results)
    return replace(code, wanted=tuple(wanted[shape] for shape in code.shapes))


def needed(program: Program, asked: Iterable[Result]) -> frozenset[int]:
    """The instructions of a program that some of its results need."""
    found: set[int] = set()
    left = [result.instruction for result in asked]
    while left:
        number = left.pop()
        if number not in found:
            found.add(number)
            operands = program[number].operands
            left += [operand.instruction for operand in operands if isinstance(operand, Result)]
    return frozenset(found)


@lru_cache(maxsize=8)
def _merged_code(shapes: tuple[Shape, ...], most: int) -> StraightCode:
    nodes: list[Node] = []
    for shape in sorted(shapes, key=lambda shape: -len(shape.instructions)):
        nodes = _merged(nodes, [_node(instruction) for instruction in shape.instructions])
        if _length(nodes) > most:
            return NO_CODE
    places = [_places(nodes, shape) for shape in shapes]
    # Where a shape finds a node before the one that was put there for it, nobody may need that.
    used = sorted({place for of_shape in places for place in of_shape})
    again = {place: number for number, place in enumerate(used)}
    return StraightCode(
        tuple(nodes[place] for place in used),
        shapes,
        tuple(tuple(again[place] for place in of_shape) for of_shape in places),
    )


def _length(nodes: Iterable[Node]) -> int:
    return sum(LONG if node_kinds()[kind].is_long else 1 for kind, _ in nodes)


def _node(instruction: Instruction) -> Node:
    choices = []
    for operand in instruction.operands:
        assert not isinstance(operand, Rows)
        choices.append(None if isinstance(operand, Result) else operand)
    kind = node_kinds()[instruction.kind]
    told = tuple(
        own if any(_choices(names, kind)) else NONE
        for own, names in zip(choices, kind.operands, strict=True)
    )
    return instruction.kind, told


def _merged(some: list[Node], more: list[Node]) -> list[Node]:
    """The shortest sequence that has both within it, each in its order (Wagner & Fischer 1974)."""
    common = [[0] * (len(more) + 1) for _ in range(len(some) + 1)]
    for i in range(len(some) - 1, -1, -1):
        for k in range(len(more) - 1, -1, -1):
            if some[i] == more[k]:
                common[i][k] = common[i + 1][k + 1] + _length([some[i]])
            else:
                common[i][k] = max(common[i + 1][k], common[i][k + 1])
    merged: list[Node] = []
    i = k = 0
    while i < len(some) and k < len(more):
        if some[i] == more[k]:
            merged.append(some[i])
            i, k = i + 1, k + 1
        elif common[i + 1][k] >= common[i][k + 1]:
            merged.append(some[i])
            i += 1
        else:
            merged.append(more[k])
            k += 1
    return merged + some[i:] + more[k:]


def _places(nodes: list[Node], shape: Shape) -> tuple[int, ...]:
    """Where each of a shape's instructions is: the first that fits, after the one before."""
    places, at = [], 0
    for instruction in shape.instructions:
        at = nodes.index(_node(instruction), at)
        places.append(at)
        at += 1
    return tuple(places)


def made_programs(code: StraightCode) -> str:
    """Its GLSL: `run_program`, which runs a material's, and `operand`, what a code stands for."""
    lines = ["void run_program(Material material) {"]
    lines.append("    int first = int(material.first_constant), shape = int(material.shape);")
    firsts = code.first_operands()
    users: list[dict[int, Instruction]] = [{} for _ in code.nodes]  # instructions by shape
    for number, (shape, places) in enumerate(zip(code.shapes, code.places, strict=True), 1):
        for at, (instruction, place) in enumerate(zip(shape.instructions, places, strict=True)):
            if code.wants(number - 1, at):
                users[place][number] = instruction
    for at, ((kind, choices), used) in enumerate(zip(code.nodes, users, strict=True)):
        if not used:
            continue
        given = [
            _operand(
                code, {n: i.operands[k] for n, i in used.items()}, own, kind, k, firsts[at] + k
            )
            for k, own in enumerate(choices)
        ]
        lines.append(f"    vec4 v{at} = run_{kind}({', '.join(given)});")
    held = []
    for register in range(code.registers):
        asked = {
            number: f"v{places[shape.asked[register]]}"
            for number, (shape, places) in enumerate(zip(code.shapes, code.places, strict=True), 1)
            if register < len(shape.asked) and code.wants(number - 1, shape.asked[register])
        }
        if asked:
            held.append(register)
            lines.append(f"    register{register} = {_chosen(asked)};")
    return "\n".join([*_registers(held), *lines, "}"]) + "\n"


def _registers(held: Sequence[int]) -> list[str]:
    """A variable for each of these: drivers keep arrays in memory where a number tells which."""
    lines = [f"vec4 register{number};" for number in held]
    lines += ["vec4 operand(float code) {", "    int number = int(code) - 1;"]
    lines += ["    int which = number / PARTS;", "    vec4 value = vec4(0.0);"]
    lines += [f"    if (which == {number}) value = register{number};" for number in held]
    return [*lines, "    return part_of(value, number % PARTS);", "}"]


def _operand(
    code: StraightCode,
    used: dict[int, Operand],
    own: Constant | None,
    kind: str,
    operand: int,
    place: int,
) -> str:
    """What an operand of a node is, by shape: a result, or the constant at a place."""
    declared = node_kinds()[kind]
    choices = _choices(declared.operands[operand], declared)
    given = {}
    for number, each in used.items():
        if isinstance(each, Result):
            given[number] = _part(each, code.places[number - 1])
        else:
            given[number] = _constant(own or NONE, choices, place)
    return _chosen(given)


def _chosen(by_shape: dict[int, str]) -> str:
    """One of some expressions by the shape's number; where all agree, without asking."""
    texts: dict[str, list[int]] = {}
    for number, text in by_shape.items():
        texts.setdefault(text, []).append(number)
    *others, (most, _) = sorted(texts.items(), key=lambda item: len(item[1]))
    chosen = most
    for text, numbers in others:
        where = " || ".join(f"shape == {number}" for number in numbers)
        chosen = f"({where} ? {text} : {chosen})"
    return chosen


@lru_cache(maxsize=256)
def _bare_program(program: Program) -> Program:
    return tuple(map(_bare, program))


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


def _part(result: Result, places: Sequence[int]) -> str:
    name = f"v{places[result.instruction]}"
    match result.part:
        case "xyzw":
            return name
        case "luminance":
            return f"vec4(luminance({name}.xyz))"
        case "average":
            return f"vec4(mean({name}.xyz))"
    return f"{name}.{result.part * 4}"
