# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernel: what is refused, and what runs, on both layers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.stage.upload import upload_table
from addon.streams import (
    TEXEL,
    Device,
    Items,
    Kernel,
    PingPong,
    Record,
    Stream,
    StreamError,
    Table,
    Uniform,
)
from addon.streams.declaration import GROUPS
from tests.unit.glsl_files import VALUE, declare, write

OTHER = Record("Other", {"x": "float"})
IN, OUT = {"a": VALUE}, {"b": VALUE}
DOUBLE = "void kernel() { store_b(Value(2.0 * load_a().value)); }\n"


def build(device: Device, layer: str, root: Path, text: str, **declaration: Any) -> Kernel:
    """A kernel of this text with input a and output b, unless told otherwise."""
    write(root, "kernels/probe.glsl", text)
    return declare("probe", **{"inputs": IN, "outputs": OUT} | declaration)(device, layer)


def stream(device: Device, width: int = 3, height: int = 2, record: Record = VALUE) -> Stream:
    """A stream whose channels count up from one."""
    made = Stream(device, record, (width, height))
    made.upload(np.arange(1, 4 * width * height + 1, dtype=np.float32).reshape(height, width, 4))
    return made


# Construction.


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "void kernel() { store_b(Value(vec4(1.0))); }",
            r'Probe: input "a" has no load_a\(\) in kernels/probe.glsl',
        ),
        (
            "void kernel() { vec4 v = load_a().value; }",
            r'Probe: output "b" has no store_b\(\) in kernels/probe.glsl',
        ),
        (
            "void kernel() { store_b(Value(load_a().value + load_c().value)); }",
            r'kernels/probe.glsl: load_c\(\) has no input "c" in Probe',
        ),
        (
            "void kernel() { store_b(load_a()); store_d(load_a()); }",
            r'kernels/probe.glsl: store_d\(\) has no output "d" in Probe',
        ),
        (
            "void kernel() { store_b(Value(vec4(1.0))); } // load_a() in a comment is none",
            r'Probe: input "a" has no load_a\(\)',
        ),
        ("void main() { }", r"Probe: kernels/probe.glsl defines no `void kernel\(\)`"),
    ],
)
def test_declaration_against_file(
    device: Device, layer: str, root: Path, text: str, message: str
) -> None:
    with pytest.raises(StreamError, match=message):
        build(device, layer, root, text)


@pytest.mark.parametrize("count", [0, 9])
def test_number_of_outputs(device: Device, layer: str, root: Path, count: int) -> None:
    outputs = {f"o{i}": VALUE for i in range(count)}
    with pytest.raises(StreamError, match=f"Probe: {count} outputs, 1 to 8 are possible"):
        build(device, layer, root, "void kernel() { }", inputs={}, outputs=outputs)


def places(device: Device, build_it: Callable[[], object]) -> set[str]:
    """The `file:line` places that the message of a refused program names."""
    with pytest.raises(StreamError, match=r"^Probe: ") as raised:
        build_it()
    device.errors.clear()  # test_device_works_after_a_refusal is about these
    return set(re.findall(r"(?m)^(.+?:\d+)", str(raised.value)))


def test_error_in_the_kernel_names_its_line(device: Device, layer: str, root: Path) -> None:
    text = "// one\nvoid kernel() {\n    store_b(load_a());\n    nonsense = 1.0;\n}\n"
    assert places(device, lambda: build(device, layer, root, text)) == {"kernels/probe.glsl:4"}


def test_error_in_a_nested_include_names_its_line(device: Device, layer: str, root: Path) -> None:
    write(root, "lib/deep.glsl", "float fine;\n\nfloat deep() { return broken; }\n")
    write(root, "lib/outer.glsl", '// outer\n#include "lib/deep.glsl"\nfloat after = 1.0;\n')
    text = '#include "lib/outer.glsl"\nvoid kernel() { store_b(load_a()); }\n'
    assert places(device, lambda: build(device, layer, root, text)) == {"lib/deep.glsl:3"}


def test_error_after_an_include_names_its_line(device: Device, layer: str, root: Path) -> None:
    write(root, "lib/deep.glsl", "float fine;\n\n\n\n")
    text = '// one\n#include "lib/deep.glsl"\nvoid kernel() {\n    store_b(load_a());\n    ~;\n}\n'
    assert places(device, lambda: build(device, layer, root, text)) == {"kernels/probe.glsl:5"}


def test_missing_kernel_file(device: Device, layer: str, root: Path) -> None:
    """A StreamError as for any include, not Python's FileNotFoundError."""
    with pytest.raises(StreamError, match=r"kernels/none\.glsl"):
        declare("none", OUT)(device, layer)


def test_device_works_after_a_refusal(device: Device, layer: str, root: Path) -> None:
    """The driver's message was raised once; it must not come up again at the next check."""
    with pytest.raises(StreamError):
        build(device, layer, root, "void kernel() { store_b(load_a()) }")
    told, device.errors[:] = [*device.errors], []
    kernel = build(device, layer, root, DOUBLE)
    a, b = stream(device), stream(device)
    kernel.run({"a": a, "b": b})
    assert np.array_equal(b.download(), 2 * a.download())
    assert told == []


# Running.


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("missing input", r"Probe: streams \['a'\] are bound or declared, but not both"),
        ("missing output", r"Probe: streams \['b'\] are bound or declared, but not both"),
        ("unknown port", r"Probe: streams \['c'\] are bound or declared, but not both"),
        ("missing uniform", r"Probe: uniforms \['gain'\] are bound or declared, but not both"),
        ("unknown uniform", r"Probe: uniforms \['gian'\] are bound or declared, but not both"),
        ("missing table", r"Probe: tables \['look_up'\] are bound or declared, but not both"),
        ("wrong record", r"Probe: port 'a' is a stream of Value, got Other"),
        ("wrong output record", r"Probe: port 'b' is a stream of Value, got Other"),
        ("plain output", r"Probe: port 'b' is a stream of Value, got Texel"),
        ("wrong size", r"Probe: port 'a' is \(4, 2\), others are \(3, 2\)"),
        ("in and out", r"Probe: input 'a' and output 'b' are one stream"),
    ],
)
def test_bindings(device: Device, layer: str, root: Path, case: str, message: str) -> None:
    text = (
        "void kernel() {"
        " store_b(Value(load_a().value * gain + texelFetch(look_up, ivec2(0), 0))); }"
    )
    declaration = {"uniforms": {"gain": Uniform("float")}, "tables": {"look_up": Table()}}
    kernel = build(device, layer, root, text, **declaration)
    streams = {"a": stream(device), "b": stream(device)}
    uniforms, tables = {"gain": 1.0}, {"look_up": stream(device).texture}
    kernel.run(streams, tables, uniforms)  # as it should be
    before = streams["b"].download()
    match case:
        case "missing input":
            del streams["a"]
        case "missing output":
            del streams["b"]
        case "unknown port":
            streams["c"] = streams["a"]
        case "missing uniform":
            uniforms = {}
        case "unknown uniform":
            uniforms["gian"] = 2.0
        case "missing table":
            tables = {}
        case "wrong record":
            streams["a"] = stream(device, record=OTHER)
        case "wrong output record":
            streams["b"] = stream(device, record=OTHER)
        case "plain output":
            streams["b"] = stream(device, record=TEXEL)
        case "wrong size":
            streams["a"] = stream(device, width=4)
        case "in and out":
            streams["b"] = streams["a"]
    with pytest.raises(StreamError, match=message):
        kernel.run(streams, tables, uniforms)
    assert kernel.launches == 1
    if case.startswith(("missing uniform", "unknown", "wrong size")):
        assert np.array_equal(streams["b"].download(), before)


def test_four_plain_numbers_fit_every_input(device: Device, layer: str, root: Path) -> None:
    kernel = build(device, layer, root, "void kernel() { store_b(load_a()); }")
    a, b = stream(device, record=TEXEL), stream(device)
    kernel.run({"a": a, "b": b})
    assert np.array_equal(b.download(), a.download())


def test_one_stream_on_two_outputs(device: Device, layer: str, root: Path) -> None:
    text = "void kernel() { store_b(Value(vec4(1.0))); store_c(Value(vec4(2.0))); }"
    kernel = build(device, layer, root, text, inputs={}, outputs={"b": VALUE, "c": VALUE})
    b = stream(device)
    with pytest.raises(StreamError, match=r"Probe: one stream .* two outputs of \['b', 'c'\]"):
        kernel.run({"b": b, "c": b})


def test_eight_outputs(device: Device, layer: str, root: Path) -> None:
    names = [*"stuvwxyz"]
    stores = " ".join(f"store_{n}(Value(load_a().value + {i}.0));" for i, n in enumerate(names))
    outputs = dict.fromkeys(names, VALUE)
    kernel = build(device, layer, root, f"void kernel() {{ {stores} }}", outputs=outputs)
    a, made = stream(device), {name: stream(device) for name in names}
    kernel.run({"a": a, **made})
    for i, name in enumerate(names):
        assert np.array_equal(made[name].download(), a.download() + i)


def test_elements_are_where_they_say(device: Device, layer: str, root: Path) -> None:
    """Also where the size is no multiple of a work group."""
    text = "void kernel() { store_b(Value(vec4(element(), element_index(), 1.0))); }"
    kernel = build(device, layer, root, text, inputs={})
    b = stream(device, 13, 9)
    assert kernel.count({"b": b}).wait() == 13 * 9
    x, y = np.meshgrid(np.arange(13), np.arange(9))
    assert np.array_equal(b.download(), np.stack([x, y, y * 13 + x, np.ones_like(x)], -1))


def test_skip_leaves_zero_and_does_not_count(device: Device, layer: str, root: Path) -> None:
    text = (
        "void kernel() { store_b(Value(vec4(7.0))); store_c(Value(vec4(8.0)));"
        " if (element_index() % keep != 0) skip(); }"
    )
    kernel = build(
        device,
        layer,
        root,
        text,
        inputs={},
        outputs={"b": VALUE, "c": VALUE},
        uniforms={"keep": Uniform("int")},
    )
    b, c = stream(device, 21, 10), stream(device, 21, 10)
    alive = np.arange(210).reshape(10, 21) % 4 == 0
    streams = {"b": b, "c": c}
    assert kernel.count(streams, uniforms={"keep": 4}).wait() == alive.sum()
    for made, value in ((b, 7.0), (c, 8.0)):
        assert np.array_equal(made.download(), np.where(alive[..., None], [value] * 4, [0.0] * 4))
    # Counts don't add up over runs, those that nobody counted included.
    assert kernel.count(streams, uniforms={"keep": 3}).wait() == 70
    kernel.run(streams, uniforms={"keep": 1})
    assert kernel.count(streams, uniforms={"keep": 1}).wait() == 210
    assert kernel.count(streams, uniforms={"keep": 1000}).wait() == 1
    assert kernel.launches == 5


def test_defines_choose_structure(device: Device, layer: str, root: Path) -> None:
    text = "void kernel() { store_b(Value(vec4(FACTOR) * load_a().value)); }"
    write(root, "kernels/probe.glsl", text)
    probe = declare("probe", OUT, inputs=IN, structure=("FACTOR",))
    a, b = stream(device), stream(device)
    for factor in (3, 0.5):
        probe(device, layer, {"FACTOR": factor}).run({"a": a, "b": b})
        assert np.array_equal(b.download(), factor * a.download())


@pytest.mark.parametrize(
    ("threads", "lanes"),
    [(threads, lanes) for threads, by_lanes in GROUPS.items() for lanes in by_lanes],
)
@pytest.mark.parametrize("size", [(3, 2), (9, 17)])
def test_lanes_share_an_element(
    device: Device,
    root: Path,
    monkeypatch: pytest.MonkeyPatch,
    threads: int,
    lanes: int,
    size: tuple[int, int],
) -> None:
    """Each takes its part of a loop; the element is written and counted once."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    assert math.prod(GROUPS[threads][lanes]) * lanes == threads
    monkeypatch.setattr(device, "warp", threads)
    write(
        root,
        "kernels/probe.glsl",
        "void kernel() { vec4 sum = vec4(0.0), own = load_a().value;"
        " for (int i = lane(); i < 50; i += LANES) sum += float(i) * own;"
        " store_b(Value(sum_over_lanes(sum))); }",
    )
    kernel = declare("probe", inputs=IN, outputs=OUT)(device, "compute", lanes=lanes)
    a, b = stream(device, *size), Stream(device, VALUE, size)
    assert kernel.count({"a": a, "b": b}).wait() == size[0] * size[1]
    assert np.array_equal(b.download(), 1225 * a.download())


@pytest.mark.parametrize("kind", ["vec4", "uint"])
def test_lists(device: Device, layer: str, root: Path, kind: str) -> None:
    """Read by number: a buffer in compute programs, else a texture, of several rows here."""
    write(
        root,
        "kernels/probe.glsl",
        "void kernel() { int i = 4095 + element_index();"
        " store_b(Value(load_a().value * 0.0 + vec4(numbers(i)))); }",
    )
    kernel = declare("probe", inputs=IN, outputs=OUT, tables={"numbers": Items(kind)})(
        device, layer
    )
    count = 4 * 4101 if kind == "vec4" else 4101
    numbers = np.arange(count, dtype="f4" if kind == "vec4" else "u4").reshape(4101, -1)
    table = device.ctx.buffer(numbers) if layer == "compute" else upload_table(device, numbers)
    b = Stream(device, VALUE, (3, 2))
    kernel.run({"a": stream(device), "b": b}, {"numbers": table})
    assert np.array_equal(b.download().reshape(6, 4), np.broadcast_to(numbers[4095:], (6, 4)))
    table.release()


def test_bindings_one_by_one(
    device: Device, layer: str, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where OpenGL does not bind many at a time: the same bits."""
    write(
        root,
        "kernels/probe.glsl",
        "void kernel() { vec4 v = load_a().value + numbers(element_index()); "
        "store_b(Value(v)); store_c(Value(v * load_d().value)); }",
    )
    tables, results = {"numbers": Items("vec4")}, []
    kernel = declare("probe", inputs=IN | {"d": VALUE}, outputs=OUT | {"c": VALUE}, tables=tables)(
        device, layer
    )
    numbers = np.arange(24, dtype="f4").reshape(6, 4)
    table = device.ctx.buffer(numbers) if layer == "compute" else upload_table(device, numbers)
    for is_whole in (device.bind.is_whole, False):
        monkeypatch.setattr(device.bind, "is_whole", is_whole)
        streams = {"a": stream(device), "d": stream(device)}
        streams |= {name: Stream(device, VALUE, (3, 2)) for name in "bc"}
        kernel.run(streams, {"numbers": table})
        results.append([streams[name].download() for name in "bc"])
    for whole, single in zip(*results, strict=True):
        np.testing.assert_array_equal(whole, single)
    assert results[0][0].max() == 24 + 23
    table.release()


def test_ping_pong_loop(device: Device, layer: str, root: Path) -> None:
    kernel = build(device, layer, root, DOUBLE)
    pair = PingPong(device, VALUE, (3, 2))
    start = stream(device).download()
    pair.front.upload(start)
    for _ in range(5):
        kernel.run({"a": pair.front, "b": pair.back})
        pair.swap()
    assert np.array_equal(pair.front.download(), 32 * start)
    assert np.array_equal(pair.back.download(), 16 * start)
    with pytest.raises(StreamError, match="are one stream"):
        kernel.run({"a": pair.front, "b": pair.front})


def test_layers_are_bit_equal(device: Device, root: Path) -> None:
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    text = "void kernel() { vec4 v = load_a().value; store_b(Value(v / 3.0 + v * v)); }"
    a, results = stream(device, 37, 11), []
    for layer in ("fragment", "compute"):
        b = stream(device, 37, 11)
        build(device, layer, root, text).run({"a": a, "b": b})
        results.append(b.download().tobytes())
    assert results[0] == results[1]
