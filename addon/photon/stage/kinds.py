# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of lobes, lights, cameras and nodes: a GLSL file each, whose head says what its
parameters are, or its operands.

A kind is there once its file is: nothing lists them. Programs are made with the kinds that a scene
has, and one switch (switches.py).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...streams import StreamError, source
from ..errors import SceneError
from ..scene import Instruction, Scene
from ..scene.programs import MOST_OPERANDS

_OPERANDS = re.compile(r"^Operands: ([^\n]*)\.$", re.M)
_PARAMETERS = re.compile(r"^Parameters: ([^.]*)\.( Power: .*)?$", re.M)
_TRAITS = re.compile(r"^Traits: ([^.]*)\.$", re.M)
_POWER = re.compile(r"\bPower: (.+)\.$", re.M)
_PARAMETER = re.compile(r"(\w+)(?: \[([^\]]*)\])?")
# What a lobe's file may say of it: it reflects each direction into one other; it lets light through
# from behind; it gathers no photons, however rough it is, as delta lobes never do; points in media
# have it, and no surfaces.
DELTA, TRANSMITS, SENDS_RAYS, IN_MEDIA = TRAITS = "delta", "transmits", "sends rays", "in media"
PHASE = "phase"  # the lobe of points where media scatter light
METRES = "m"
WATTS = "W"
RADIANCE = "W/(m^2 sr)"
SCENE = "scene"  # what is known only of the whole scene: the radius of a sphere about it
MESH = "mesh"  # what a triangle has
COLOUR = "rgb"
MATERIAL_VARYING = {"diffuse", "base", "normal", "emission"}  # what its program may give
BY_SIDE = "by side"  # what counts from the other side is its inverse
IMAGE = "image"  # the number of one of the scene's; in tables, where it is


@dataclass(frozen=True)
class Kind:
    """A lobe, a light or a camera, as its file declares it."""

    name: str
    number: int  # in tables and streams; 0 is no lobe
    parameters: Mapping[str, str]  # their units by name, in order
    traits: frozenset[str]  # of TRAITS
    power: str  # of a light: its unit
    verbs: frozenset[str]  # of the functions that its file defines

    @property
    def is_delta(self) -> bool:
        """Whether it reflects each direction into one other."""
        return DELTA in self.traits

    @property
    def transmits(self) -> bool:
        """Whether it lets light through from behind."""
        return TRANSMITS in self.traits

    @property
    def sends_rays(self) -> bool:
        """Whether it gathers no photons, however rough it is."""
        return bool(self.traits & {DELTA, SENDS_RAYS})

    @property
    def is_two_sided(self) -> bool:
        """Whether shadow rays find light for it behind the surface, too."""
        return self.transmits and not self.is_delta

    @property
    def disperses(self) -> bool:
        """Whether it bends each wavelength differently."""
        return "disperses" in self.verbs

    @property
    def is_diffuse(self) -> bool:
        """Whether its rays count as diffuse ones where caustics are told apart."""
        return "is_diffuse" in self.verbs

    def is_met(self, given: Mapping[str, Any]) -> bool:
        """Whether a ray can meet such a light by chance: the first parameter is its size."""
        first = next(iter(self.parameters))
        return self.parameters[first] == SCENE or given[first] > 0.0

    @property
    def is_world(self) -> bool:
        """Whether it is what lies behind all else."""
        return self.power == RADIANCE and self.is_distant

    @property
    def is_distant(self) -> bool:
        """Whether it shines on all of the scene from afar."""
        return SCENE in self.parameters.values()

    @property
    def is_in_media(self) -> bool:
        """Whether points in media have such lobes: no scene gives one."""
        return IN_MEDIA in self.traits

    @property
    def is_of_mesh(self) -> bool:
        """Whether its lights are emissive triangles: no scene gives such a light."""
        return MESH in self.parameters.values()

    @property
    def emits_by_cosine(self) -> bool:
        """Whether photons of some of these lights leave a surface by the cosine."""
        return "cosine_axis" in self.verbs

    @property
    def has_image(self) -> bool:
        """Whether it refers to an image."""
        return IMAGE in self.parameters.values()

    @property
    def given(self) -> tuple[str, ...]:
        """The parameters that a scene gives."""
        return tuple(name for name, unit in self.parameters.items() if unit not in (SCENE, MESH))

    def numbers(
        self,
        given: Mapping[str, float | tuple[float, ...]],
        metre: float = 1.0,
        bounds: float = 0.0,
        images: Sequence[tuple[float, ...]] = (),
    ) -> list[float]:
        """Parameters as a table holds them, in order; `metre` is what lengths are multiplied by,
        `bounds` the radius of a sphere about the scene, `images` what stands for each."""
        numbers: list[float] = []
        for name, unit in self.parameters.items():
            value = bounds if unit == SCENE else given[name]
            if unit == IMAGE and isinstance(value, (int, float)):
                value = images[int(value)]
            if isinstance(value, tuple):
                numbers += value
            else:
                numbers.append(value * metre if unit == METRES else value)
        return numbers


def lobe_kinds() -> Mapping[str, Kind]:
    """Those of glsl/bsdf by name."""
    return _kinds(source.glsl_root(), "bsdf")


def light_kinds() -> Mapping[str, Kind]:
    """Those of glsl/lights by name."""
    return _kinds(source.glsl_root(), "lights")


def order(kind: Kind) -> tuple[bool, int]:
    """By which lamps are sorted: distant ones first, then by kind."""
    return not kind.is_distant, kind.number


def camera_kinds() -> Mapping[str, Kind]:
    """Those of glsl/cameras by name, in small letters."""
    return _kinds(source.glsl_root(), "cameras")


@dataclass(frozen=True)
class NodeKind:
    """A node, as its file declares it."""

    name: str
    number: int  # in tables
    # The names of what an operand's four numbers are; one name alone has all four, and one that
    # ends in .xyz three.
    operands: tuple[tuple[str, ...], ...]
    choices: frozenset[str]  # those that tell what is computed: constants
    is_long: bool  # to compile, as its head says


def node_kinds() -> Mapping[str, NodeKind]:
    """Those of glsl/nodes by name."""
    return _node_kinds(source.glsl_root())


def check_kinds(scene: Scene) -> None:
    """Raise SceneError naming the camera, or the first light, lobe or instruction, if it is of a
    kind that is not there, or has other parameters than its file says."""
    camera = scene.camera
    _check("scene.camera", camera_kinds(), camera.kind.lower(), camera.parameters)
    for light in scene.lights:
        _check(f"light {light.name!r}", light_kinds(), light.kind, light.parameters)
    for material in scene.materials:
        for lobe in material.lobes:
            _check(f"material {material.name!r}", lobe_kinds(), lobe.kind, lobe.parameters)
            units = lobe_kinds()[lobe.kind].parameters
            given = {name for name in lobe.parameters if units[name] != METRES}
            known = {"colour", "covered", "weight", *given}
            _check_varying(f"material {material.name!r}: {lobe.kind}", lobe.varying, known)
        _check_varying(f"material {material.name!r}", material.varying, MATERIAL_VARYING)
    for who, program in scene.programs:
        for instruction in program:
            _check_instruction(who, instruction)


def _check(who: str, kinds: Mapping[str, Kind], kind: str, given: Mapping[str, Any]) -> None:
    own = {name for name, of_one in kinds.items() if of_one.is_of_mesh or of_one.is_in_media}
    if kind not in kinds or kind in own:
        known = [name for name in kinds if name not in own]
        raise SceneError(f"{who}: kind {kind!r} is none of {', '.join(known)}")
    wanted = kinds[kind].given
    if given.keys() != set(wanted):
        named = [", ".join(names) or "none" for names in (wanted, given)]
        raise SceneError(f"{who}: the parameters of {kind} are {named[0]}; got {named[1]}")
    for name in wanted:
        if isinstance(given[name], tuple) != (kinds[kind].parameters[name] == COLOUR):
            raise SceneError(f"{who}: {kind}'s {name} = {given[name]} is not what its file says")


def _check_varying(who: str, varying: Collection[str], known: Collection[str]) -> None:
    for name in varying:
        if name not in known:
            raise SceneError(f"{who}: no program gives {name!r}, but {', '.join(sorted(known))}")


def _check_instruction(who: str, instruction: Instruction) -> None:
    kinds = node_kinds()
    if instruction.kind not in kinds:
        raise SceneError(f"{who}: node {instruction.kind!r} is none of {', '.join(kinds)}")
    wanted, got = len(kinds[instruction.kind].operands), len(instruction.operands)
    if wanted != got:
        raise SceneError(f"{who}: {instruction.kind} has {wanted} operands, got {got}")


@lru_cache(maxsize=16)
def _kinds(root: Path, folder: str) -> Mapping[str, Kind]:
    files = sorted((root / folder).glob("*.glsl"))
    return {file.stem: _read(file, number) for number, file in enumerate(files, 1)}


def _read(file: Path, number: int) -> Kind:
    """StreamError if the file's head does not say what its parameters are, or an unknown trait."""
    text = file.read_text(encoding="utf-8")
    head = text.split("\n\n", 1)[0].replace("// ", "")
    found = _PARAMETERS.search(head)
    if not found:
        raise StreamError(f'{file}: its head has no line "// Parameters: ..."')
    named = [] if found[1] == "none" else _PARAMETER.findall(found[1])
    power = _POWER.search(head)
    verbs = frozenset(re.findall(rf"(\w+)_{file.stem}\(", text))
    said = _TRAITS.search(head)
    traits = frozenset(said[1].split(", ") if said else ())
    if unknown := traits.difference(TRAITS):
        raise StreamError(f"{file}: {min(unknown)!r} is no trait: {', '.join(TRAITS)}")
    unit = power[1] if power else ""
    return Kind(file.stem, number, dict(named), traits, unit, verbs)


@lru_cache(maxsize=16)
def _node_kinds(root: Path) -> Mapping[str, NodeKind]:
    files = sorted((root / "nodes").glob("*.glsl"))
    return {file.stem: _read_node(file, number) for number, file in enumerate(files, 1)}


def _read_node(file: Path, number: int) -> NodeKind:
    """StreamError if the file's head does not say what its operands are."""
    head = file.read_text(encoding="utf-8").split("\n\n", 1)[0].replace("// ", "")
    found = _OPERANDS.search(head)
    if not found:
        raise StreamError(f'{file}: its head has no line "// Operands: ..."')
    plain = found[1].replace("[", "").replace("]", "")
    operands = [] if plain == "none" else [part.split() for part in plain.split(",")]
    for names in operands:
        room = sum(3 if name.endswith(".xyz") else 1 for name in names)
        if not names or (len(names) > 1 and room > 4):
            raise StreamError(f"{file}: operand {' '.join(names)!r} does not fit four numbers")
    if len(operands) > MOST_OPERANDS:
        raise StreamError(f"{file}: {len(operands)} operands, {MOST_OPERANDS} are possible")
    choices = frozenset(re.findall(r"\[(\w+)\]", found[1]))
    is_long = "Long to compile." in head
    return NodeKind(file.stem, number, tuple(map(tuple, operands)), choices, is_long)
