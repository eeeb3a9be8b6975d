# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports go one way: blender -> photon -> streams; only addon/blender knows Blender."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ADDON = Path(__file__).parents[2] / "addon"


def imported(file: Path) -> Iterator[tuple[int, str]]:
    """(line, absolute module) of each import in a file of the package."""
    package = ["addon", *file.relative_to(ADDON).parent.parts]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield node.lineno, module
            yield from ((node.lineno, f"{module}.{name.name}") for name in node.names)


def offences(folder: str, forbidden: tuple[str, ...], besides: str = "") -> list[str]:
    """Imports below a folder of the addon that it must not have."""
    found = []
    for file in sorted((ADDON / folder).rglob("*.py")):
        place = file.relative_to(ADDON)
        if besides and place.parts[0] == besides:
            continue
        for line, module in imported(file):
            if any(module == name or module.startswith(f"{name}.") for name in forbidden):
                found.append(f"addon/{place}:{line} imports {module}")
    return found


def test_reads_imports_of_every_kind() -> None:
    """The walk sees what it has to see: an import in a function, a relative one."""
    assert any(module == "addon.streams" for _, module in imported(ADDON / "photon/renderer.py"))
    assert any(module == "bpy" for _, module in imported(ADDON / "blender/engine.py"))
    assert any(module == "OpenEXR" for _, module in imported(ADDON / "photon/film/picture_file.py"))


def test_streams_knows_no_rendering() -> None:
    assert offences("streams", ("addon.photon", "addon.blender", "addon.build")) == []


def test_denoiser_knows_nothing_of_ours() -> None:
    ours = ("addon.photon", "addon.blender", "addon.build", "addon.streams")
    assert offences("denoiser", ours) == []


def test_photon_knows_no_blender_package() -> None:
    assert offences("photon", ("addon.blender", "addon.build")) == []


def test_only_the_blender_package_knows_blender() -> None:
    names = ("bpy", "bpy_extras", "bl_ui", "bmesh", "mathutils", "gpu", "addon_utils")
    assert offences("", names, besides="blender") == []


def test_photon_makes_no_opengl_library_calls_of_its_own() -> None:
    """OpenGL is the stream framework's: photon uses moderngl's objects, and no other binding."""
    assert offences("photon", ("OpenGL", "glcontext", "ctypes")) == []


@pytest.mark.parametrize(
    "module", ["addon.streams", "addon.photon.renderer", "addon.photon.jobs.process"]
)
def test_bare_process_never_loads_blender(module: str) -> None:
    code = f"import sys, {module}; print(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, cwd=ADDON.parent, capture_output=True, text=True, check=True)
    loaded = result.stdout.split()
    assert "moderngl" in loaded or module.endswith("process")
    assert not {"bpy", "bl_ui", "mathutils"} & set(loaded)


def test_streams_alone_loads_no_photon() -> None:
    code = "import sys, addon.streams; print(*(m for m in sys.modules if 'addon' in m))"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, cwd=ADDON.parent, capture_output=True, text=True, check=True)
    assert "addon.streams.kernel" in result.stdout and "addon.photon" not in result.stdout


# What tells devices apart, and the backends: asked for in backends/ alone.
ASKING = {"is_software", "prefers_native", "keeps_lists", "has_compute", "choose_layer"}
TOLD_APART = {"HostKernel", "HostDeposits", "DeviceDeposits", "HostRadii", "DeviceRadii"}
TOLD_APART |= {"Backend", "ResidentBackend", "NativeBackend", "PhotonGrid", "NativePhotonGrid"}
LAYERS = {"fragment", "compute", "native"}


def questions(text: str) -> Iterator[int]:
    """Lines that ask which device runs: by an attribute, a class, or a layer's name."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Attribute) and node.attr in ASKING:
            yield node.lineno
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            names = {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
            if node.func.id == "isinstance" and names & TOLD_APART:
                yield node.lineno
        if isinstance(node, ast.Compare):
            sides = (node.left, *node.comparators)
            if any(isinstance(x, ast.Constant) and x.value in LAYERS for x in sides):
                yield node.lineno


def test_only_backends_ask_which_device_runs() -> None:
    asked = {
        f"{file.relative_to(ADDON)}:{line}"
        for room in ("photon", "blender")
        for file in (ADDON / room).rglob("*.py")
        for line in questions(file.read_text(encoding="utf-8"))
    }
    assert {place for place in asked if not place.startswith("photon/backends/")} == set()
    assert asked  # backends/ do


@pytest.mark.parametrize(
    "text",
    ["x = device.is_software", "isinstance(a, (HostKernel, B))", 'y = a.name == "native"'],
)
def test_questions_are_seen(text: str) -> None:
    assert list(questions(text)) == [1]
    assert not list(questions("isinstance(a, float) or layer == other"))
