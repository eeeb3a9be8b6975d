# SPDX-License-Identifier: GPL-3.0-or-later
"""DrawKernel: what is refused, and what is drawn and added up."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from addon.photon.stage.upload import upload_table
from addon.streams import Device, DrawKernel, Items, Stream, StreamError, Uniform
from addon.streams import draw as draw_module
from addon.streams.draw import Shape
from tests.unit.glsl_files import VALUE, write

# An item's rectangle, and what it adds, times what the element holds.
TEXT = """#ifdef VERTEX
void vertex() {
    vec4 box = boxes(item());
    value = float(item() + 1) * gain;
    cover(box.xy, box.zw);
}
#else
void kernel() {
    if (load_a().value.x == 0.0) skip();
    store_b(Value(value * load_a().value));
}
#endif
"""
DECLARATION: dict[str, Any] = {
    "stem": "probe",
    "inputs": {"a": VALUE},
    "outputs": {"b": VALUE},
    "uniforms": {"gain": Uniform("float")},
    "tables": {"boxes": Items()},
    "passed": {"value": "float"},
}
SHAPES = get_args(Shape)


def build(device: Device, root: Path, shape: Shape = "quad", text: str = TEXT) -> DrawKernel:
    write(root, "kernels/probe.glsl", text)
    write(root, "kernels/add_part.glsl", "void kernel() { store_sum(load_part()); }\n")
    kind: type[DrawKernel] = type("Probe", (DrawKernel,), DECLARATION)
    return kind(device, shape)


@pytest.mark.parametrize("most", [3, 2, 1])
@pytest.mark.parametrize("shape", SHAPES)
def test_items_add_up(
    device: Device, root: Path, monkeypatch: pytest.MonkeyPatch, shape: Shape, most: int
) -> None:
    """On the elements that they cover, in whatever parts they are drawn; nothing was there before.
    One lies outside, one everywhere, one on four elements; squares, as points are."""
    monkeypatch.setattr(draw_module, "MOST_ITEMS", most)
    kernel, a, b = build(device, root, shape), *(Stream(device, VALUE, (8, 8)) for _ in "ab")
    data = np.full((8, 8, 4), 2.0, np.float32)
    data[5, 5] = 0.0
    a.upload(data)
    b.fill(7.0)
    boxes = np.array([[2, 2, 3, 3], [-9, -9, 9, 9], [-0.5, -0.5, 0, 0]], np.float32)
    table = upload_table(device, boxes)
    kernel.run({"a": a, "b": b}, {"boxes": table}, {"gain": 10.0}, items=3)
    found = b.download()[..., 0]
    assert (found[2:4, 2:4] == 40.0 + 60.0).all()
    assert found[5, 5] == 0.0 and found[7, 7] == 40.0
    if shape == "quad":  # others cover more than the rectangle
        assert found.sum() == 63 * 40.0 + 4 * 60.0
    assert kernel.launches == 1
    kernel.run({"a": a, "b": b}, {"boxes": table}, {"gain": 10.0}, items=0)
    assert not b.download().any()
    for item in (kernel, a, b):
        item.release()
    device.free(table)


def test_points_beyond_the_device_are_quads(
    device: Device, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pictures = []
    boxes = upload_table(device, np.array([[-1, -1, 1, 1]], np.float32))
    for limit in (device.point_size_limit, 3.0):
        monkeypatch.setattr(device, "point_size_limit", limit)
        kernel, a, b = build(device, root, "point"), *(Stream(device, VALUE, (8, 8)) for _ in "ab")
        a.fill(1.0)
        kernel.run({"a": a, "b": b}, {"boxes": boxes}, {"gain": 1.0}, items=1)
        pictures.append(b.download())
        for item in (kernel, a, b):
            item.release()
    assert (pictures[0] == 1.0).all() and (pictures[1] == 1.0).all()
    device.free(boxes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("load_a()", "Value(vec4(1.0))", r'Probe: input "a" has no load_a\(\) in kernels/probe'),
        ("store_b", "store_c", r'Probe: output "b" has no store_b\(\)'),
        ("void vertex()", "void corner()", r"probe.glsl defines no `void vertex\(\)`"),
        ("void kernel()", "void main()", r"probe.glsl defines no `void kernel\(\)`"),
        ("value = float", "float other = float", 'Probe: passed "value" is not written in kernels'),
        ("cover(box.xy", "cover(~box.xy", r"^Probe: (.|\n)*kernels/probe\.glsl:5"),
        ("value * load_a", "nonsense * load_a", r"^Probe: (.|\n)*kernels/probe\.glsl:10"),
    ],
)
def test_refused(device: Device, root: Path, old: str, new: str, message: str) -> None:
    """At construction, naming both sides, or the line that a driver did not take."""
    with pytest.raises(StreamError, match=message):
        build(device, root, text=TEXT.replace(old, new))
    device.errors.clear()


def test_bindings_are_checked(device: Device, root: Path) -> None:
    kernel, a = build(device, root), Stream(device, VALUE, (4, 4))
    with pytest.raises(StreamError, match=r"Probe: streams \['b'\] are bound or declared"):
        kernel.run({"a": a}, {"boxes": a.texture}, {"gain": 1.0}, items=1)
    with pytest.raises(StreamError, match=r"Probe: input 'a' and output 'b' are one stream"):
        kernel.run({"a": a, "b": a}, {"boxes": a.texture}, {"gain": 1.0}, items=1)
    kernel.release()
    a.release()
