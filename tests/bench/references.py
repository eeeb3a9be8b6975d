# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the chart's references, two independent halves a scene, in blend_scenes/references.

    .venv/bin/python -m tests.bench.references [scene ...] [--seconds N]

Each half is a mean of pictures that several renderers made with seeds which the chart does not use,
weighted by the inverse of their variances but by 0.9 at most; so no contender is compared with
itself alone, but for Cycles in studio, daylight and kitchen, which no other engine here takes.
Where caustics are what a scene is about, a light tracer in numpy finds them
(contenders/light_map.py).
Photon Stream, whose estimate is consistent and not unbiased, is no part of them: its pictures are
made to see that it converges to the same. Whether renderers agree is measured without their noise,
as the mean of (s_A - t_A)(s_B - t_B) for renderers s and t, and written into the file.

`--seconds` is the wall time of each picture: 60 took an hour on two busy cores. Needs what
`build.py chart` installs.

The pictures can be made elsewhere: `--pictures FOLDER` keeps them there, and takes those that are
there already. On a machine with a GPU, Mitsuba and Dr.Jit, but without Blender and OpenGL,

    MITSUBA_VARIANT=cuda_ad_rgb python -m tests.bench.references --only mitsuba light_tracer
        --snapshots FOLDER_OF_NPZ --pictures FOLDER

makes those two engines' pictures, and mixes nothing.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from .chart.measure import mean_of
from .chart.scenes import CAUSTICS, SCENES, SIZE, Reference, blend_file, write_reference
from .chart.worker import EngineError, Worker

SEEDS = {"A": 7001, "B": 7002}
MOST = 0.9  # a renderer's weight, where there are others
CHECK = "photon_stream/photons"  # is compared with the others and not mixed in
_PATHS = (("mitsuba", "path"), ("cycles", "path"), ("photon_stream", "photons"))
# Path tracers find no caustic of a delta light, and few ways through a door ajar.
SOURCES = dict.fromkeys(SCENES, _PATHS) | {
    "mirror_caustic": (
        ("light_tracer", "light"),
        ("mitsuba", "ptracer"),
        ("photon_stream", "photons"),
    ),
    "caustic_in_mirror": (("light_tracer", "light"), ("photon_stream", "photons")),
    "door_ajar": (("light_tracer", "light"), ("mitsuba", "path"), ("photon_stream", "photons")),
    # The others know neither area lights nor worlds nor textures.
    "studio": (("cycles", "path"), ("photon_stream", "photons")),
    "daylight": (("cycles", "path"), ("photon_stream", "photons")),
    "kitchen": (("cycles", "path"), ("photon_stream", "photons")),
    # Those of what glows they find.
    "glass_bulb": (("cycles", "path"), ("mitsuba", "path"), ("photon_stream", "photons")),
    "frosted_glass": (("cycles", "path"), ("mitsuba", "path"), ("photon_stream", "photons")),
    # Of lamps without size nothing.
    **dict.fromkeys(CAUSTICS, (("light_map", "path"), ("photon_stream", "photons"))),
    "sunlit_window": (
        ("mitsuba", "ptracer"),
        ("light_map", "path"),
        ("photon_stream", "photons"),
    ),
}

Halves = dict[str, Any]  # "A" and "B" to pictures (h, w, 3)


def main() -> None:
    """Make the references of the scenes named on the command line, or all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", nargs="*", choices=[[], *SCENES], help="default: all")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each picture")
    parser.add_argument("--snapshots", type=Path, help="folder of SCENE.npz: no Blender needed")
    parser.add_argument("--pictures", type=Path, help="folder of the engines' pictures")
    parser.add_argument("--only", nargs="+", help="make these engines' pictures and mix nothing")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        pictures = args.pictures or Path(folder)
        pictures.mkdir(parents=True, exist_ok=True)
        for name in args.scene or SCENES:
            for source in SOURCES[name]:
                path = picture_file(pictures, name, source)
                if not path.exists() and (not args.only or source[0] in args.only):
                    render(name, source, args.seconds, args.snapshots or Path(folder), path)
            if not args.only:
                make(name, pictures)


def picture_file(folder: Path, name: str, source: tuple[str, str]) -> Path:
    return folder / f"{name}-{'-'.join(source)}.npz"


def render(name: str, source: tuple[str, str], seconds: float, snapshots: Path, path: Path) -> None:
    """Render a scene's two halves with one engine into an .npz file."""
    snapshot, (module, method) = snapshots / f"{name}.npz", source
    found: dict[str, Any] = {}
    worker: Worker | None = None
    try:
        if not snapshot.exists():  # Cycles exports the scene that the others read
            worker = Worker("cycles")
            worker.load(snapshot, blend_file(name), SIZE)
            worker.close()
        worker = Worker(module)
        found["about"] = worker.load(snapshot, blend_file(name), SIZE)["about"]
        for half, seed in SEEDS.items():
            for step in worker.climb(method, seed, seconds, path.parent):
                if "file" in step:
                    found[half], found["effort"] = np.load(step["file"]), step["effort"]
                    Path(step["file"]).unlink()
    except EngineError as error:
        raise SystemExit(f"{name}: {module}: {error}") from None
    finally:
        if worker:
            worker.close()
    np.savez(path, **found)
    print(f"{path}: effort {found['effort']:g}", flush=True)


def make(name: str, folder: Path) -> None:
    """Mix a scene's pictures into its reference and write it."""
    pictures, notes = {}, []
    for source in SOURCES[name]:
        with np.load(picture_file(folder, name, source)) as data:
            pictures["/".join(source)] = {half: data[half].astype(float) for half in SEEDS}
            notes.append(f"{data['about']}, {source[1]}, effort {float(data['effort']):g}")
    reference, words = mix(pictures)
    notes = [f"{name}.blend, {SIZE}x{SIZE}, halves A and B", *notes, *words]
    path = write_reference(name, Reference(reference["A"], reference["B"], "; ".join(notes)))
    print(f"{path} ({path.stat().st_size // 1000} kB)")
    print("\n".join(f"  {note}" for note in notes), flush=True)


def mix(pictures: dict[str, Halves]) -> tuple[Halves, list[str]]:
    """The halves' weighted means, and what there is to say about the sources."""
    truth = np.mean([(p["A"] + p["B"]) / 2 for p in pictures.values()], axis=0)
    floor = np.maximum(truth, truth.mean())
    variances = {
        name: float((((p["A"] - p["B"]) / floor) ** 2).mean() / 2) for name, p in pictures.items()
    }
    weights = shares(variances)
    words = [
        f"{name}: weight {weights[name]:.2f}, variance of a half {variances[name]:.1e}"
        for name in pictures
    ]
    for (s, p), (t, q) in itertools.combinations(pictures.items(), 2):
        apart = ((p["A"] - q["A"]) * (p["B"] - q["B"]) / floor**2).mean(axis=2)
        found = mean_of(apart)
        ratio = (p["A"] + p["B"]).mean() / (q["A"] + q["B"]).mean() - 1
        words.append(
            f"{s} and {t} differ by relMSE {found.value:.1e} +- {found.deviation:.1e}, "
            f"their means by {ratio:+.2%}"
        )
    mixed = {half: sum(weights[n] * p[half] for n, p in pictures.items()) for half in SEEDS}
    noise = float((((mixed["A"] - mixed["B"]) / floor) ** 2).mean() / 2)
    return mixed, [*words, f"variance of a half of the mixture {noise:.1e}"]


def shares(variances: dict[str, float]) -> dict[str, float]:
    """Weights of sum 1: inverse variances, MOST at most if there are others; nothing for CHECK."""
    inverse = {name: 1 / value for name, value in variances.items() if name != CHECK}
    heaviest = max(inverse, key=lambda name: inverse[name])
    rest = sum(inverse.values()) - inverse[heaviest]
    if rest > 0:
        inverse[heaviest] = min(inverse[heaviest], rest * MOST / (1 - MOST))
    total = sum(inverse.values())
    return {name: inverse.get(name, 0.0) / total for name in variances}


if __name__ == "__main__":
    main()
