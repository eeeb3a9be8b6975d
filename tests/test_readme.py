# SPDX-License-Identifier: GPL-3.0-or-later
"""README.md says what is so: its code runs, its files and options exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from addon.streams import Device
from tests.scenes import cornell

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_python_example(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The example of "From Python", with a small picture instead of its large one."""
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    small = code.replace("width=512, height=512, passes=16", "width=16, height=16, passes=2")
    assert small != code
    cornell().save(tmp_path / "scene.npz")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(small, names)
    images = names["images"]
    assert isinstance(images, dict) and images["Combined"].shape == (16, 16, 4)
    renderer = names["renderer"]
    renderer.release()  # type: ignore[attr-defined]
    renderer.device.release()  # type: ignore[attr-defined]


def test_pictures_exist() -> None:
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README)
    assert pictures and all((ROOT / picture).is_file() for picture in pictures)


def test_options_exist() -> None:
    """Every option that the README shows for `build.py` is one."""
    build = "".join(
        path.read_text(encoding="utf-8")
        for path in (
            ROOT / "build.py",
            ROOT / "tests/bench/speed/__main__.py",
            ROOT / "tests/bench/chart/__main__.py",
            ROOT / "tests/bench/race.py",
        )
    )
    shown = set(re.findall(r"--([a-z]+(?:-[a-z]+)*)\b", README))
    missing = [x for x in shown if f'"{x}"' not in build and f'"--{x}"' not in build]
    assert shown and missing == []


def test_settings_have_their_names() -> None:
    """The settings table names settings as Blender's panels do."""
    properties = (ROOT / "addon/blender/properties.py").read_text(encoding="utf-8")
    table = README.split("| setting | means |")[1].split("\n\n")[0]
    rows = re.findall(r"^\| ([A-Z][^|]*?) \|", table, re.M)
    names = [name for row in rows for name in row.split(", ")]
    assert len(names) > 10 and [name for name in names if f'"{name}"' not in properties] == []
