#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one door to Photon Stream: render, test, package, doctor.

Needs nothing but Python: what a command needs besides is installed into .venv beside this file.
"""

import signal
import sys

if __name__ == "__main__":  # before the imports, which take time: Ctrl-C ends without a traceback
    signal.signal(signal.SIGINT, lambda *_: sys.exit(130))
    # So does closing the terminal, unless nohup or its like forbids to hear of it.
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: sys.exit(129))

import argparse
import os
import shutil
from pathlib import Path
from typing import Any

from addon.build import checks, doctor, package
from addon.build.environment import PYTHON, ROOT, ensure, ensure_where_possible
from addon.build.process import Failure, hangup, run, say

COMMAND = ROOT / "addon" / "blender" / "command.py"
# A renderer, and Blender, takes long to start, and stops in order once it has.
INTERRUPT = {signal.SIGINT, *hangup()}
RENDER_OPTIONS: dict[str, dict[str, Any]] = {
    "output": {"type": Path, "metavar": "FILE", "help": ".png, or .exr with every pass in float"},
    "frame": {"type": int, "metavar": "N", "help": "frame of the animation"},
    "width": {"type": int, "metavar": "N", "help": "of the picture [px]"},
    "height": {"type": int, "metavar": "N", "help": "of the picture [px]"},
    "seed": {"type": int, "metavar": "N", "help": "of the random numbers"},
    "passes": {"type": int, "metavar": "N", "help": "to average"},
    "noise-threshold": {"type": float, "metavar": "X", "help": "stop at this relative error"},
    "photons": {"type": int, "metavar": "N", "help": "a pass, else two a pixel"},
    "radius": {"type": float, "metavar": "R", "help": "of density estimation; 0: automatic"},
    "estimator": {"choices": ("auto", "splat", "gather"), "help": "sums photons up"},
    "backend": {"choices": ("auto", "fragment", "compute", "native"), "help": "runs the kernels"},
    "caustics": {"action": "store_true", "help": "a pass of them in .exr"},
    "illuminance": {"action": "store_true", "help": "a pass of it in .exr [lx], for build.py lux"},
    "denoise": {"action": "store_true", "help": "what is noise in the picture"},
    "denoising-data": {"action": "store_true", "help": "albedo and normal for denoisers, in .exr"},
    "report": {"type": Path, "metavar": "FILE", "help": "what was approximated or left out, JSON"},
}


def render(args: argparse.Namespace) -> int:
    """Hand the file to the add-on's command line, under the interpreter that it needs."""
    file: Path = args.file
    if not file.is_file():
        raise Failure(f"{file}: {'is a folder' if file.is_dir() else 'no such file'}")
    snapshot = file.suffix.lower() == ".npz"
    if not snapshot and file.suffix.lower() != ".blend":
        raise Failure(f"{file}: neither a .blend file nor an .npz scene snapshot")
    for name in ("blender", "frame", "report"):
        if snapshot and getattr(args, name) is not None:
            raise Failure(f"--{name} is for .blend files; {file} is a scene snapshot")
    args.output = args.output or Path(f"{file.stem}.png")
    options = [str(file.resolve())]
    for name in RENDER_OPTIONS:
        value = getattr(args, name.replace("-", "_"))
        if value is True:
            options += [f"--{name}"]
        elif value not in (None, False):
            options += [f"--{name}", str(value.resolve() if isinstance(value, Path) else value)]
    if snapshot:
        ensure("run", "native")
        if args.denoise and doctor.denoiser() is None:
            ensure_where_possible("denoise")
        return run([PYTHON, "-m", "addon.photon.jobs.command", *options], cwd=ROOT, held=INTERRUPT)
    if args.blender:
        blender = shutil.which(args.blender)
        if blender is None:
            raise Failure(f"--blender {args.blender}: no such program")
        # The renderer is a process of its own and runs under our interpreter, not Blender's.
        ensure("run", "native")
        background = [blender, "-b", "--factory-startup", "--python-exit-code", "1"]
        env = os.environ | {"PHOTON_STREAM_PYTHON": str(PYTHON)}
        return run([*background, "--python", COMMAND, "--", *options], env, held=INTERRUPT)
    ensure("run", "native", "blender")
    return run([PYTHON, COMMAND, *options], held=INTERRUPT)


def lux(args: argparse.Namespace) -> int:
    """A picture's illuminance in false colours."""
    ensure("run", "native")
    options: list[Any] = [args.file.resolve()]
    for name in ("output", "most"):
        value = getattr(args, name)
        if value is not None:
            options += [f"--{name}", value.resolve() if isinstance(value, Path) else value]
    return run([PYTHON, "-m", "addon.photon.jobs.lux", *options], cwd=ROOT)


def measure(bench: str, options: list[Any], blender: bool) -> int:
    """Run a benchmark of tests/bench, beside those of its peers that can be installed."""
    ensure("run", "native", *["blender"] * blender)
    ensure_where_possible(bench)
    module = {"bench": "speed"}.get(bench, bench)
    return run([PYTHON, "-m", f"tests.bench.{module}", *options], cwd=ROOT)


def chart(args: argparse.Namespace) -> int:
    """Error against seconds."""
    options = [*["--quick"] * args.quick, "-o", args.output, *args.theirs]
    return measure("chart", options, blender=True)


def bench(args: argparse.Namespace) -> int:
    """Seconds alone."""
    files = args.file or sorted((ROOT / "blend_scenes").glob("*.blend"))
    for file in files:
        if not file.exists():
            raise Failure(f"{file}: no such file")
    options = [*(file.resolve() for file in files), "-o", args.output.resolve(), *args.theirs]
    return measure("bench", options, any(file.suffix.lower() == ".blend" for file in files))


def main(argv: list[str]) -> int:
    """Parse the command line and do as it says; what follows `--` is pytest's or the bench's."""
    ours, theirs = argv, []
    if "--" in argv:
        ours, theirs = argv[: argv.index("--")], argv[argv.index("--") + 1 :]
    parser = argparse.ArgumentParser(prog="build.py", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    sub = commands.add_parser("render", help="render a .blend file or an .npz scene snapshot")
    sub.set_defaults(do=render)
    sub.add_argument("file", type=Path)
    for name, kind in RENDER_OPTIONS.items():
        flags = ["-o", "--output"] if name == "output" else [f"--{name}"]
        sub.add_argument(*flags, **kind)
    sub.add_argument("--blender", metavar="PATH", help="render inside this installed Blender")
    sub = commands.add_parser("lux", help="show a picture's illuminance in false colours")
    sub.set_defaults(do=lux)
    sub.add_argument("file", type=Path, help=".exr of render --illuminance, or of Blender")
    sub.add_argument("-o", "--output", type=Path, metavar="FILE", help=".png")
    sub.add_argument("--most", type=float, metavar="LX", help="top of the scale; else automatic")
    sub = commands.add_parser("test", help="run every check; arguments after -- go to pytest")
    sub.set_defaults(do=checks.test, pytest=theirs)
    sub.add_argument("--stability", action="store_true", help="only the stability table's tests")
    sub = commands.add_parser("chart", help="error against seconds, beside other renderers")
    sub.set_defaults(do=chart, theirs=theirs)
    sub.add_argument("--quick", action="store_true", help="ten minutes instead of forty")
    sub.add_argument("-o", "--output", type=Path, default=Path("chart"), metavar="FOLDER")
    sub = commands.add_parser("bench", help="seconds of each kernel, backend, estimator, choice")
    sub.set_defaults(do=bench, theirs=theirs)
    sub.add_argument(
        "file",
        type=Path,
        nargs="*",
        help=".npz, folder of them, or .blend; default: those of blend_scenes; arguments after --"
        " go to tests/bench/speed",
    )
    sub.add_argument("-o", "--output", type=Path, default=Path("bench"), metavar="FOLDER")
    sub = commands.add_parser("package", help="write the extension for Blender into dist/")
    sub.set_defaults(do=package.package)
    sub = commands.add_parser("doctor", help="say what is here, what is missing, how to get it")
    sub.set_defaults(do=doctor.doctor)
    args = parser.parse_args(ours)
    if theirs and ours[0] not in ("test", "bench", "chart"):
        parser.error(f"unexpected arguments: {' '.join(theirs)}")
    try:
        return int(args.do(args))
    except Failure as error:
        say(f"build.py: {error}")
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
