# SPDX-License-Identifier: GPL-3.0-or-later
"""sample_image: every way to store texels, to interpolate and to extend them, against numpy."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.photon.errors import SceneError
from addon.photon.scene import Texture
from addon.photon.stage.textures import PAGE, ROW, WORD, Texels, bytes_of, rows_of
from addon.streams import Device, Record, Stream, Table, Uniform
from tests.unit.glsl_files import VALUE, declare

KERNEL = declare(
    "sample_image",
    {"value": VALUE},
    inputs={"query": Record("Value", {"value": "vec4"})},
    tables={"texels": Table(kind="usampler2DArray")},
    uniforms={"interpolation": Uniform("int"), "extension": Uniform("int")},
)
CLOSEST, LINEAR, CUBIC = 1, 2, 4
REPEAT, EXTEND, CLIP, MIRROR = range(4)
RANDOM = np.random.default_rng(1)
SIZES = [(5, 3), (1, 1), (7, 64), (64, 7), (1, 9)]
TYPES = [np.uint8, np.uint16, np.float16, np.float32]


def texture(dtype: Any, size: tuple[int, int], channels: int, **more: Any) -> Texture:
    pixels = RANDOM.random((*size, channels))
    if np.dtype(dtype).kind == "u":
        pixels = pixels * np.iinfo(dtype).max
    else:
        pixels = 50.0 * pixels - 3.0
    return Texture(f"{np.dtype(dtype).name} {size}", pixels.astype(dtype), **more)


def asked(
    device: Device,
    layer: Any,
    textures: tuple[Texture, ...],
    queries: NDArray[Any],
    interpolation: int,
    extension: int,
) -> NDArray[np.float32]:
    """(n, 4) colours and alphas at (n, 4) queries: u, v, texture, separated."""
    texels = Texels(device, textures)
    texels.upload()
    kernel = KERNEL(device, layer)
    size = (64, -(-len(queries) // 64))
    streams = {name: Stream(device, VALUE, size) for name in ("query", "value")}
    padded = np.zeros((size[0] * size[1], 4), np.float32)
    padded[: len(queries)] = queries
    streams["query"].upload(padded.reshape(size[1], size[0], 4))
    options = {"interpolation": interpolation, "extension": extension}
    kernel.run(streams, {"texels": texels.array}, options)
    found = streams["value"].download().reshape(-1, 4)[: len(queries)]
    for item in (*streams.values(), kernel, texels):
        item.release()
    return found


def decoded(coded: NDArray[Any]) -> NDArray[Any]:
    c = np.maximum(coded, 0.0)
    return np.where(c < 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def expected(
    of: Texture, uv: NDArray[Any], interpolation: int, extension: int
) -> NDArray[np.float64]:
    """The sum over all texels of a much larger picture, made by numpy's own padding."""
    pixels = of.pixels.astype(np.float64)
    if of.pixels.dtype.kind == "u":
        pixels /= np.iinfo(of.pixels.dtype).max
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 4, axis=2)
        pixels[..., 3] = 1.0
    height, width = pixels.shape[:2]
    mode: Any = {REPEAT: "wrap", EXTEND: "edge", CLIP: "constant", MIRROR: "symmetric"}[extension]
    pad = ((3 * height + 3,) * 2, (3 * width + 3,) * 2, (0, 0))
    padded = np.pad(pixels, pad, mode=mode)
    x, y = (uv * (width, height) + [p[0] for p in (pad[1], pad[0])]).T
    near = {CLOSEST: 0.5, LINEAR: 1.0, CUBIC: 2.0}[interpolation]

    def weights(at: NDArray[Any], count: int) -> NDArray[np.float64]:
        far = np.abs(at[:, None] - (np.arange(count) + 0.5))
        if interpolation == CLOSEST:
            return np.asarray(far < near, np.float64)
        if interpolation == LINEAR:
            return np.maximum(1.0 - far, 0.0)
        inner = 2 / 3 - far**2 + far**3 / 2
        return np.where(far < 1.0, inner, np.maximum(2.0 - far, 0.0) ** 3 / 6)

    rows, columns = weights(y, padded.shape[0]), weights(x, padded.shape[1])
    found: NDArray[np.float64] = np.einsum("nh,nw,hwc->nc", rows, columns, padded)
    if of.pixels.shape[2] == 1:
        found[:, 3] = 1.0
    if of.is_srgb:
        found[:, :3] = decoded(found[:, :3])
    return found


@pytest.mark.parametrize(
    ("interpolation", "extension"),
    [*product((CLOSEST, LINEAR, CUBIC), (REPEAT, EXTEND, CLIP, MIRROR))],
)
def test_interpolation_and_extension(
    device: Device, layer: Any, interpolation: int, extension: int
) -> None:
    """Each way of storage, each shape; places up to two pictures away."""
    all_of = list(product(TYPES, SIZES, (1, 4), (False, True)))
    textures = tuple(texture(t, size, c, is_srgb=s) for t, size, c, s in all_of)
    places = RANDOM.random((len(textures), 12, 2)) * 5.0 - 2.0
    queries = np.zeros((*places.shape[:2], 4))
    queries[..., :2], queries[..., 2] = places, np.arange(len(textures))[:, None]
    queries = queries.astype(np.float32)
    found = asked(device, layer, textures, queries.reshape(-1, 4), interpolation, extension)
    for of, query, own in zip(textures, queries, found.reshape(len(textures), -1, 4), strict=True):
        uv = query[:, :2].astype(np.float64)
        wanted = expected(of, uv, interpolation, extension)
        if interpolation == CLOSEST:  # where the next texel begins is a matter of rounding
            clear = (np.abs(uv * of.pixels.shape[1::-1] % 1.0 - 0.5) < 0.499).all(axis=1)
            own, wanted = own[clear], wanted[clear]
        scale = np.abs(of.pixels.astype(float)).max() if of.pixels.dtype.kind == "f" else 1.0
        np.testing.assert_allclose(own, wanted, rtol=2e-4, atol=1e-4 * scale, err_msg=of.name)


def test_alpha(one_bench: Any) -> None:
    """A colour is divided by an alpha that is neither 0 nor 1, before it is decoded."""
    pixels = np.array([[[51, 51, 51, 102], [40, 40, 40, 0], [40, 40, 40, 255]]], np.uint8)
    for is_srgb, separated in product((False, True), (0, 1)):
        place = np.array([[(i + 0.5) / 3, 0.5, 0, separated] for i in range(3)])
        found = asked(
            one_bench.device, "fragment", (Texture("a", pixels, is_srgb),), place, CLOSEST, REPEAT
        )
        stored = np.array([127.5 / 255 if separated else 0.2, 40 / 255, 40 / 255])
        wanted = decoded(stored) if is_srgb else stored
        np.testing.assert_allclose(found[:, 0], wanted, rtol=1e-5)
        np.testing.assert_allclose(found[:, 3], [0.4, 0.0, 1.0], rtol=1e-6)


def test_many_layers(device: Device, layer: Any) -> None:
    """Texels of one image in several layers are found to the last, each where it is."""
    height, width = 2 * PAGE + 1, ROW  # bytes of RGBA: a row of texels is a row of words
    pixels = np.zeros((height, width, 4), np.uint8)
    words = pixels.view(np.uint32)[..., 0]
    words[:] = np.arange(height * width, dtype=np.uint32).reshape(height, width)
    textures = (Texture("small", pixels[:3, :5].copy()), Texture("large", pixels))
    rows = rows_of(textures)
    assert rows == [1, 2, 2 + height] and bytes_of(textures) == 3 * PAGE * ROW * WORD
    at = RANDOM.integers(0, (width, height), (60, 2))
    at[:6] = [
        [0, 0],
        [width - 1, height - 1],
        [0, PAGE - 2],
        [5, PAGE - 1],
        [0, PAGE],
        [7, 2 * PAGE],
    ]
    queries = np.column_stack([(at + 0.5) / (width, height), np.full((60, 2), (1, 0))])
    found = asked(device, layer, textures, queries, CLOSEST, REPEAT)
    np.testing.assert_allclose(found * 255, pixels[at[:, 1], at[:, 0]], atol=1e-3)


def test_half_numbers_by_hand(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What OpenGL before 4.2 decodes itself: the same, but for what is below 6.1e-5."""
    bits = np.arange(0, 0x7C00, 7, dtype=np.uint16)
    bits = np.concatenate([bits, bits | 0x8000])
    pixels = bits.view(np.float16).reshape(-1, 1, 1)
    place = np.zeros((len(bits), 4))
    place[:, 1] = (np.arange(len(bits)) + 0.5) / len(bits)
    monkeypatch.setattr(device, "glsl_version", 330)
    found = asked(device, "fragment", (Texture("half", pixels),), place, CLOSEST, REPEAT)
    np.testing.assert_allclose(found[:, 0], pixels[:, 0, 0].astype(float), rtol=1e-6, atol=6.2e-5)


def test_places_that_are_none(device: Device, layer: Any) -> None:
    """NaN, infinite and very far places give finite colours."""
    odd = [np.nan, np.inf, -np.inf, 1e30, -1e9]
    queries = np.array([[*pair, 0, 0] for pair in pairwise([*odd, 0.5, *odd])])
    for interpolation, extension in product((CLOSEST, LINEAR, CUBIC), range(4)):
        some = (texture(np.uint8, (5, 3), 4),)
        assert np.isfinite(asked(device, layer, some, queries, interpolation, extension)).all()


def test_too_many_for_a_device(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "layer_limit", 1)
    large = texture(np.float32, (PAGE, ROW), 1)
    textures = (replace(large, name="leaf"), texture(np.uint8, (4, 4), 4))
    with pytest.raises(SceneError, match=rf"texture limit .* 'leaf' with {ROW}x{PAGE} texels"):
        Texels(device, textures).upload()
