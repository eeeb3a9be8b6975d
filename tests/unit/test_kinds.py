# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of lobes and lights: what their files say, what programs hold of them, what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from addon.photon.errors import SceneError
from addon.photon.kernels import records
from addon.photon.kernels.records import check_layouts
from addon.photon.kernels.shade import Shade
from addon.photon.prepare import prepare
from addon.photon.scene import Light, Lobe, Material, Scene, glow_light, phong
from addon.photon.settings import Settings
from addon.photon.stage import kinds as kinds_module
from addon.photon.stage.kinds import check_kinds, light_kinds, lobe_kinds
from addon.photon.stage.switches import made_bsdf, made_lights
from addon.photon.variants import drawn, kernels
from addon.streams import Defines, Device, HostKernel, Kernel, Made, StreamError
from tests.kernels.light_probe import IMAGE
from tests.kernels.test_seen_lights import SEEN_LIGHTS
from tests.scenes import cornell
from tests.unit.glsl_files import use_root, write


def test_what_heads_say() -> None:
    assert lobe_kinds()["phong"].parameters == {"exponent": ""}
    assert lobe_kinds()["mirror"].is_delta and not lobe_kinds()["phong"].is_delta
    assert not lobe_kinds()["mirror"].parameters
    spot = light_kinds()["spot"]
    assert list(spot.parameters.items())[:3] == [
        ("radius", "m"),
        ("soft", "0 or 1"),
        ("outer", "1 - cos"),
    ]
    for kinds in (lobe_kinds(), light_kinds()):
        assert sorted(kind.number for kind in kinds.values()) == [*range(1, len(kinds) + 1)]


def test_traits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They alone tell: a head's prose does not."""
    root = use_root(tmp_path, monkeypatch)
    head = "// A mirror on both sides, a delta lobe.\n// Parameters: none.\n"
    write(root, "bsdf/odd.glsl", f"{head}\nfloat x;\n")
    odd = lobe_kinds()["odd"]
    assert not (odd.is_delta or odd.transmits or odd.sends_rays)
    write(root, "bsdf/sharp.glsl", f"{head}// Traits: delta, transmits.\n\nfloat x;\n")
    write(root, "bsdf/thin.glsl", f"{head}// Traits: sends rays.\n\nfloat x;\n")
    kinds_module._kinds.cache_clear()
    sharp, thin = lobe_kinds()["sharp"], lobe_kinds()["thin"]
    assert sharp.is_delta and sharp.transmits and sharp.sends_rays and not sharp.is_two_sided
    assert thin.sends_rays and not (thin.is_delta or thin.transmits)
    write(root, "bsdf/thin.glsl", f"{head}// Traits: sharp.\n\nfloat x;\n")
    kinds_module._kinds.cache_clear()
    with pytest.raises(StreamError, match=r"thin\.glsl: 'sharp' is no trait: delta, transmits"):
        lobe_kinds()


def test_a_head_without_parameters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(use_root(tmp_path, monkeypatch), "bsdf/odd.glsl", "// A lobe.\n\nfloat x;\n")
    with pytest.raises(StreamError, match=r'bsdf/odd\.glsl: its head has no line "// Parameters'):
        lobe_kinds()


@pytest.mark.parametrize("names", [(), ("phong",), ("mirror", "phong")])
def test_only_the_kinds_in_use(names: tuple[str, ...]) -> None:
    (text,) = made_bsdf(names).values()
    assert re.findall(r'#include "bsdf/(\w+)\.glsl"', text) == [*names]
    for verb in ("eval", "pdf", "sample", "albedo"):
        body = text.split(f" {verb}_kind(")[1].split("\n}")[0]
        calls = re.findall(r"if \(lobe\.kind == (\d+)\.0\) return (\w+)\(", body)
        assert calls == [(str(lobe_kinds()[name].number), f"{verb}_{name}") for name in names]
    (text,) = made_lights({"spot"}).values()
    assert re.findall(r'#include "lights/(\w+)\.glsl"', text) == ["spot"]
    assert "sample_point(" not in text and text.count("sample_spot(") == 1


def test_programs_hold_the_kinds_of_their_scene(device: Device) -> None:
    """Which of them a material has makes other programs; those that no scene has are not there."""
    for mirror, lobe, there in ((True, False, "mirror"), (False, True, "phong")):
        scene = cornell(mirror, lobe)
        renderer = prepare(scene, Settings(8, 8, photons=8), device)
        assert renderer.needs.lobe_kinds == {there} and renderer.needs.light_kinds == {"spot"}
        text = Shade.source(
            "fragment", 330, renderer.needs.eye_defines, made=renderer.needs.made
        ).text
        renderer.release()
        absent = {"mirror": "phong", "phong": "mirror"}[there]
        assert f"albedo_{there}(" in text and f"albedo_{absent}(" not in text


def with_lobe(lobe: Lobe) -> Scene:
    scene = cornell()
    return replace(scene, materials=(Material("odd one", lobes=(lobe,)), *scene.materials[1:]))


@pytest.mark.parametrize(
    ("lobe", "message"),
    [
        (Lobe("fur", (1, 1, 1)), r"material 'odd one': kind 'fur' is none of .*mirror, .*phong"),
        (
            Lobe("phong", (1, 1, 1)),
            "material 'odd one': the parameters of phong are exponent; got none",
        ),
        (
            Lobe("mirror", (1, 1, 1), {"exponent": 3.0}),
            "material 'odd one': the parameters of mirror are none; got exponent",
        ),
        (
            Lobe("phong", (1, 1, 1), {"roughness": 3.0}),
            "material 'odd one': the parameters of phong are exponent; got roughness",
        ),
    ],
)
def test_lobes_that_are_refused(device: Device, lobe: Lobe, message: str) -> None:
    for refuse in (check_kinds, lambda scene: prepare(scene, Settings(8, 8), device)):
        with pytest.raises(SceneError, match=message):
            refuse(with_lobe(lobe))


@pytest.mark.parametrize(
    ("light", "message"),
    [
        (Light("sun", "AREA", (0, 0, 0), (1, 1, 1)), "light 'sun': kind 'AREA' is none of "),
        (
            Light("sun", "point", (0, 0, 0), (1, 1, 1), parameters={"radius": 0.0}),
            "light 'sun': the parameters of point are radius, soft; got radius",
        ),
    ],
)
def test_lights_that_are_refused(device: Device, light: Light, message: str) -> None:
    for refuse in (check_kinds, lambda scene: prepare(scene, Settings(8, 8), device)):
        with pytest.raises(SceneError, match=message):
            refuse(replace(cornell(), lights=(light,)))


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        ({"kind": "PANO"}, "scene.camera: kind 'pano' is none of .*ortho, persp"),
        (
            {"kind": "FISHEYE_EQUIDISTANT"},
            "of fisheye_equidistant are fisheye_fov; got none",
        ),
        ({"parameters": {"fov": 1.0}}, "scene.camera: the parameters of persp are none; got fov"),
    ],
)
def test_cameras_that_are_refused(device: Device, camera: Any, message: str) -> None:
    scene = cornell()
    for refuse in (check_kinds, lambda scene: prepare(scene, Settings(8, 8), device)):
        with pytest.raises(SceneError, match=message):
            refuse(replace(scene, camera=replace(scene.camera, **camera)))


def test_native_layouts_are_ours() -> None:
    import photon_stream_native as native

    assert len(native.LAYOUTS) >= 5
    check_layouts(native.LAYOUTS)
    for name, layout in native.LAYOUTS.items():
        assert records._BY_NAME[name].layout == layout


@pytest.mark.parametrize(
    ("theirs", "message"),
    [
        (
            {"Hit": "float t; float u"},
            "Hit is 'float t; float u' in the native core, 'float t; float triangle; float u; flo",
        ),
        ({"Fur": "vec3 colour"}, "Fur is 'vec3 colour' in the native core, 'nothing' in records"),
    ],
)
def test_layouts_that_differ(theirs: dict[str, str], message: str) -> None:
    with pytest.raises(ImportError, match=message):
        check_layouts(theirs)


# The offline check's list.


def test_every_kernel_has_variants() -> None:
    """Each class, with each define of its structure on and off."""
    found: dict[type[Kernel], list[Any]] = {}
    listed = [(kernel, defines) for kernel, defines, _ in kernels()]
    for kernel, defines in [*listed, *((kernel, defines) for kernel, _, defines in drawn())]:
        found.setdefault(kernel, []).append({*defines} & {*kernel.structure})
    waiting, classes = [Kernel], set()
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        is_ours = kind.__module__.startswith("addon.") and hasattr(kind, "stem")
        if is_ours and not issubclass(kind, HostKernel):
            classes.add(kind)
    assert classes == found.keys()
    for kernel, variants in found.items():
        for define in kernel.structure:
            assert any(define in variant for variant in variants), (kernel, define)


def test_variants_are_what_scenes_need(
    device: Device, monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    """Programs of real scenes are among them, but for the number of their lights."""

    def counted(text: str) -> str:
        return re.sub(r"#define SHADOW_RAYS \d+", "#define SHADOW_RAYS N", text)

    def own(kind: type[Kernel], defines: Defines) -> Any:
        kept = {name: defines[name] for name in kind.structure if name in defines}
        return kind, frozenset((kept | {"SHADOW_RAYS": 0}).items())

    listed: dict[Any, list[tuple[Defines, Made]]] = {}
    for kernel, defines, made in kernels():
        listed.setdefault(own(kernel, defines), []).append((defines, made))
    texts: dict[tuple[str, str], set[str]] = {}  # of a program, and those that are listed
    source = vars(Kernel)["source"].__func__

    def spy(kind: type[Kernel], layer: Any, version: int, defines: Defines, *more: Any) -> Any:
        given = source(kind, layer, version, defines, *more)
        if (program := (kind.__name__, counted(given.text))) not in texts:
            texts[program] = {
                counted(source(kind, layer, version, like, made=made).text)
                for like, made in listed.get(own(kind, defines), ())
            }
        return given

    monkeypatch.setattr(Kernel, "source", classmethod(spy))
    scene = cornell()
    glow = glow_light("glow", (0.0, 0.0, 1.0), (1.0,) * 3, 0.1)
    lights = (*scene.lights, *SEEN_LIGHTS, glow)  # of every kind
    scenes = [scene]
    broad, mirror = phong((0.1,) * 3, 9.0), phong((0.1,) * 3)
    for lobes, many in (((broad,), (1,)), ((mirror,), (40,)), ((broad, broad), (1, 40))):
        shiny = Material("shiny", (0.1,) * 3, lobes)
        scene = replace(scene, materials=(shiny, *scene.materials[1:]))
        scene = replace(scene, images=(IMAGE,))
        scenes += [replace(scene, lights=lights * x) for x in ((1, 40) if thorough else many)]
    for each in scenes:
        prepare(each, Settings(8, 8, photons=8, backend="fragment"), device).release()
    names = {name for name, _ in texts}
    assert {"Shade", "Direct", "Scatter", "Reflector", "Generator", "LightFlux"} <= names
    assert [name for (name, text), like in texts.items() if text not in like] == []
