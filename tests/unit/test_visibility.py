# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene.visible and limited lights: what they are, files, and that scenes without pay nothing."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.photon.errors import SceneError
from addon.photon.prepare import prepare
from addon.photon.scene import ALL_RAYS, CAUSTICS, HOLDOUT, MOST_BOUNCES, RAY_BITS, RAYS, Scene
from addon.photon.scene.snapshot import pack, same, unpack
from addon.photon.settings import Settings
from addon.photon.variants import kernels, needs
from addon.streams import Device, Kernel
from addon.streams.source import glsl_root
from tests.scenes import cornell

SETTINGS = Settings(width=8, height=8, passes=1, photons=1000, backend="fragment")


def flagged() -> Scene:
    scene = cornell(mirror=True)
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[2] = HOLDOUT + 3
    (light,) = scene.lights
    lights = (replace(light, casts_shadow=False, max_bounces=3),)
    return replace(scene, visible=visible, lights=lights)


def test_bits_are_those_of_the_glsl() -> None:
    files = [glsl_root() / "lib" / f"{stem}.glsl" for stem in ("ray_bits", "visibility")]
    text = "".join(file.read_text() for file in files)
    bits = {name: int(value) for name, value in re.findall(r"const int (\w+) = (\d+);", text)}
    assert [bits.pop(f"RAY_{name.upper()}") for name in RAYS] == [1 << i for i in range(len(RAYS))]
    assert bits.pop("HOLDOUT") == HOLDOUT
    assert [bits.pop(f"{name.upper()}_CAUSTICS") for name in CAUSTICS] == [1, 2]
    assert bits == {"RAY_UNSHADOWED": ALL_RAYS + 1}  # no surface's


def test_files(tmp_path: Path) -> None:
    scene = flagged()
    scene.save(tmp_path / "scene.npz")
    assert same(Scene.load(tmp_path / "scene.npz"), scene)
    assert same(unpack(pack(scene)), scene)


def test_files_from_before(tmp_path: Path) -> None:
    """Everything is visible, and lights know no limits."""
    scene = flagged()
    scene.save(tmp_path / "scene.npz")
    with np.load(tmp_path / "scene.npz") as data:
        arrays: dict[str, Any] = {name: data[name] for name in data if name != "visible"}
    header = json.loads(str(arrays["header"]))
    for light in header["lights"]:
        del light["casts_shadow"], light["max_bounces"]
    np.savez(tmp_path / "old.npz", **arrays | {"header": np.array(json.dumps(header))})
    assert same(Scene.load(tmp_path / "old.npz"), cornell(mirror=True))


@pytest.mark.parametrize(
    ("visible", "message"),
    [
        (np.zeros(2, np.uint8), r"scene\.visible: expected uint8\[7\]"),
        (np.full(7, 255, np.uint8), r"scene\.visible: 255 has bits of no ray"),
    ],
)
def test_what_is_no_visibility(visible: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        replace(cornell(), visible=visible).check()


@pytest.mark.parametrize("bounces", [-1, MOST_BOUNCES + 1])
def test_what_is_no_limit(bounces: int) -> None:
    with pytest.raises(SceneError, match=r"light 'spot': max_bounces"):
        replace(cornell().lights[0], max_bounces=bounces).check()


@pytest.mark.parametrize("visible", [(), (ALL_RAYS,) * 7], ids=["nothing", "all"])
def test_nothing_is_paid_for_what_is_not_limited(
    device: Device, monkeypatch: pytest.MonkeyPatch, visible: Any
) -> None:
    """No program knows of it, no kernel runs more, and no table is there."""
    texts: list[str] = []
    build = Kernel.source.__func__  # type: ignore[attr-defined]

    def record(cls: type[Kernel], *args: Any, **kwargs: Any) -> Any:
        source = build(cls, *args, **kwargs)
        texts.append(source.text)
        return source

    monkeypatch.setattr(Kernel, "source", classmethod(record))
    for scene, wanted in (
        (replace(cornell(mirror=True), visible=np.array(visible, np.uint8)), False),
        (flagged(), True),
    ):
        texts.clear()
        renderer = prepare(scene, SETTINGS, device)
        renderer.render_pass()
        renderer.release()
        words = ("visibility_at", "light_limit_at", "PhotonRay", "is_holdout(load")
        for word in words:
            assert any(word in text for text in texts) == wanted, word


def test_every_program_is_checked_with_and_without() -> None:
    assert {scene.visibility for scene in needs()} == {False, True}
    found = {k.stem for k, defines, _ in kernels() if "VISIBILITY" in defines}
    assert found >= {"tracer", "shade", "reflector", "projector", "generator", "direct"}


@pytest.mark.parametrize("ray", RAYS)
def test_lobes_gather_where_their_rays_would_find_the_same(device: Device, ray: str) -> None:
    """As those of diffuse lobes: a photon that has landed does not say which may have found it."""
    scene = cornell(lobe=True)
    visible = np.full(len(scene.surfaces), ALL_RAYS, np.uint8)
    visible[5] -= RAY_BITS[ray]
    renderer = prepare(replace(scene, visible=visible), SETTINGS, device)
    renderer.release()
    assert renderer.needs.visibility
    assert renderer.needs.gathered_lobes == (ray not in ("diffuse", "glossy"))
