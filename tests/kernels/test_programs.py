# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs give what is folded of constants; straight code gives what the interpreter does."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="what folds is the add-on's, which needs bpy")

from addon.blender.export.arithmetic import ARITHMETIC, FUNCTIONS
from addon.photon.errors import SceneError
from addon.photon.kernels.shade import Shade
from addon.photon.scene import Instruction, Material, Result
from addon.photon.scene.programs import PARTS
from addon.photon.stage import straight
from addon.photon.stage.programs import MOST_REGISTERS, allocated, program_tables, registers_of
from addon.photon.stage.straight import made_programs, straight_code
from addon.photon.stage.switches import made_nodes
from addon.streams import Device
from tests.measure import render
from tests.scenes import cornell

from .conftest import Bench
from .shading import BLACK, tables

INPUTS = {
    "direction": np.tile(np.array((0.0, 0.0, -1.0, 1.0), np.float32), (1, 1)),
    "hit": np.array([[1.0, 1.0, 0.25, 0.25]], np.float32),
}
UNIFORMS = {"depth": 0, "frame_size": (8, 8), "seed": 1, "pass_index": 0}
VALUES = (0.3, -1.7, 2.0, 0.0, 1.0, 7.25)


def constant(value: float) -> tuple[float, float, float, float]:
    return (value, value, value, 1.0)


def shaded(bench: Bench, program: tuple[Instruction, ...], at: int = -1, part: str = "xyzw") -> Any:
    """What Shade finds as albedo if that is a part of a result of a program, the first of which is
    asked for, too."""
    varying = {"diffuse": Result(at % len(program), part), "emission": Result(0)}
    material = Material("m", program=program, varying=varying)
    both = (BLACK, material)
    code = straight_code(both)
    made = made_nodes({i.kind for i in program}, made_programs(code) if code else "")
    defines = {"EYE": 1, "PROGRAMS": max(registers_of(both, code), 1)}
    assert program_tables(both).compiled[1].shape == (1 if code else 0)
    found = bench.run(Shade, INPUTS, UNIFORMS, tables(material), defines, made=made)
    return found["diffuse"][0, :3]


def operation(name: str, *operands: Any) -> Instruction:
    """An instruction of arithmetic, or of functions."""
    if name in ARITHMETIC:
        padded = [*operands, constant(0.0), constant(0.0)][:3]
        return Instruction("arithmetic", (*padded, constant(ARITHMETIC[name][0])))
    padded = [*operands, constant(0.0)][:2]
    return Instruction("functions", (*padded, constant(FUNCTIONS[name][0])))


def scaled(program: list[Instruction]) -> tuple[Instruction, ...]:
    """The last result where albedos are: a tenth of it about a half."""
    last = Result(len(program) - 1)
    return (*program, operation("MULTIPLY_ADD", last, constant(0.05), constant(0.5)))


@pytest.mark.parametrize("name", [*ARITHMETIC, *FUNCTIONS])
def test_constants_are_folded_to_what_shade_finds(one_bench: Bench, monkeypatch, name: str) -> None:
    """By the interpreter, which has all operations in one program."""
    monkeypatch.setattr(straight, "MOST_INSTRUCTIONS", 0)
    function = {**ARITHMETIC, **FUNCTIONS}[name][1]
    count = function.__code__.co_argcount if hasattr(function, "__code__") else function.nin
    cases = [np.roll(VALUES, k)[:count] for k in range(len(VALUES))]
    checked = 0
    for values in cases:
        with np.errstate(all="ignore"):
            expected = float(function(*(np.array([v]) for v in values))[0])
        if not abs(expected) < 9.0:
            continue
        program = scaled([operation(name, *map(constant, values))])
        found = shaded(one_bench, program)
        assert found == pytest.approx(0.5 + 0.05 * expected, abs=2e-5), values
        checked += 1
    assert checked


def test_straight_code_gives_what_the_interpreter_does(bench: Bench, monkeypatch) -> None:
    """To the bit, of results and their parts."""
    program = scaled(
        [
            Instruction("combine", tuple(map(constant, (0.3, 0.7, 1.9, 0.2)))),
            operation("MULTIPLY_ADD", Result(0), constant(1.5), Result(0, "w")),
            operation("POWER", Result(1), constant(1.3)),
            operation("SUBTRACT", Result(2, "luminance"), Result(1, "average")),
            operation("ADD", Result(3), Result(2, "y")),
        ]
    )
    asked = ((1, "xyzw"), *((-1, part) for part in PARTS))
    found = [shaded(bench, program, *each).copy() for each in asked]
    monkeypatch.setattr(straight, "MOST_INSTRUCTIONS", 0)
    assert np.array_equal(found, [shaded(bench, program, *each) for each in asked])
    assert np.min(found) > 0.0 and np.max(found) < 1.0 + 1e-6


def test_materials_of_one_shape_share_code() -> None:
    """They differ in constants; other choices are other code."""
    first, second, other = (
        Material("m", program=(operation(name, constant(x)),), varying={"diffuse": Result(0)})
        for name, x in (("SINE", 0.1), ("SINE", 0.2), ("COSINE", 0.1))
    )
    assert len(straight_code((first, second)).shapes) == 1
    assert len(straight_code((first, second, other)).shapes) == 2
    table = program_tables((first, second, other))
    assert [each.shape for each in table.compiled] == [1, 1, 2]
    code = straight_code((first, second, other))
    for material, each in zip((first, second, other), table.compiled, strict=True):
        (place,) = code.places[each.shape - 1]
        at = each.first_constant + code.first_operands()[place]
        assert table.constants["value"][at] == pytest.approx(material.program[0].operands[0])


def test_programs_share_nodes_in_one_row(device: Device, monkeypatch) -> None:
    """Some of three programs, in another order or of other operands: the same to the bit."""
    position = Instruction("geometry", ((0.0,) * 4, (0.0,) * 4))
    sine = operation("SINE", Result(0))
    programs = (
        (position, sine, operation("MULTIPLY_ADD", Result(1), constant(0.4), constant(0.5))),
        (position, operation("MULTIPLY_ADD", Result(0, "z"), constant(0.1), constant(0.3))),
        (
            position,
            operation("COSINE", Result(0)),
            operation("MULTIPLY_ADD", Result(1), Result(1, "y"), constant(0.2)),
            operation("SINE", Result(2)),
        ),
    )
    scene = cornell()
    materials = tuple(
        replace(material, program=program, varying={"diffuse": Result(len(program) - 1)})
        for material, program in zip(scene.materials, programs, strict=False)
    )
    materials += scene.materials[len(materials) :]
    assert len(straight_code(materials).nodes) == 5
    spaces = np.zeros((len(scene.surfaces), *scene.objects.shape[1:]))
    scene = replace(scene, materials=materials, objects=spaces)
    images = render(device, scene, width=24, height=24, passes=1, photons=512)
    monkeypatch.setattr(straight, "MOST_INSTRUCTIONS", 0)
    again = render(device, scene, width=24, height=24, passes=1, photons=512)
    assert np.array_equal(images["Combined"], again["Combined"])
    assert images["Combined"][..., :3].max() > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_a_row_has_what_its_programs_need(seed: int) -> None:
    """Each program's nodes in their order, and none that nobody needs."""
    rng = np.random.default_rng(seed)
    materials = []
    for _ in range(rng.integers(2, 7)):
        program = [operation("ADD", constant(0.1), constant(0.2))]
        for number in range(rng.integers(1, 12)):
            name = rng.choice(["ADD", "SINE", "MULTIPLY", "COSINE"])
            program.append(operation(name, Result(int(rng.integers(0, number + 1)))))
        varying = {"diffuse": Result(len(program) - 1)}
        materials.append(Material("m", program=tuple(program), varying=varying))
    code = straight_code(materials)
    assert {place for places in code.places for place in places} == set(range(len(code.nodes)))
    for shape, places in zip(code.shapes, code.places, strict=True):
        assert list(places) == sorted(set(places))
        kinds = [code.nodes[place][0] for place in places]
        assert kinds == [instruction.kind for instruction in shape.instructions]
    assert "run_program" in made_programs(code)


def test_registers_are_used_again() -> None:
    chain = [operation("ABSOLUTE", constant(0.5))]
    chain += [operation("ABSOLUTE", Result(number)) for number in range(199)]
    material = Material("long", program=tuple(chain), varying={"diffuse": Result(199)})
    assert max(allocated(material).values()) <= 1
    wide = [operation("ABSOLUTE", constant(0.5)) for _ in range(MOST_REGISTERS + 1)]
    wide.append(operation("ADD", Result(0), Result(1)))
    for number in range(2, MOST_REGISTERS + 1):
        wide.append(operation("ADD", Result(len(wide) - 1), Result(number)))
    material = Material("wide", program=tuple(wide), varying={"diffuse": Result(len(wide) - 1)})
    with pytest.raises(SceneError, match="'wide'"):
        allocated(material)
