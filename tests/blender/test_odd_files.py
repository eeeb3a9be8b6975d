# SPDX-License-Identifier: GPL-3.0-or-later
"""Malformed .blend files and odd paths: one error, or the picture, and no other file."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from addon.blender import command
from tests.stability.table import Measured

pytestmark = [pytest.mark.blender, pytest.mark.stability(54)]

BLEND = Path(__file__).resolve().parents[2] / "blend_scenes/cornell_box.blend"
QUICK = ("--width", "8", "--passes", "1", "--photons", "100")
PLAIN = b"BLENDER17-01v0500"  # how a file that is not compressed begins


def call(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """The command, called in a folder; temporary files go to `tmp` there."""
    (folder / "tmp").mkdir(exist_ok=True)
    return subprocess.run(
        [sys.executable, command.__file__, *map(str, arguments), *QUICK],
        cwd=folder,
        env=os.environ | {"TMPDIR": str(folder / "tmp"), "TEMP": str(folder / "tmp")},
        capture_output=True,
        text=True,
        timeout=120,
    )


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def damaged(thorough: bool) -> dict[str, bytes]:
    """Contents by what is wrong with them."""
    good, rng = BLEND.read_bytes(), np.random.default_rng(54)
    found = {
        "no bytes": b"",
        "text": "no scene, but wörds\n".encode() * 100,
        "half of one": good[: len(good) // 2],
        "random after the first bytes": PLAIN + rng.bytes(10_000),
        "other bytes within": good[:5000] + rng.bytes(5000) + good[10_000:],
    }
    if thorough:
        found |= {f"{n} bytes": good[:n] for n in (1, 4, 7, 8, 12, 13, 100, 1000, 100_000)}
        found |= {
            f"{name}, then zeros": start + bytes(10_000)
            for name, start in (
                ("plain", PLAIN),
                ("zstd", good[:4]),
                ("gzip", b"\x1f\x8b"),
                ("none", b""),
            )
        }
        found |= {"random": rng.bytes(100_000), "twice": good + good, "a picture": b"\x89PNG" * 99}
        for number in range(30):
            at = int(rng.integers(8, len(good) - 100))
            found[f"100 random bytes, {number}"] = good[:at] + rng.bytes(100) + good[at + 100 :]
    return found


def test_malformed(tmp_path: Path, measured: Measured, thorough: bool) -> None:
    """One error line, which names the file; a picture only of a file that Blender can read."""
    path, read, crashed = tmp_path / "scene.blend", [], []
    cases = damaged(thorough)
    for name, content in cases.items():
        path.write_bytes(content)
        done = call(tmp_path, path.name, "-o", "out.png")
        errors = [line for line in done.stderr.splitlines() if line.startswith("Error: ")]
        print(f"{name}: {done.returncode} {errors or done.stderr}")
        written = files(tmp_path) - {"scene.blend"}
        if done.returncode == 0:
            read.append(name)
            assert written == {"out.png"} and not errors
            (tmp_path / "out.png").unlink()
        elif done.returncode < 0:  # Blender itself, as it reads
            crashed.append(name)
            assert all(file.startswith("tmp") for file in written), written
            for file in written:
                (tmp_path / file).unlink()
        else:
            assert done.returncode == 1 and not written, name
            assert len(errors) == 1 and str(path.name) in errors[0], done.stderr
            assert "Traceback" not in done.stderr
    measured(f"of {len(cases)} files: Blender could read", len(read))
    measured("Blender crashed", len(crashed))
    if crashed:
        measured.falls_short("Blender itself crashes on some files with other bytes within")
    assert all("random bytes" in name for name in crashed)


ODD = {
    "spaces": "a scene  of mine",
    "Unicode": "Szène 場面 ☃ e\u0301",
    "a newline": "two\nlines",
    "quotes": 'it\'s "so" #1 %d $HOME',
}
ODD["all of it"] = "  ".join(ODD.values())  # the others tell what of it is at fault


@pytest.mark.thorough("spaces", "Unicode", "newline", "quotes")
@pytest.mark.parametrize("odd", ODD)
def test_odd_paths(tmp_path: Path, measured: Measured, odd: str) -> None:
    """Of the folder, the scene and the picture; the picture lies where it was asked for."""
    name = ODD[odd]
    here = tmp_path / name / "here"
    here.mkdir(parents=True)
    scene = tmp_path / name / f"{name}.blend"
    scene.write_bytes(BLEND.read_bytes())
    done = call(here, f"../{name}.blend", "-o", f"../{name}.png")
    assert done.returncode == 0, done.stderr
    picture = str((tmp_path / name / f"{name}.png").relative_to(tmp_path))
    assert files(tmp_path) == {str(scene.relative_to(tmp_path)), picture}
    done = call(here, f"../{name} none.blend", "-o", f"../{name} 2.png")
    assert done.returncode == 1
    assert len([line for line in done.stderr.splitlines() if line.startswith("Error: ")]) == 1
    others = files(tmp_path) - {str(scene.relative_to(tmp_path)), picture}
    assert measured("files elsewhere", len(others)) == 0
