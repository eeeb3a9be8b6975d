# SPDX-License-Identifier: GPL-3.0-or-later
"""build.py's own promises: pins, messages, exit codes, versions, the scenes' sizes."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
from pathlib import Path

import pytest

from tests.children import STOPS_WITHIN, child
from tests.scenes import cornell

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "addon" / "build"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SCENES = sorted((ROOT / "blend_scenes").glob("*.blend"))


def build(*arguments: str | Path, **keywords: object) -> subprocess.CompletedProcess[str]:
    """Run build.py to its end."""
    command = [sys.executable, str(ROOT / "build.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **keywords)  # type: ignore[call-overload]


def run_python(code: str) -> subprocess.CompletedProcess[str]:
    """Run a snippet in the repository, in an interpreter that has imported nothing."""
    command = [sys.executable, "-S", "-c", code]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)


def test_build_needs_the_standard_library_only() -> None:
    code = "import sys, build; print(*{name.partition('.')[0] for name in sys.modules})"
    modules = set(run_python(code).stdout.split())
    assert "build" in modules
    assert modules - set(sys.stdlib_module_names) <= {"build", "addon", "__main__"}


def test_build_parses_under_old_pythons() -> None:
    """An old Python must get as far as the message that names the right one."""
    early = (ROOT / "build.py", ROOT / "addon" / "__init__.py", BUILD / "__init__.py")
    for path in early:
        ast.parse(path.read_text(), feature_version=(3, 6))
        assert "__future__ import annotations" not in path.read_text()  # Python 3.7
    for path in BUILD.glob("*.py"):
        ast.parse(path.read_text(), feature_version=(3, 9))


@pytest.mark.parametrize("version", ["3.6", "3.7", "3.8", "3.9", "3.10", "3.12"])
def test_other_pythons_are_told_which(tmp_path: Path, version: str) -> None:
    """By those that are here."""
    python = shutil.which(f"python{version}")
    if not python or subprocess.run([python, "--version"], capture_output=True).returncode:
        pytest.skip(f"no Python {version}")
    (tmp_path / "x.blend").touch()
    done = subprocess.run(
        [python, ROOT / "build.py", "render", "x.blend"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert done.returncode == 1
    known = r"Python 3\.11( \(bpy [\d.]+\))? or Python 3\.13( \(bpy [\d.]+\))?"
    assert re.match(rf"build\.py: Photon Stream needs {known}; this is Python 3\.", done.stderr)
    assert done.stderr.count("\n") == 1


def test_build_is_short() -> None:
    assert len((ROOT / "build.py").read_text().splitlines()) < 300


@pytest.mark.parametrize(
    ("version", "bpy", "accepted"),
    [
        ((3, 10), True, False),
        ((3, 11), True, True),
        ((3, 12), True, False),
        ((3, 12), False, True),  # a snapshot needs no bpy
        ((3, 13), True, True),
        ((3, 14), True, False),
    ],
)
def test_python_version(
    monkeypatch: pytest.MonkeyPatch, version: tuple[int, int], bpy: bool, accepted: bool
) -> None:
    monkeypatch.syspath_prepend(ROOT)
    from addon.build import environment
    from addon.build.process import Failure

    monkeypatch.setattr(environment, "THIS_PYTHON", f"{version[0]}.{version[1]}")
    monkeypatch.setattr(environment.sys, "version_info", (*version, 0, "final", 0))
    if accepted:
        environment.check_python(bpy)
    else:
        with pytest.raises(Failure, match=r"Python 3\.11 \(bpy 5\..*Python 3\.13 \(bpy 5\."):
            environment.check_python(bpy)


def test_versions_are_one() -> None:
    version = PYPROJECT["project"]["version"]
    manifest = tomllib.loads((ROOT / "addon" / "blender_manifest.toml").read_text())
    assert manifest["version"] == version
    cargo = tomllib.loads((ROOT / "native" / "Cargo.toml").read_text())
    assert cargo["package"]["version"] == version


def test_pins_are_exact() -> None:
    for pins in PYPROJECT["project"]["optional-dependencies"].values():
        for pin in pins:
            assert re.fullmatch(r"[\w-]+==[\d.]+(; python_version [=<>]+ '3\.\d+')?", pin), pin


@pytest.mark.parametrize("broken", ["", "pyluxcore"])
def test_peers_are_installed_where_they_can_be(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    broken: str,
) -> None:
    """One that cannot be installed is named, the others are, and the next call tries again."""
    monkeypatch.syspath_prepend(ROOT)
    from addon.build import environment

    asked: list[str] = []

    def pip(command: list[object]) -> int:
        asked.append(str(command[-1]))
        return int(bool(broken) and broken in asked[-1])

    monkeypatch.setattr(environment, "run", pip)
    monkeypatch.setattr(environment, "make_venv", dict)
    monkeypatch.setattr(environment, "STAMPS", tmp_path / "stamps.json")
    environment.ensure_where_possible("chart")
    assert asked == PYPROJECT["project"]["optional-dependencies"]["chart"]
    assert (tmp_path / "stamps.json").exists() == (not broken)
    assert ("Going on without pyluxcore" in capsys.readouterr().err) == bool(broken)


def test_the_renderer_needs_no_bpy() -> None:
    groups = PYPROJECT["project"]["optional-dependencies"]
    assert not any("bpy" in pin for group in ("run", "native", "rust") for pin in groups[group])


def test_scenes_are_small_and_old_blenders_read_them() -> None:
    assert len(SCENES) == 18
    for file in SCENES:
        assert file.stat().st_size < (300_000 if file.stem == "kitchen" else 200_000)
        assert file.read_bytes()[:4] == b"\x28\xb5\x2f\xfd", "not compressed"
    if zstd := shutil.which("zstd"):
        for file in SCENES:
            opened = subprocess.run([zstd, "-dcq", file], capture_output=True, check=False).stdout
            assert opened.startswith(b"BLENDER-v402"), "saved by a Blender that is not 4.2"


def test_license_is_whole() -> None:
    text = (ROOT / "LICENSE").read_text()
    assert "GNU GENERAL PUBLIC LICENSE" in text and "Version 3, 29 June 2007" in text
    assert "END OF TERMS AND CONDITIONS" in text


def test_missing_file(tmp_path: Path) -> None:
    done = build("render", "nowhere.blend", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "build.py: nowhere.blend: no such file\n"


def test_folder(tmp_path: Path) -> None:
    done = build("render", tmp_path)
    assert done.returncode == 1
    assert done.stderr == f"build.py: {tmp_path}: is a folder\n"


def test_rust_that_cannot_be_fetched(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """What fetches it is a tool of others: its message is shown, its traceback is not."""
    monkeypatch.syspath_prepend(ROOT)
    from addon.build import environment
    from addon.build.process import Failure

    (tmp_path / "puccinialin").mkdir()
    (tmp_path / "puccinialin" / "__main__.py").write_text(
        "def main():\n    print('Fetching')\n    raise OSError('no network')\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(environment, "PYTHON", Path(sys.executable))
    monkeypatch.setattr(environment, "RUST", tmp_path / "rust")
    monkeypatch.setattr(environment, "pip", lambda *_: None)
    with pytest.raises(Failure, match="install it with: curl"):
        environment.bootstrap_rust()
    said = capfd.readouterr()
    assert said.out == "Fetching\n"
    assert said.err.splitlines()[1:] == ["OSError: no network"]


def test_missing_snapshot_to_time(tmp_path: Path) -> None:
    done = build("bench", "nowhere.npz", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "build.py: nowhere.npz: no such file\n"


def test_file_of_another_kind(tmp_path: Path) -> None:
    (tmp_path / "scene.obj").touch()
    done = build("render", "scene.obj", cwd=tmp_path)
    assert done.returncode == 1
    assert "neither a .blend file nor an .npz scene snapshot" in done.stderr


@pytest.mark.parametrize("option", [("--frame", "2"), ("--blender", "x"), ("--report", "x.json")])
def test_options_that_a_snapshot_has_no_use_for(tmp_path: Path, option: tuple[str, str]) -> None:
    (tmp_path / "scene.npz").touch()
    done = build("render", "scene.npz", *option, cwd=tmp_path)
    assert done.returncode == 1
    assert option[0] in done.stderr


def test_blender_that_is_not_there(tmp_path: Path) -> None:
    done = build(
        "render", ROOT / "blend_scenes" / "cornell_box.blend", "--blender", "nowhere", cwd=tmp_path
    )
    assert done.returncode == 1
    assert "no such program" in done.stderr


def test_unknown_arguments_are_refused() -> None:
    assert build("render", "x.blend", "--sharpness", "3").returncode == 2
    assert build("doctor", "--", "x").returncode == 2
    assert build().returncode == 2


def test_doctor_names_what_it_looked_for() -> None:
    done = build("doctor")
    assert done.returncode in (0, 1)
    for item in ("Python", "OpenGL device", "Rust", "git", "glslangValidator", "Blender"):
        assert re.search(f"^{item} ", done.stdout, re.M), done.stdout


def test_doctor_works_before_anything_is_installed(tmp_path: Path) -> None:
    for name in ("build.py", "pyproject.toml", "native/Cargo.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "addon").mkdir()
    shutil.copy(ROOT / "addon" / "__init__.py", tmp_path / "addon")
    shutil.copytree(ROOT / "addon" / "build", tmp_path / "addon" / "build")
    command = [sys.executable, "-S", str(tmp_path / "build.py"), "doctor"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert "unknown until the packages are installed" in done.stdout
    assert done.stderr == ""
    assert not (tmp_path / ".venv").exists()


def stamped() -> bool:
    """Whether build.py has set this environment up, so that it has nothing to install."""
    stamps = ROOT / ".venv" / "photon_stream.json"
    return stamps.exists() and "blender" in json.loads(stamps.read_text())


@pytest.mark.parametrize(("name", "exit_code"), [("SIGINT", 130), ("SIGHUP", 129)])
def test_interrupted_while_build_is_imported(name: str, exit_code: int) -> None:
    code = f"""
import os, runpy, signal, sys
class Interrupting:
    def find_spec(self, name, *_):
        if name == "addon.build":
            os.kill(os.getpid(), signal.{name})
sys.meta_path.insert(0, Interrupting())
runpy.run_path("build.py", run_name="__main__")
"""
    done = run_python(code)
    assert (done.returncode, done.stdout, done.stderr) == (exit_code, "", "")


# What a render does when it gets to the point where it can stop, and how build.py ends then.
STOPS = [
    ("", False),
    ("sys.exit(130)", True),
    ("sys.exit(1)", True),
    ("os.kill(os.getpid(), 9)", True),
]


@pytest.mark.parametrize(("then", "fails"), STOPS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_held_back_until_it_is_let_in(
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    number: signal.Signals,
    then: str,
    fails: bool,
) -> None:
    """A picture that is there in spite of Ctrl-C is no failure."""
    monkeypatch.syspath_prepend(ROOT)
    from addon.build.process import run

    child = f"""
import os, signal, sys, time
while {number:d} not in signal.sigpending():
    time.sleep(0.01)
signal.signal({number:d}, lambda *_: print("heard of it", flush=True))
signal.pthread_sigmask(signal.SIG_UNBLOCK, [{number:d}])
{then}
"""
    timer = threading.Timer(0.2, os.kill, (os.getpid(), number))
    timer.start()
    if fails:
        with pytest.raises(SystemExit, match=str(128 + number)):
            run([sys.executable, "-c", child], held=[number])
    else:
        assert run([sys.executable, "-c", child], held=[number]) == 0
    timer.join()
    assert capfd.readouterr().out == "heard of it\n"


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.skipif(not stamped(), reason="build.py has not set up .venv for bpy")
@pytest.mark.parametrize("kind", [pytest.param("blend", marks=pytest.mark.blender), "npz"])
@pytest.mark.thorough(
    "130-0.1-",
    "130-0.3-",
    "130-0.6-",
    "129-0.0-",
    "129-0.1-",
    "129-0.3-",
    "129-0.45-",
    "129-0.6-",
    "130-0.45-",
    "129-0.2-",
)
@pytest.mark.parametrize("moment", [0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_interrupted_at_any_moment(
    tmp_path: Path, kind: str, number: int, code: int, moment: float
) -> None:
    """Or closing the terminal, while Python, Blender and the renderer start, too: a word at most,
    and no picture."""
    file = ROOT / "blend_scenes" / "cornell_box.blend"
    if kind == "npz":
        file = tmp_path / "scene.npz"
        cornell().save(file)
    command = [sys.executable, ROOT / "build.py", "render", file, "-o", tmp_path / "out.png"]
    with child(
        [*command, "--passes", "1000000"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as build:
        children = Path(f"/proc/{build.pid}/task/{build.pid}/children")
        deadline = time.monotonic() + STOPS_WITHIN
        while not children.read_text():
            assert build.poll() is None and time.monotonic() < deadline
            time.sleep(0.005)
        time.sleep(moment)
        build.send_signal(number)
        _, said = build.communicate(timeout=STOPS_WITHIN)
    assert build.returncode == code
    assert said in ("", "Cancelled\n", "interrupted: no picture written\n")
    assert set(os.listdir(tmp_path)) <= {"scene.npz"}


@pytest.mark.blender
@pytest.mark.skipif(not stamped(), reason="build.py has not set up .venv for bpy")
@pytest.mark.parametrize("content", [b"", b"just a text", b"BLENDER-v500 and then nothing"])
def test_what_is_no_blend_file(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "text.blend").write_bytes(content)
    done = build("render", "text.blend", cwd=tmp_path)
    assert done.returncode == 1
    assert "text.blend" in done.stderr and "Traceback" not in done.stderr
    assert os.listdir(tmp_path) == ["text.blend"]


@pytest.mark.skipif(not stamped(), reason="build.py has not set up .venv")
def test_what_is_no_snapshot(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("just a text")
    done = build("render", "text.npz", cwd=tmp_path)
    assert done.returncode == 1
    assert "text.npz" in done.stderr and "Traceback" not in done.stderr
    assert os.listdir(tmp_path) == ["text.npz"]
