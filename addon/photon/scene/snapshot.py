# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene taken apart into arrays, for another process, and whether two scenes are the same.

`blobs.py` carries the arrays. Files of scenes for users are `Scene.save`'s.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import scene as records
from ..errors import PhotonStreamError, RenderError
from .values import Scene

INLINE = 4096  # [bytes] up to which an array goes into the header: a file takes as much, a page
KIND = "class"  # of a JSON object; no field of a record has the name of a Python keyword
# What a header may hold: the records that are the scene's.
_RECORDS = {
    name: record
    for name, record in vars(records).items()
    if isinstance(record, type) and is_dataclass(record)
}


def pack(scene: Scene) -> list[NDArray[Any]]:
    """Take a scene apart: first a header, JSON as bytes, then its arrays, none of them copied.

    TypeError if a record holds what a header cannot.
    """
    arrays: list[NDArray[Any]] = []

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
            if value.nbytes > INLINE:
                arrays.append(value)
                return {KIND: "blob", "place": len(arrays)}
            text = base64.b64encode(value.tobytes()).decode()
            return {KIND: "array", "dtype": value.dtype.str, "shape": value.shape, "bytes": text}
        if isinstance(value, np.generic):
            return value.item()
        name = type(value).__name__
        if _RECORDS.get(name) is not type(value):
            raise TypeError(f"a scene cannot hold {value!r:.80}, which is a {name}")
        return {KIND: name} | {field.name: getattr(value, field.name) for field in fields(value)}

    header = json.dumps(scene, default=plain).encode()
    return [np.frombuffer(header, np.uint8), *arrays]


def unpack(arrays: Sequence[NDArray[Any]]) -> Scene:
    """The scene that was taken apart, equal to the bit; its lists have become tuples.

    Raises SceneError if its values are no scene to render, RenderError if it is damaged.
    """

    def whole(values: dict[str, Any]) -> Any:
        if KIND not in values:  # parameters of a lobe or light
            return {name: _tuples(value) for name, value in values.items()}
        kind = values.pop(KIND)
        if kind == "blob":
            return arrays[values["place"]]
        if kind == "array":
            array = np.frombuffer(base64.b64decode(values["bytes"]), values["dtype"])
            return array.reshape(values["shape"])
        return _RECORDS[kind](**{name: _tuples(value) for name, value in values.items()})

    try:
        scene = json.loads(arrays[0].tobytes(), object_hook=whole)
        if not isinstance(scene, Scene):
            raise TypeError(f"{type(scene).__name__} is no scene")
        scene.check()
    except (PhotonStreamError, MemoryError):
        raise
    except Exception as error:  # a dozen kinds, as for damaged files
        raise RenderError(f"the scene came damaged: {type(error).__name__}: {error}") from error
    return scene


def same(one: Any, other: Any) -> bool:
    """Whether two values of a scene are equal to the bit: records, tuples, mappings, arrays and
    numbers.

    `==` takes -0.0 for 0.0, and NaN for something else.
    """
    if one is other:  # an array that came once is one array (blobs.py)
        return True
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and _same_array(one, other)
    if isinstance(one, float) and isinstance(other, float):
        if one == other:
            return one != 0.0 or math.copysign(1.0, one) == math.copysign(1.0, other)
        return one != one and other != other
    if type(one) is not type(other):
        return False
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return bool(one == other)


def _same_array(one: NDArray[Any], other: NDArray[Any]) -> bool:
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    return np.array_equal(bits_of(one), bits_of(other))


def bits_of(array: NDArray[Any]) -> NDArray[Any]:
    """An array as unsigned integers (n,), as wide as its size allows; contiguous, C order."""
    flat = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    return flat.view(np.uint64) if flat.nbytes % 8 == 0 else flat


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
