# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene taken apart is put together to the bit, and what is the same is told by content."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import RenderError, SceneError
from addon.photon.photons.kept import same_but_view
from addon.photon.scene import Instruction, Light, Lobe, Material, Result, Rows, Scene
from addon.photon.scene.snapshot import INLINE, pack, same, unpack
from tests.scenes import cornell
from tests.unit.test_scene_files import awkward

LONG = np.arange(100_000, dtype=np.float32)  # repr() leaves out its middle


def changed(array: Any, place: int, value: float) -> Any:
    """A copy with another number there."""
    other = array.copy()
    other[place] = value
    return other


def written(value: Any) -> Any:
    """A scene's value as text that tells what `==` doesn't."""
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.shape, value.tobytes()
    if is_dataclass(value):
        return type(value), [(f.name, written(getattr(value, f.name))) for f in fields(value)]
    if isinstance(value, dict):
        return {name: written(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [written(item) for item in value]
    return repr(float(value) if isinstance(value, float) else value)  # numpy 2 writes its own so


def put_together(scene: Scene) -> Scene:
    return unpack(pack(scene))


def lobed() -> Scene:
    """A scene whose lobes have parameters that are numbers and colours."""
    third = 1.0 / 3.0
    parameters = {"alpha_x": third, "alpha_y": 1e-300, "tint": (0.1, -0.0, third)}
    lobes = tuple(Lobe("ggx_metal", (third, 0.0, 1.0), parameters, w, (0.1,) * 3) for w in (1, 0.1))
    return replace(cornell(), materials=(Material("m", lobes=lobes), *cornell().materials))


def programmed() -> Scene:
    """A material whose program has results, constants and rows of them."""
    row = (1.0 / 3.0, -0.0, 1e-300, 1.0)
    program = (
        Instruction("geometry", (row,)),
        Instruction("ramp", (Result(0, "x"), Rows((row, row)))),
    )
    lobe = Lobe("mirror", (1.0, 1.0, 1.0), varying={"colour": Result(1)})
    made = Material("m", lobes=(lobe,), program=program, varying={"diffuse": Result(1, "w")})
    return replace(cornell(), materials=(made, *cornell().materials))


@pytest.mark.parametrize("make", [cornell, awkward, lobed, programmed])
def test_what_is_packed_is_unpacked_to_the_bit(make: Callable[[], Scene]) -> None:
    scene = make()
    again = put_together(scene)
    assert written(scene) == written(again) and same(scene, again)
    assert same(put_together(again), again)
    assert type(again.lights) is type(again.lights[0].power) is tuple


def test_values_that_text_loses() -> None:
    scene = awkward()
    again = put_together(scene)
    assert np.signbit(again.lights[0].position[1]) and np.signbit(again.vertices[0, 1])
    assert np.isnan(again.vertices[0, 0]) and again.vertices[0, 2] == 5e-324
    assert again.materials[-2].lobes[0].kind == "mirror" and again.camera.clip_end == np.inf
    light = again.lights[0]
    assert light.parameters == scene.lights[0].parameters and light.parameters["outer"] > 0
    assert again.surfaces[-1] == "床 \u0000 floor"


def test_numbers_of_numpy() -> None:
    light = Light("l", "POINT", tuple(np.float32([1, 2, 3])), tuple(np.arange(3.0)))  # type: ignore[arg-type]
    again = put_together(replace(cornell(), lights=(light,)))
    assert again.lights == (Light("l", "POINT", (1.0, 2.0, 3.0), (0.0, 1.0, 2.0)),)


@pytest.mark.parametrize("dtype", ["?", "u1", "i2", ">i4", "f2", "f4", ">f8"])
@pytest.mark.parametrize("count", [0, 3, 2 * INLINE])
def test_arrays_inside_records(dtype: str, count: int) -> None:
    """Of each type that pixels may have, in the header or beside it."""
    pixels = (np.arange(3 * count) % 2).astype(dtype).reshape(count, 3)
    scene = replace(cornell(), materials=(Material("m", pixels.T), *cornell().materials))  # type: ignore[arg-type]
    arrays = pack(scene)
    assert (len(arrays) > len(pack(cornell()))) == (pixels.nbytes > INLINE)
    again = unpack(arrays).materials[0].diffuse
    assert isinstance(again, np.ndarray)
    assert (again.dtype, again.shape) == (pixels.dtype, pixels.T.shape)
    assert again.tobytes() == pixels.T.tobytes()


@pytest.mark.parametrize(
    "value", [{1}, object, np.array([None]), np.array([1j]), b"bytes"], ids=repr
)
def test_what_a_scene_cannot_hold(value: Any) -> None:
    with pytest.raises(TypeError, match="a scene cannot hold .*, which is a "):
        pack(replace(cornell(), surfaces=(value,)))


# Damage.


def damaged(change: Callable[[dict[str, Any]], Any]) -> list[Any]:
    """A scene's arrays whose header is another."""
    header, *arrays = pack(cornell())
    values = json.loads(header.tobytes())
    text = json.dumps(change(values) or values).encode()
    return [np.frombuffer(text, np.uint8), *arrays]


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda h: 5, id="number"),
        pytest.param(lambda h: h["camera"], id="camera for a scene"),
        pytest.param(lambda h: h.update({"class": "Path"}), id="unknown record"),
        pytest.param(lambda h: h.pop("class") and None, id="no record"),
        pytest.param(lambda h: h.pop("camera") and None, id="no camera"),
        pytest.param(lambda h: h.update(camera=None), id="nothing for a camera"),
        pytest.param(lambda h: h.update(more=1), id="unknown field"),
        pytest.param(lambda h: h.update(vertices={"class": "blob", "place": 9}), id="no such blob"),
        pytest.param(lambda h: h["camera"]["matrix"].update(bytes="AAAA"), id="short array"),
        pytest.param(lambda h: h["camera"]["matrix"].update(dtype="O"), id="array of objects"),
    ],
)
def test_damaged_header(change: Callable[[dict[str, Any]], Any]) -> None:
    with pytest.raises(RenderError, match="the scene came damaged: "):
        unpack(damaged(change))


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
def test_cut_header(share: float) -> None:
    header, *arrays = pack(cornell())
    with pytest.raises(RenderError, match="the scene came damaged: "):
        unpack([header[: int(share * len(header))], *arrays])
    with pytest.raises(RenderError, match="the scene came damaged: "):
        unpack([])


def test_a_bad_scene_is_no_damage() -> None:
    triangles = cornell().triangles.copy()
    triangles[4, 1] = -7
    with pytest.raises(SceneError, match=r"^scene\.triangles\[4, 1\] = -7 is outside"):
        put_together(replace(cornell(), triangles=triangles))


# What is the same.


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0.0, -0.0),
        (float("nan"), 0.0),
        (1, 1.0),
        (True, 1),
        ("1", 1),
        (None, 0),
        ((1.0, 2.0), (1.0,)),
        ((1.0,), [1.0]),
        ((1.0, (0.0,)), (1.0, (-0.0,))),
        (Material("m"), Light("m", "POINT", (0, 0, 0), (1, 1, 1))),
        ({"alpha": 0.0}, {"alpha": -0.0}),
        ({"alpha": 1.0}, {"beta": 1.0}),
        ({"alpha": 1.0}, {"alpha": 1.0, "beta": 1.0}),
        ({"alpha": (1.0, LONG)}, {"alpha": (1.0, changed(LONG, 50_000, -1.0))}),
        ({"alpha": 1.0}, ("alpha",)),
        (LONG, changed(LONG, 50_000, -1.0)),
        ((("image", LONG),), (("image", changed(LONG, 50_000, -1.0)),)),
        (LONG, LONG.tolist()),
        (LONG, LONG.astype(np.float64)),
        (LONG, LONG.reshape(-1, 2)),
        (LONG, changed(LONG, 0, -0.0)),
        (LONG[:5], LONG[:4]),
        (LONG[:0], LONG[:0].astype(np.int32)),
    ],
)
def test_different(one: Any, other: Any) -> None:
    for make in (lambda v: v, lambda v: (v,), lambda v: Material("m", v)):
        assert not same(make(one), make(other)) and not same(make(other), make(one))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (float("nan"), -float("nan")),
        (-0.0, -0.0),
        (1.5, np.float64(1.5)),
        ((), ()),
        ("a", "a"),
        ({"alpha": float("nan"), "tint": (1.0, LONG)}, {"alpha": math.nan, "tint": (1.0, LONG)}),
        (LONG, LONG.copy()),
        (LONG[::2], LONG[::2].copy()),
        (changed(LONG, 7, np.nan), changed(LONG, 7, np.nan)),
        ((("image", LONG), 0.0), (("image", LONG.copy()), 0.0)),
        (Material("m", LONG), Material("m", LONG.copy())),  # type: ignore[arg-type]
        (np.zeros((0, 3)), np.zeros((0, 3))),
        (np.complex128([1, 2]), np.complex128([1, 2])),
    ],
)
def test_same(one: Any, other: Any) -> None:
    for make in (lambda v: v, lambda v: (v,), lambda v: Material("m", v)):
        assert same(make(one), make(other)) and same(make(other), make(one))


def test_pixels_of_a_material_are_told_apart() -> None:
    """Images that differ in the middle alone, wherever a material holds them."""
    for hold in (lambda image: image, lambda image: (("image", image), ("mix", 0.5))):

        def scene(image: Any) -> Scene:
            return replace(cornell(), materials=(Material("m", hold(image)),))  # noqa: B023

        assert repr(scene(LONG)) == repr(scene(changed(LONG, 50_000, -1.0)))
        assert same_but_view(scene(LONG), scene(LONG.copy()))
        assert not same_but_view(scene(LONG), scene(changed(LONG, 50_000, -1.0)))
