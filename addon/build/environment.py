# SPDX-License-Identifier: GPL-3.0-or-later
"""The private environment: .venv beside build.py, pinned packages, the native core, Rust.

Everything is installed once and again only when the pins or the native sources have changed:
`.venv/photon_stream.json` remembers a digest of each.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from .process import Failure, absent_libraries, apt, first_line, run, say

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
STAMPS = VENV / "photon_stream.json"
RUST = VENV / "rust"  # a toolchain of our own, only where cargo is missing or too old
# What fetches it, with a line instead of a traceback where that fails
PUCCINIALIN = """
import sys
sys.excepthook = lambda kind, error, _: print(f"{kind.__name__}: {error}", file=sys.stderr)
from puccinialin.__main__ import main
main()
"""
WHEELS = ROOT / "build" / "wheels"
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
CARGO_TOML = ROOT / "native" / "Cargo.toml"
# {"3.11": "5.0.1", ...}: which Python has which bpy
BPY = {p: b for b, p in re.findall(r"bpy==([\d.]+); python_version == '([\d.]+)'", PYPROJECT)}
# What bpy takes from the system, what the renderer does, and Debian's packages of it
BPY_LIBRARIES = {
    "libGL.so.1": "libgl1",
    "libSM.so.6": "libsm6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libxkbcommon.so.0": "libxkbcommon0",
}
GL_LIBRARIES = {"libGL.so.1": "libgl1", "libEGL.so.1": "libegl1 libgl1-mesa-dri"}
THIS_PYTHON = f"{sys.version_info[0]}.{sys.version_info[1]}"


def pip(*args: str) -> None:
    if run([PYTHON, "-m", "pip", "--disable-pip-version-check", *args]) != 0:
        raise Failure("pip failed; its message is above")


def check_python(bpy: bool) -> None:
    """Refuse a Python that the pins do not cover, naming the ones that they do."""
    if THIS_PYTHON in BPY or (not bpy and (3, 11) <= sys.version_info < (3, 14)):
        return
    known = " or ".join(f"Python {p} (bpy {b})" for p, b in BPY.items())
    there = [name for name in (f"python{p}" for p in BPY) if shutil.which(name)]
    hint = f"; try {there[0]} build.py" if there else ""
    raise Failure(f"Photon Stream needs {known}; this is Python {platform.python_version()}{hint}")


def ensure(*groups: str) -> None:
    """Make .venv hold the pinned packages of `groups` and the native core; cheap if it does."""
    check_python("blender" in groups)
    if "blender" in groups and (absent := absent_libraries(BPY_LIBRARIES)):
        raise Failure(f"bpy needs shared libraries that are not here: {apt(' '.join(absent))}")
    stamps = make_venv()
    pins = pinned()
    stale = {g: mark for g in groups if stamps.get(g) != (mark := digest(*pins[g]))}
    if stale:
        size = "; bpy is a download of about 400 MB" if "blender" in stale else ""
        say(f"Installing the pinned packages ({', '.join(stale)}{size})")
        pip("install", *(pin for group in stale for pin in pins[group]))
        stamps |= stale
        STAMPS.write_text(json.dumps(stamps))
    core = digest(*native_sources())
    if stamps.get("core") != core:
        say("Building the native core")
        pip("install", "--no-deps", "--force-reinstall", str(build_native()))
        STAMPS.write_text(json.dumps(stamps | {"core": core}))


def ensure_where_possible(group: str) -> None:
    """Install a group's packages one by one, without dependencies; name those that cannot be."""
    stamps, pins = make_venv(), pinned()[group]
    if stamps.get(group) == digest(*pins):
        return
    say(f"Installing what there is of {group} ({', '.join(pins)})")
    absent = []
    for pin in pins:
        try:
            pip("install", "--no-deps", pin)
        except Failure:
            absent.append(pin)
    if absent:
        say(f"Going on without {', '.join(absent)}")
    else:
        STAMPS.write_text(json.dumps(stamps | {group: digest(*pins)}))


def make_venv() -> dict[str, str]:
    """Make .venv unless this Python has made it, and return what it is stamped to hold."""
    config = VENV / "pyvenv.cfg"
    about = config.read_text() if config.exists() and PYTHON.exists() else ""
    ours = re.search(rf"^version\D*{re.escape(THIS_PYTHON)}\b", about, re.M) is not None
    if ours and STAMPS.exists():
        return dict(json.loads(STAMPS.read_text()))
    say(f"Making the private environment {VENV}")
    clear: list[str] = (
        [] if ours else ["--clear"]
    )  # ours without a stamp was interrupted: complete it
    if run([sys.executable, "-m", "venv", *clear, str(VENV)]) != 0:
        raise Failure(f"Python's venv module failed; on Debian: {apt('python3-venv')}")
    return {}


def pinned() -> dict[str, list[str]]:
    """The pins of each group."""
    import tomllib  # Python 3.11: not at the top, where older ones would fail with a traceback

    return dict(tomllib.loads(PYPROJECT)["project"]["optional-dependencies"])


def digest(*parts: str | bytes) -> str:
    total = hashlib.sha256()
    for part in parts:
        total.update(part.encode() if isinstance(part, str) else part)
        total.update(b"\0")
    return total.hexdigest()


def native_sources() -> Iterator[str | bytes]:
    """Name and contents of every file that the native core is built from."""
    native = CARGO_TOML.parent
    for path in sorted([*native.glob("*.*"), *(native / "src").rglob("*.rs")]):
        yield path.relative_to(ROOT).as_posix()
        yield path.read_bytes()


def build_native() -> Path:
    """Build the native core's wheel into build/wheels and return its path."""
    if os.name == "posix" and not shutil.which("cc"):
        raise Failure(f"no C compiler to link with; on Debian: {apt('gcc libc6-dev')}")
    env = rust_env() or bootstrap_rust()
    shutil.rmtree(WHEELS, ignore_errors=True)
    maturin: list[str | Path] = [PYTHON, "-m", "maturin", "build", "--release", "-i", PYTHON]
    env["SOURCE_DATE_EPOCH"] = "315532800"  # the same sources give the same wheel
    if run([*maturin, "-m", CARGO_TOML, "-o", WHEELS], env) != 0:
        raise Failure("the native core does not build; the compiler's message is above")
    return next(WHEELS.glob("*.whl"))


def rust_env() -> dict[str, str] | None:
    """The environment in which cargo is found and new enough for native/Cargo.toml, if any."""
    own = {"RUSTUP_HOME": str(RUST / "rustup"), "CARGO_HOME": str(RUST / "cargo")}
    path = os.environ.get("PATH", os.defpath)
    for extra in (
        {},
        {"PATH": f"{Path.home() / '.cargo' / 'bin'}{os.pathsep}{path}"},  # rustup's, not on PATH
        {"PATH": f"{RUST / 'cargo' / 'bin'}{os.pathsep}{path}", **own},
    ):
        env = dict(os.environ, PATH=path) | extra
        version = re.search(r"\d+\.\d+", first_line("cargo", "--version", env=env) or "")
        if version and numbers(version[0]) >= numbers(rust_needed()):
            return env
    return None


def rust_needed() -> str:
    """The oldest Rust that the native core says it builds with."""
    found = re.search(r'^rust-version *= *"([\d.]+)"', CARGO_TOML.read_text(), re.M)
    return found[1] if found else "1.85"  # the first to know edition 2024


def numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".")]


def bootstrap_rust() -> dict[str, str]:
    """Fetch a Rust toolchain into .venv, where it disturbs no other."""
    say(f"No cargo {rust_needed()} or newer: fetching Rust into {RUST} (about 650 MB)")
    pip("install", *pinned()["rust"])
    code = run([PYTHON, "-c", PUCCINIALIN, "--location", RUST, "--info-json", RUST / "env.json"])
    env = rust_env() if code == 0 else None
    if env is None:
        rustup = "curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
        raise Failure(f"Rust's cargo {rust_needed()} or newer is needed; install it with: {rustup}")
    return env
