# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene: what it refuses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.scene import Lens, Lobe, Motion, Scene, reflecting
from tests.scenes import cornell, plain_light, plain_material

ARRAYS = ("vertices", "triangles", "corner_normals", "material", "surface")


def test_fits() -> None:
    cornell(True).check()
    Scene(camera=cornell().camera).check()  # nothing in it: nothing wrong with it


@pytest.mark.stability(21)
@pytest.mark.parametrize(
    ("name", "index", "value", "limit"),
    [
        ("triangles", (3, 1), -1, "vertices"),
        ("triangles", (0, 2), 10**6, "vertices"),
        ("material", (5,), 4, "materials"),
        ("material", (0,), -2, "materials"),
        ("surface", (7,), 99, "surfaces"),
        ("surface", (7,), -1, "surfaces"),
    ],
)
def test_index_out_of_range(name: str, index: tuple[int, ...], value: int, limit: str) -> None:
    scene = cornell()
    array = getattr(scene, name).copy()
    array[index] = value
    count = len(getattr(scene, limit))
    where = ", ".join(map(str, index))
    with pytest.raises(
        SceneError, match=rf"scene\.{name}\[{where}\] = {value} is outside \[0, {count}\)"
    ):
        replace(scene, **{name: array}).check()


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_type(name: str) -> None:
    scene = cornell()
    array = getattr(scene, name)
    other = np.int64 if array.dtype.kind == "i" else np.float16
    with pytest.raises(SceneError, match=rf"scene\.{name}: expected {array.dtype}\["):
        replace(scene, **{name: array.astype(other)}).check()


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_shape(name: str) -> None:
    scene = cornell()
    array = getattr(scene, name)
    other = array[:, :2].copy() if array.ndim == 2 else array[:-1]
    with pytest.raises(SceneError, match=rf"scene\.{name}: expected .*, got {array.dtype}\["):
        replace(scene, **{name: other}).check()


@pytest.mark.parametrize(
    "camera",
    [
        {"matrix": np.eye(3)},
        {"matrix": np.full((4, 4), np.nan)},
        {"window": (1.0, -1.0, -1.0, 1.0)},
        {"window": (-1.0, 1.0, 0.0, 0.0)},
        {"window": (-1.0, np.inf, -1.0, 1.0)},
    ],
)
def test_camera(camera: dict[str, Any]) -> None:
    scene = cornell()
    with pytest.raises(SceneError, match=rf"scene\.camera\.{next(iter(camera))}"):
        replace(scene, camera=replace(scene.camera, **camera)).check()


@pytest.mark.parametrize(
    "light",
    [
        {"power": (np.nan, 1.0, 1.0)},  # renders black without a word
        {"power": (np.inf, 1.0, 1.0)},  # NaN pixels
        {"power": (-1.0, 5.0, 5.0)},  # negative pixels
        {"position": (np.nan, 0.0, 0.0)},  # NaN pixels
        {"direction": (0.0, 0.0, 0.0)},  # NaN pixels
        {"radius": -1.0},
        {"spot_size": np.nan},
        {"spot_size": 10.0},
        {"spot_blend": 5.0},
    ],
)
def test_light(light: dict[str, Any]) -> None:
    fields = {"position": (5, 5, 9), "power": (1, 1, 1)} | light
    with pytest.raises(SceneError, match=r"light.*spot"):
        replace(cornell(), lights=(plain_light("spot", "SPOT", **fields),)).check()


@pytest.mark.parametrize(
    "material",
    [
        {"diffuse": (np.nan, 0.5, 0.5)},  # ValueError in the automatic radius
        {"specular": (np.inf, 0.5, 0.5)},  # NaN pixels
        {"exponent": -3.0},
        {"exponent": -np.inf},
        {"exponent": np.nan},
    ],
)
def test_material(material: dict[str, Any]) -> None:
    scene = cornell()
    with pytest.raises(SceneError, match=r"material.*white"):
        broken = plain_material("white", **{"specular": (0.1, 0.1, 0.1)} | material)
        replace(scene, materials=(broken, *scene.materials[1:])).check()


@pytest.mark.parametrize(
    "camera",
    [
        {"parameters": {"fov": np.nan}},
        {"lens": Lens(-1.0, 1.0)},
        {"lens": Lens(1.0, np.nan)},
        {"lens": Lens(1.0, 1.0, ratio=0.0)},
        {"motion": Motion(np.eye(4))},
        {"motion": Motion(np.eye(4)[None] * np.nan)},
        {"motion": Motion(np.eye(4)[None], shutter=(1.0, -1.0))},
        {"clip_start": np.nan},
        {"clip_end": np.nan},
        {"matrix": np.zeros((4, 4))},  # numpy.linalg.LinAlgError in the ray tracer
    ],
)
def test_rest_of_the_camera(camera: dict[str, Any]) -> None:
    scene = cornell()
    with pytest.raises(SceneError, match=r"camera"):
        replace(scene, camera=replace(scene.camera, **camera)).check()


def test_what_is_transparent_is_the_first_lobe() -> None:
    """Unless something lies over it; what lies over others stays over them."""
    grey = (0.5, 0.5, 0.5)
    clear, black = Lobe("transparent", grey), Lobe("mirror", (0.0, 0.0, 0.0))
    coat, mirror = Lobe("coat", grey), Lobe("mirror", grey)

    def order(*lobes: Lobe) -> list[tuple[str, int | None]]:
        return [(lobe.kind, lobe.over) for lobe in reflecting(lobes)]

    under = replace(mirror, over=0)
    assert order(coat, under, clear) == [("transparent", None), ("coat", None), ("mirror", 1)]
    covered = replace(clear, over=0), replace(mirror, over=1)
    assert order(coat, *covered) == [("coat", None), ("transparent", 0), ("mirror", 1)]
    through = replace(black, over=0), replace(mirror, over=1)
    assert order(coat, *through, clear) == [("transparent", None), ("coat", None), ("mirror", 1)]
    kept = reflecting((coat, under, clear))
    assert reflecting(kept) == kept
