# SPDX-License-Identifier: GPL-3.0-or-later
"""Includes that are made for a program: the kinds that it has a use for, and a switch over them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from ...streams import Defines, Made
from .kinds import BY_SIDE, Kind, light_kinds, lobe_kinds, node_kinds, order


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
    _Function(
        "vec3",
        "own_normal",  # in place of the shading normal; 0: that
        _LOBE,
        "return vec3(0.0);",
        "lobe.kind",
        lambda kind: "own_normal" in kind.verbs,
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
        "by_cosine",  # the share of photons that go by the cosine, not by `sample`
        _LOBE,
        "return 0.0;",
        "lobe.kind",
        lambda kind: "by_cosine" in kind.verbs,
    ),
    _Function(
        "Microfacets",
        "microfacets",  # what the native core gathers photons with
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
    _Function(
        "bool",
        "is_about_shading",
        ("float kind",),
        "return false;",
        "kind",
        lambda kind: "is_about_shading" in kind.verbs,
    ),
    _Function(
        "bool",
        "is_softened",  # bumps that lean away darken it softly: Cycles' diffuse closures
        ("float kind",),
        "return false;",
        "kind",
        lambda kind: "is_softened" in kind.verbs,
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
    # About which a photon of this direction has left by the cosine; 0: by something else.
    _Function(
        "vec3",
        "cosine_axis",
        ("Light light", "vec3 direction"),
        "return vec3(0.0);",
        "light.kind",
        lambda kind: kind.emits_by_cosine,
    ),
    # A photon's flux times the light's number of photons [W]: another than the light's where its
    # colour goes by direction.
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
    lines += ['#include "lib/registers.glsl"', "vec4 run_node(Instruction node) {"]
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
