# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a kernel depends on what it is compiled with: ports, uniforms, tables, includes, rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.stage.upload import texels_of, upload_table
from addon.streams import Device, Record, Stream, StreamError, Table, Uniform, When
from addon.streams.declaration import in_registers
from addon.streams.source import expand
from tests.unit.glsl_files import VALUE, declare, write

OTHER = Record("Other", {"x": "float"})
TEXT = """void kernel() {
    vec4 value = load_a().value;
#ifdef MORE
    value += load_c().value * gain + texelFetch(look_up, ivec2(0), 0);
    store_d(Value(value));
#endif
    store_b(Value(value));
}
"""
OPTIONAL: dict[str, Any] = {
    "inputs": {"a": VALUE, "c": When("MORE", VALUE)},
    "outputs": {"b": VALUE, "d": When("MORE", VALUE)},
    "uniforms": {"gain": When("MORE", Uniform("float"))},
    "tables": {"look_up": When("MORE", Table())},
    "structure": ("MORE",),
}


def ones(device: Device, width: int = 3, height: int = 2, times: float = 1.0) -> Stream:
    stream = Stream(device, VALUE, (width, height))
    stream.upload(np.full((height, width, 4), times, np.float32))
    return stream


def test_ports_that_are_there_with_their_define(device: Device, layer: Any, root: Path) -> None:
    write(root, "kernels/probe.glsl", TEXT)
    kind = declare("probe", **OPTIONAL)
    plain = kind(device, layer)
    assert [*plain.inputs, *plain.outputs] == ["a", "b"] and not plain.uniforms and not plain.tables
    a, b, c, d = (ones(device, times=x) for x in (1.0, 0.0, 10.0, 0.0))
    plain.run({"a": a, "b": b})
    assert (b.download() == 1.0).all()
    more = kind(device, layer, {"MORE": 1})
    assert [*more.inputs, *more.outputs] == ["a", "c", "b", "d"]
    more.run({"a": a, "b": b, "c": c, "d": d}, {"look_up": c.texture}, {"gain": 2.0})
    assert (b.download() == 31.0).all() and (d.download() == 31.0).all()
    with pytest.raises(StreamError, match=r"Probe: streams \['c', 'd'\] are bound or declared"):
        plain.run({"a": a, "b": b, "c": c, "d": d})
    with pytest.raises(StreamError, match=r"Probe: streams \['c', 'd'\] are bound or declared"):
        more.run({"a": a, "b": b}, {"look_up": c.texture}, {"gain": 2.0})
    with pytest.raises(StreamError, match=r"Probe: uniforms \['gain'\] are bound or declared"):
        plain.run({"a": a, "b": b}, uniforms={"gain": 2.0})


def test_optional_ports_are_held_against_the_file(device: Device, layer: Any, root: Path) -> None:
    """Whichever defines it is compiled with."""
    write(root, "kernels/probe.glsl", TEXT.replace("load_c()", "load_a()"))
    for defines in ({}, {"MORE": 1}):
        with pytest.raises(StreamError, match=r'Probe: input "c" has no load_c\(\)'):
            declare("probe", **OPTIONAL)(device, layer, defines)


def test_only_its_own_structure_is_compiled_in(device: Device, layer: Any, root: Path) -> None:
    """Kernels are given all that a scene is compiled with; one program serves what differs in what
    a kernel does not look at."""
    write(root, "kernels/probe.glsl", TEXT)
    kind = declare("probe", **OPTIONAL)
    texts = [
        kind.source(layer, 450, defines).text
        for defines in ({}, {"ELSE": 3}, {"MORE": 1}, {"MORE": 1, "ELSE": 4})
    ]
    assert texts[0] == texts[1] != texts[2] == texts[3]
    assert "#define MORE 1" in texts[2] and "ELSE" not in texts[3]


def test_included_again_under_another_condition(device: Device, layer: Any, root: Path) -> None:
    """A file that is first included under an #ifdef that does not hold is there all the same, and
    what stands under that one is not."""
    write(root, "lib/deep.glsl", "float deep() { return 2.0; }\n")
    write(
        root, "lib/some.glsl", '#include "lib/deep.glsl"\nfloat some() { return 3.0 * deep(); }\n'
    )
    text = '#ifdef MORE\n#include "lib/some.glsl"\n#endif\n#include "lib/some.glsl"\n'
    text += '#include "lib/deep.glsl"\n'
    text += "void kernel() { store_b(Value(vec4(some() + deep()))); }\n"
    write(root, "kernels/probe.glsl", text)
    kind = declare("probe", {"b": VALUE}, structure=("MORE",))
    for defines in ({}, {"MORE": 1}):
        b = ones(device)
        kind(device, layer, defines).run({"b": b})
        assert (b.download() == 8.0).all()
    for header in ("", "#define MORE 1"):
        source = expand("kernels/probe.glsl", header)
        lines = zip(source.places, source.text.splitlines(), strict=True)
        at = [place for place, line in lines if "3.0 * deep" in line]
        assert at == ["lib/some.glsl:2"] and "#ifdef" not in source.text


def test_branches_that_nothing_defines_are_not_compiled(root: Path) -> None:
    """They are left out of the text, and so is what they include; #if of numbers is a driver's."""
    write(root, "lib/some.glsl", "#define INNER\n")
    lines = ["#ifdef MORE", '#include "lib/some.glsl"', "more", "#ifdef INNER", "inner", "#endif"]
    lines += ["#else", "less", "#endif", "#ifndef MORE", "none", "#endif"]
    lines += ["#if MORE > 1", "asked", "#else", "not asked", "#endif"]
    write(root, "kernels/probe.glsl", "\n".join(lines))
    asked = lines[-5:]
    assert expand("kernels/probe.glsl", "").text.split("\n")[:-1] == ["less", "none", *asked]
    more = expand("kernels/probe.glsl", "#define MORE 1").text.split("\n")[1:-1]
    assert more == ["#define INNER", "more", "inner", *asked]
    write(root, "kernels/probe.glsl", "#ifdef MORE\n#elif LESS\n#endif\n")
    with pytest.raises(StreamError, match="elif"):
        expand("kernels/probe.glsl", "")


def test_made_includes(device: Device, layer: Any, root: Path) -> None:
    write(root, "lib/real.glsl", "float real() { return 5.0; }\n")
    write(
        root,
        "kernels/probe.glsl",
        '#include "made/some.glsl"\nvoid kernel() { store_b(Value(vec4(made() * real()))); }\n',
    )
    kind = declare("probe", {"b": VALUE})
    made = '#include "lib/real.glsl"\nfloat made() { return %s; }\n'
    for value in (2.0, 3.0):  # one path, two texts
        b = ones(device)
        kind(device, layer, made={"made/some.glsl": made % value}).run({"b": b})
        assert (b.download() == 5.0 * value).all()
    with pytest.raises(StreamError, match=r"probe.glsl:1: nothing was given for 'made/some"):
        kind(device, layer)
    with pytest.raises(StreamError, match=r"made/some\.glsl:2"):
        kind(device, layer, made={"made/some.glsl": made % "nonsense"})
    device.errors.clear()


# Records of several texels.

BIG = Record(
    "BigOne", {"a": "vec3", "b": "vec2", "c": "float", "d": "vec2", "e": "vec4", "f": "float"}
)


def test_fields_that_do_not_fit_begin_a_texel() -> None:
    assert BIG.texels == 5  # a | b c | d | e | f
    offsets = {name: BIG.dtype.fields[name][1] // 4 for name in BIG.fields}  # type: ignore[index]
    assert offsets == {"a": 0, "b": 4, "c": 6, "d": 8, "e": 12, "f": 16}
    assert BIG.dtype.itemsize == 5 * 16
    glsl = BIG.glsl()
    assert (
        "BigOne unpack_BigOne(vec4 texel0, vec4 texel1, vec4 texel2, vec4 texel3, vec4 texel4)"
        in glsl
    )
    assert "texel0.xyz, texel1.xy, texel1.z, texel2.xy, texel3.xyzw, texel4.x" in glsl
    assert " pack_BigOne" not in glsl  # what is of several texels is read from tables alone
    assert BIG.layout == "vec3 a; vec2 b; float c; vec2 d; vec4 e; float f"


def test_elements_of_a_table(device: Device, layer: Any, root: Path) -> None:
    """numpy writes what GLSL reads, also where an element lies in two rows."""
    write(
        root,
        "kernels/probe.glsl",
        "void kernel() { BigOne x = big_one_at(815 + element_index());"
        " store_b(Value(vec4(x.a.z, x.b.y + 100.0 * x.c, x.d.x + 100.0 * x.d.y, x.f)));"
        " store_c(Value(x.e)); }\n",
    )
    kernel = declare("probe", {"b": VALUE, "c": VALUE}, tables={"things": Table(BIG)})(
        device, layer
    )
    data = BIG.zeros(830)
    rng = np.random.default_rng(1)
    for name in BIG.fields:
        data[name] = rng.integers(0, 90, data[name].shape)
    table = upload_table(device, texels_of(data))
    assert table.size == (4096, 2)
    b, c = ones(device, 5, 3), ones(device, 5, 3)
    kernel.run({"b": b, "c": c}, {"things": table})
    some = data[815:]
    expected = (
        some["a"][:, 2],
        some["b"][:, 1] + 100 * some["c"],
        some["d"][:, 0] + 100 * some["d"][:, 1],
        some["f"],
    )
    assert np.array_equal(b.download().reshape(-1, 4), np.stack(expected, 1))
    assert np.array_equal(c.download().reshape(-1, 4), some["e"])
    table.release()


def test_registers_refuse_ports_of_one_name_and_other_records() -> None:
    one = declare("one", {"port": VALUE}).declaration({})
    other = declare("other", {"port": OTHER}).declaration({})
    with pytest.raises(StreamError, match="Other: port 'port' is Other, before Value"):
        in_registers([("One", one), ("Other", other)], {}, [])
