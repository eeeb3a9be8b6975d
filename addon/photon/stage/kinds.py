# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of lobes, lights, cameras and nodes: a GLSL file each, whose head says what its
parameters are, or its operands.

A kind is there once its file is: nothing lists them. Programs are made with the kinds that a scene
has, and one switch.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...streams import Defines, Made, StreamError, source
from ..errors import SceneError
from ..scene import Instruction, Scene
from ..scene.programs import MOST_OPERANDS

_OPERANDS = re.compile(r"^Operands: ([^\n]*)\.$", re.M)
_PARAMETERS = re.compile(r"^Parameters: ([^.]*)\.( Power: .*)?$", re.M)
_POWER = re.compile(r"\bPower: (.+)\.$", re.M)
_PARAMETER = re.compile(r"(\w+)(?: \[([^\]]*)\])?")
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
    is_delta: bool  # it reflects each direction into one other
    transmits: bool  # light from behind, as well
    power: str  # of a light: its unit
    verbs: frozenset[str]  # of the functions that its file defines

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
    def is_of_mesh(self) -> bool:
        """Whether its lights are triangles that glow: no scene gives such a light."""
        return MESH in self.parameters.values()

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


@dataclass(frozen=True)
class _Function:
    """What the kinds of a folder define, as `<verb>_<kind>`; the switch is `<verb>_<own>`."""

    returns: str
    verb: str
    arguments: tuple[str, ...]  # type and name
    otherwise: str  # what none of the kinds gives
    number: str  # which kind it is
    is_of: Callable[[Kind], bool] = lambda kind: True  # the kinds that define it

    def switch(self, own: str, kinds: Collection[Kind]) -> str:
        """The function that calls that of the kind whose number it is."""
        names = [argument.split()[-1] for argument in self.arguments]
        given = ", ".join(name for name in names if name != self.number)
        lines = [f"{self.returns} {self.verb}_{own}({', '.join(self.arguments)}) {{"]
        lines += [
            f"    if ({self.number} == {kind.number}.0) return {self.verb}_{kind.name}({given});"
            for kind in kinds
            if self.is_of(kind)
        ]
        lines += [f"    {self.otherwise}", "}"]
        return "\n".join(lines)


_LOBE = ("Lobe lobe", "Shape shape")
_THREE = (*_LOBE, "vec3 normal", "vec3 to_viewer", "vec3 to_light")
_SAMPLE = (*_LOBE, "vec3 normal", "vec3 to_viewer", "vec2 u", "out vec3 weight")
_PACK = ("float kind", "vec4 parameters", "vec4 more")
_AT = ("Light light", "vec3 position", "vec3 normal")
_RAY = ("Light light", "vec3 origin", "vec3 direction", "float far")
BSDF_FUNCTIONS = (
    _Function("vec3", "pack", _PACK, "return vec3(0.0);", "kind"),
    _Function("vec3", "eval", _THREE, "return vec3(0.0);", "lobe.kind"),
    _Function("float", "pdf", _THREE, "return 0.0;", "lobe.kind"),
    _Function("vec3", "sample", _SAMPLE, "weight = vec3(0.0);\n    return normal;", "lobe.kind"),
    _Function("vec3", "albedo", (*_LOBE, "float cosine"), "return vec3(0.0);", "lobe.kind"),
    _Function(
        "vec3", "adjoint", (*_LOBE, "float from", "float to"), "return vec3(1.0);", "lobe.kind"
    ),
    _Function("float", "roughness", _LOBE, "return 0.0;", "lobe.kind"),
    _Function(
        "vec3",
        "transmittance",
        (*_LOBE, "float cosine", "vec3 albedo"),
        "return vec3(clamp(1.0 - largest(albedo), 0.0, 1.0));",
        "lobe.kind",
        lambda kind: "transmittance" in kind.verbs,
    ),
    _Function(
        "float",
        "by_cosine",  # half at most
        _LOBE,
        "return 0.0;",
        "lobe.kind",
        lambda kind: "by_cosine" in kind.verbs,
    ),
    _Function(
        "Microfacets",
        "microfacets",  # for who evaluates them elsewhere
        (*_LOBE, "vec3 normal", "vec3 to_viewer"),
        "return Microfacets(vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0);",
        "lobe.kind",
        lambda kind: "microfacets" in kind.verbs,
    ),
    _Function(
        "Shape",
        "turned",
        (*_LOBE, "float angle"),
        "return shape;",
        "lobe.kind",
        lambda kind: "turn" in kind.parameters,
    ),
    _Function(
        "Shape",
        "sided",
        (*_LOBE, "float side"),
        "return shape;",
        "lobe.kind",
        lambda kind: BY_SIDE in kind.parameters.values(),
    ),
    _Function(
        "bool", "transmits", ("float kind",), "return false;", "kind", lambda kind: kind.transmits
    ),
    _Function(
        "bool", "disperses", ("float kind",), "return false;", "kind", lambda kind: kind.disperses
    ),
    _Function(
        "bool", "is_diffuse", ("float kind",), "return false;", "kind", lambda kind: kind.is_diffuse
    ),
)
LIGHT_FUNCTIONS = (
    _Function("LightSample", "sample", (*_AT, "vec2 u"), "return no_light();", "light.kind"),
    _Function("float", "pdf", (*_AT, "vec3 to_light"), "return 0.0;", "light.kind"),
    _Function(
        "LightRay",
        "emit",
        ("Light light", "vec2 u", "vec2 on_light"),
        "return LightRay(light.position, light.axis, 1.0);",
        "light.kind",
    ),
    _Function("vec4", "seen", _RAY, "return vec4(0.0);", "light.kind"),
    _Function("vec3", "flux", ("Light light",), "return vec3(0.0);", "light.kind"),
    # That of a photon times what the light has photons, which differs where colours do.
    _Function(
        "vec3",
        "carried",
        ("Light light", "vec3 direction"),
        "return flux_light(light);",
        "light.kind",
        lambda kind: kind.has_image,
    ),
    _Function(
        "LightBounds",
        "bounds",
        ("Light light",),
        "return sphere_bounds(light, 0.0, ALL_AROUND);",
        "light.kind",
        lambda kind: not kind.is_distant,
    ),
)


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
            known = {"colour", "covered", "weight", *lobe.parameters}
            _check_varying(f"material {material.name!r}: {lobe.kind}", lobe.varying, known)
        _check_varying(f"material {material.name!r}", material.varying, MATERIAL_VARYING)
        for instruction in material.program:
            _check_instruction(f"material {material.name!r}", instruction)


def made_bsdf(names: Collection[str]) -> Made:
    """What a program includes as made/bsdf.glsl: lobes of these kinds, and a switch."""
    return {"made/bsdf.glsl": _made("bsdf", lobe_kinds(), names, BSDF_FUNCTIONS, "kind")}


def made_lights(names: Collection[str]) -> Made:
    """What a program includes as made/lights.glsl: lights of these kinds, a switch, whether a light
    is what lies behind all else, and a macro that puts another one for each kind that lamps have,
    in the order of their table."""
    made = _made("lights", light_kinds(), names, LIGHT_FUNCTIONS, "light")
    kinds = sorted((light_kinds()[name] for name in names), key=order)
    worlds = [f"light.kind == {kind.number}.0" for kind in kinds if kind.is_world]
    each = [f"_({kind.number}.0)" for kind in kinds if not kind.is_of_mesh]
    made += f"bool is_world(Light light) {{ return {' || '.join(worlds) or 'false'}; }}\n"
    return {"made/lights.glsl": f"{made}#define EACH_LIGHT_KIND(_) {' '.join(each)}\n"}


def made_nodes(names: Collection[str], code: str = "") -> Made:
    """What a program includes as made/nodes.glsl: nodes of these kinds, and what runs them: `code`,
    or without it the interpreter and a switch."""
    used = [node_kinds()[name] for name in sorted(names)]
    lines = [f'#include "nodes/{kind.name}.glsl"' for kind in used]
    if code:
        return {"made/nodes.glsl": "\n".join([*lines, code])}
    # Operands are fetched once for all kinds: for each it would be more code than most of them are.
    fields = ("first", "second", "third", "fourth", "fifth", "sixth")
    most = max((len(kind.operands) for kind in used), default=0)
    lines.append("vec4 run_node(Instruction node) {")
    for name in fields[:most]:
        lines.append(f"    vec4 {name} = is_given(node.{name}) ? operand(node.{name}) : vec4(0.0);")
    for kind in used:
        given = ", ".join(fields[: len(kind.operands)])
        lines.append(f"    if (node.kind == {kind.number}.0) return run_{kind.name}({given});")
    lines += ["    return vec4(0.0);", "}", '#include "lib/interpreter.glsl"']
    return {"made/nodes.glsl": "\n".join(lines) + "\n"}


def made_camera(name: str) -> Made:
    """What a program includes as made/camera.glsl: the rays of that kind."""
    lines = [
        f'#include "cameras/{name}.glsl"',
        f"EyeRay ray_camera(vec2 at) {{ return ray_{name}(at); }}",
    ]
    return {"made/camera.glsl": "\n".join(lines) + "\n"}


def light_defines(names: Collection[str]) -> Defines:
    """What a program is compiled with that includes these."""
    return {"ENVIRONMENT": 1} if any(light_kinds()[name].has_image for name in names) else {}


def _check(who: str, kinds: Mapping[str, Kind], kind: str, given: Mapping[str, Any]) -> None:
    if kind not in kinds or kinds[kind].is_of_mesh:
        known = [name for name, of_one in kinds.items() if not of_one.is_of_mesh]
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


def _made(
    folder: str,
    kinds: Mapping[str, Kind],
    names: Collection[str],
    functions: Collection[_Function],
    own: str,
) -> str:
    used = [kinds[name] for name in sorted(names)]
    lines = [f'#include "{folder}/{kind.name}.glsl"' for kind in used]
    lines += [function.switch(own, used) for function in functions]
    return "\n".join(lines) + "\n"


@lru_cache(maxsize=16)
def _kinds(root: Path, folder: str) -> Mapping[str, Kind]:
    files = sorted((root / folder).glob("*.glsl"))
    return {file.stem: _read(file, number) for number, file in enumerate(files, 1)}


def _read(file: Path, number: int) -> Kind:
    """StreamError if the file's head does not say what its parameters are."""
    text = file.read_text(encoding="utf-8")
    head = text.split("\n\n", 1)[0].replace("// ", "")
    found = _PARAMETERS.search(head)
    if not found:
        raise StreamError(f'{file}: its head has no line "// Parameters: ..."')
    named = [] if found[1] == "none" else _PARAMETER.findall(found[1])
    power = _POWER.search(head)
    verbs = frozenset(re.findall(rf"(\w+)_{file.stem}\(", text))
    is_delta, transmits = "delta lobe" in head, "on both sides" in head
    unit = power[1] if power else ""
    return Kind(file.stem, number, dict(named), is_delta, transmits, unit, verbs)


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
