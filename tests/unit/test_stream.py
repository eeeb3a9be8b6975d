# SPDX-License-Identifier: GPL-3.0-or-later
"""Record and Stream: layouts, sizes, uploads."""

from __future__ import annotations

import numpy as np
import pytest

from addon.streams import Device, PingPong, Record, Stream, StreamError
from tests.unit.glsl_files import VALUE


def test_record_writes_its_layout_once() -> None:
    glsl = Record("Ray", {"direction": "vec3", "reach": "float"}).glsl()
    assert "struct Ray { vec3 direction; float reach; };" in glsl
    assert "return Ray(texel.xyz, texel.w);" in glsl
    assert "return vec4(record.direction, record.reach);" in glsl


def test_short_record_is_filled_with_zeros() -> None:
    glsl = Record("Place", {"at": "vec2"}).glsl()
    assert "return Place(texel.xy);" in glsl
    assert "return vec4(record.at, 0.0, 0.0);" in glsl


def test_channels_follow_each_other() -> None:
    glsl = Record("Four", {"a": "float", "b": "vec2", "c": "float"}).glsl()
    assert "return Four(texel.x, texel.yz, texel.w);" in glsl


def test_a_stream_has_one_texel_an_element(device: Device) -> None:
    Stream(device, Record("Full", {"a": "vec3", "b": "float"}), (1, 1)).release()
    with pytest.raises(StreamError, match="stream of Big: 2 texels an element, not 1"):
        Stream(device, Record("Big", {"a": "vec3", "b": "vec2"}), (1, 1))


def test_unknown_field_type() -> None:
    with pytest.raises(StreamError, match="record Odd: no field type 'int'"):
        Record("Odd", {"a": "vec2", "b": "int"})


@pytest.mark.parametrize("size", [(0, 1), (1, 0), (-4, 4), (1, 1 << 20), (1 << 20, 1)])
def test_size_outside_limits(device: Device, size: tuple[int, int]) -> None:
    with pytest.raises(StreamError, match=rf"stream of Value: size \({size[0]}, {size[1]}\) is"):
        Stream(device, VALUE, size)


def test_largest_row(device: Device) -> None:
    stream = Stream(device, VALUE, (device.texture_limit, 1))
    data = np.arange(4 * device.texture_limit, dtype=np.float32).reshape(1, -1, 4)
    stream.upload(data)
    assert np.array_equal(stream.download(), data)
    stream.release()


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (257, 2)])
def test_what_goes_up_comes_down(device: Device, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    data = rng.normal(size=(size[1], size[0], 4)).astype(np.float32)
    data[0, 0] = (np.nan, np.inf, -0.0, 1e-42)  # also what is no number, and a denormal
    stream = Stream(device, VALUE, size)
    stream.upload(data)
    assert stream.download().tobytes() == data.tobytes()
    stream.upload(data[:, ::-1])  # not contiguous
    assert stream.download().tobytes() == data[:, ::-1].tobytes()
    stream.clear()
    assert not stream.download().any()
    stream.release()


@pytest.mark.parametrize("software", [True, False])
def test_fill(device: Device, monkeypatch: pytest.MonkeyPatch, software: bool) -> None:
    """By drawing, and by a compute program as on GPUs: all texels, and no more than these."""
    monkeypatch.setattr(device, "is_software", software)
    stream, other = (Stream(device, VALUE, (300, 7)) for _ in range(2))
    other.fill(2.0)
    stream.fill(-1.5)
    assert (stream.download() == -1.5).all() and (other.download() == 2.0).all()
    for item in (stream, other):
        item.release()


@pytest.mark.parametrize(
    ("data", "got"),
    [
        (np.zeros((5, 3, 4)), r"float64\(5, 3, 4\)"),
        (np.zeros((3, 5, 4), np.float32), r"float32\(3, 5, 4\)"),
        (np.zeros((5, 3, 3), np.float32), r"float32\(5, 3, 3\)"),
        (np.zeros((15, 4), np.float32), r"float32\(15, 4\)"),
    ],
)
def test_upload_of_another_shape_or_type(device: Device, data: np.ndarray, got: str) -> None:
    stream = Stream(device, VALUE, (3, 5))
    expected = rf"stream of Value: expected float32\(5, 3, 4\), got {got}"
    with pytest.raises(StreamError, match=expected):
        stream.upload(data)
    stream.release()


def test_ping_pong_swaps(device: Device) -> None:
    pair = PingPong(device, VALUE, (2, 2))
    front, back = pair.front, pair.back
    assert front is not back and front.size == back.size == (2, 2)
    pair.swap()
    assert pair.front is back and pair.back is front
    pair.release()


def test_ping_pong_from_another_stream(device: Device) -> None:
    """It is read once, and then the pair's own take turns."""
    pair, zeros = PingPong(device, VALUE, (2, 2)), Stream(device, VALUE, (2, 2))
    own = {id(pair.front), id(pair.back)}
    for swaps in (0, 1, 2, 3):  # whichever was written last
        for _ in range(swaps):
            pair.swap()
        pair.restart(zeros)
        assert pair.front is zeros and id(pair.back) in own
        for _ in range(3):
            written = pair.back
            pair.swap()
            assert pair.front is written and {id(pair.front), id(pair.back)} == own
    for item in (pair, zeros):
        item.release()
