# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against time beside Cycles and Cycles with OpenImageDenoise on one GPU: three steps.

    python -m tests.bench.gpu export FOLDER SCENE ...   writes FOLDER/SCENE.npz; needs bpy
    python -m tests.bench.gpu cycles FOLDER SCENE ...   their references and curves; needs bpy
    python -m tests.bench.gpu ours FOLDER SCENE ...     our curves, and all of them in a table

Scenes are those of blend_scenes, with Cycles' own lobes. The second and the third step belong on
the same machine one after the other; interpreters may differ, for bpy has one of its own.

References are Cycles' own, in two halves of independent noise, so scenes whose caustics it does not
find, those of lamps without a size, say nothing here. Seconds are what somebody waits for who has
the scene on the device: of Cycles bpy.ops.render.render() with persistent data, the sooner of two;
ours are from there to the picture in the caller's hands, radii and photons that tell them included,
one look each, medians of seeds. Neither's programs and BVH are in them.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .chart.measure import lenient_errors, mean_of, squared_errors
from .chart.scenes import Reference

SAMPLES = (1, 2, 4, 8, 16, 64, 256, 1024)
PASSES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
# Samples of each half; 8192 otherwise. One path of ten thousand finds a small lamp through glass.
REFERENCE = {"door_ajar": 16384} | dict.fromkeys(("wine_glass", "pool", "ring"), 16384)
SEEDS = (1001, 2001)
LONGEST = 4.0  # [s] of a curve


def export(folder: Path, names: Sequence[str], size: int) -> None:
    """Write the snapshots."""
    from addon.blender.export import SpecularModel
    from tests.regression.cycles import open_blend

    for name in names:
        open_blend(name, size, SpecularModel.GGX).save(folder / f"{name}.npz")


def cycles(folder: Path, names: Sequence[str], size: int, device: str, half: int | None) -> None:
    """Write references and curves; `half`: samples of halves, and no curves."""
    import bpy

    if device != "CPU":
        found = bpy.context.preferences.addons["cycles"].preferences
        found.compute_device_type = device
        found.get_devices()
        for each in found.devices:
            each.use = each.type == device
    for name in names:
        _open(name, size)
        bpy.context.scene.cycles.device = "CPU" if device == "CPU" else "GPU"
        _shot(1, 9, False)
        _shot(1, 9, True)
        samples = half or (512 if device == "CPU" else REFERENCE.get(name, 8192))
        for which, seed in zip("ab", SEEDS, strict=True):
            picture, seconds = _shot(samples, seed, False)
            np.save(folder / f"{name}.{which}.npy", picture)
            print(f"{name}: a half of the reference in {seconds:.1f} s", flush=True)
        if half:
            continue
        reference, curves = _reference(folder, name), {}
        for method in ("Cycles", "Cycles + OIDN"):
            curve = []
            for samples in SAMPLES:
                shots = [_shot(samples, seed, method != "Cycles") for seed in (5, 6)]
                errors = _errors([picture for picture, _ in shots], reference)
                curve.append([samples, min(seconds for _, seconds in shots), *errors])
                if curve[-1][1] > LONGEST:
                    break
            curves[method] = curve
            _tell(name, method, curve)
        (folder / f"{name}.json").write_text(json.dumps(curves))


def ours(folder: Path, names: Sequence[str], size: int, seeds: int) -> None:
    """Climb, and print all curves."""
    from addon.photon.backends.backend import open_device
    from addon.photon.photons.kept import Kept
    from addon.photon.scene import Scene
    from addon.photon.settings import Settings

    device = open_device(Settings())
    for name in names:
        kept = Kept(device, budget=0)  # the scene and the denoiser stay, as Cycles' persistent data
        scene, reference = Scene.load(folder / f"{name}.npz"), _reference(folder, name)
        curves = json.loads((folder / f"{name}.json").read_text())
        for method in ("Photon Stream", "Photon Stream + Denoise"):
            settings = {"width": size, "height": size, "denoise": method.endswith("Denoise")}
            climbs = []
            for seed in range(seeds + 1):
                made = Settings(passes=1 << 24, seed=seed, **settings)
                climbs.append(_climb(scene, made, kept))
            curves[method] = curve = []
            # The first climb compiles.
            for passes, *rung in zip(PASSES, *climbs[1:], strict=False):
                seconds = statistics.median(spent for spent, _ in rung)
                curve.append([passes, seconds, *_errors([x for _, x in rung], reference)])
            _tell(name, method, curves[method])
        kept.release()
        (folder / f"{name}.json").write_text(json.dumps(curves))
    _table(folder, names)


def _climb(scene: Any, settings: Any, kept: Any) -> list[tuple[float, Any]]:
    """Seconds and pictures after PASSES."""
    from addon.photon.prepare import prepare

    device = kept.device
    begun = time.perf_counter()
    renderer = prepare(scene, settings, device, kept)
    looked = renderer.seconds["bvh"] + renderer.seconds["programs"]  # what does not count
    done, rungs = 0, []
    for passes in PASSES:
        while done < passes:
            done += renderer.render_passes(passes - done)
        device.ctx.finish()
        look = time.perf_counter()
        picture = renderer.images(["Combined"])["Combined"]
        now = time.perf_counter()
        rungs.append((now - begun - looked, picture[..., :3]))
        looked += now - look
        if rungs[-1][0] > LONGEST:
            break
    renderer.release()
    return rungs


def _open(name: str, size: int) -> None:
    """A scene of blend_scenes, set so that nothing but noise separates Cycles from the truth."""
    import bpy

    from tests.regression.cycles import BLEND_SCENES, prepare

    bpy.ops.wm.open_mainfile(filepath=str(BLEND_SCENES / f"{name}.blend"))
    scene = bpy.context.scene
    prepare(scene, 1, 1)
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.cycles.transmission_bounces = scene.cycles.max_bounces
    scene.render.use_persistent_data = True


def _shot(samples: int, seed: int, denoise: bool) -> tuple[Any, float]:
    """A picture (h, w, 3), row 0 at the bottom, and the seconds of its render."""
    import bpy

    settings = bpy.context.scene.cycles
    settings.samples, settings.seed, settings.use_denoising = samples, seed, denoise
    settings.denoiser, settings.denoising_use_gpu = "OPENIMAGEDENOISE", True
    begun = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - begun
    from tests.regression.cycles import read_exr

    path = Path(bpy.app.tempdir) / "shot.exr"
    bpy.data.images["Render Result"].save_render(str(path))
    return read_exr(path), seconds


def _reference(folder: Path, name: str) -> Reference:
    a, b = (np.load(folder / f"{name}.{half}.npy").astype(np.float64) for half in "ab")
    return Reference(a, b, "Cycles")


def _errors(pictures: Sequence[Any], reference: Reference) -> list[float]:
    """Strict relMSE and relMSE, medians."""
    return [
        statistics.median(mean_of(errors(picture, reference)).value for picture in pictures)
        for errors in (squared_errors, lenient_errors)
    ]


def _tell(name: str, method: str, curve: Sequence[Sequence[float]]) -> None:
    points = ", ".join(f"{e:.0f}: {s * 1e3:.1f} ms {error:.2e}" for e, s, error, _ in curve)
    print(f"{name}, {method}: {points}", flush=True)


def _table(folder: Path, names: Sequence[str]) -> None:
    """Milliseconds to errors, and errors after times, of every curve."""
    errors, times = (1e-2, 1e-3, 1e-4), (0.03, 0.1, 0.3, 1.0, 2.0)
    head = [f"ms to {error:g}" for error in errors] + [f"after {t * 1e3:.0f} ms" for t in times]
    print("| scene | | " + " | ".join(head) + " |\n|" + "---|" * (len(head) + 2))
    for name in names:
        for method, curve in json.loads((folder / f"{name}.json").read_text()).items():
            cells = [
                next((f"{s * 1e3:.0f}" for _, s, error, _ in curve if error <= target), "-")
                for target in errors
            ]
            for end in times:
                before = [error for _, seconds, error, _ in curve if seconds <= end]
                cells.append(f"{before[-1]:.1e}" if before else "-")
            print(f"| {name} | {method} | " + " | ".join(cells) + " |")


def main() -> None:
    """One step."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("step", choices=("export", "cycles", "ours"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("scene", nargs="+")
    parser.add_argument("--size", type=int, default=512, help="[px] a side")
    parser.add_argument("--device", default="CUDA", help="of Cycles: CUDA, HIP, METAL, ONEAPI, CPU")
    parser.add_argument("--seeds", type=int, default=3, help="of ours")
    parser.add_argument("--samples", type=int, help="of each half of a reference; no curves then")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.step == "export":
        export(args.folder, args.scene, args.size)
    elif args.step == "cycles":
        cycles(args.folder, args.scene, args.size, args.device, args.samples)
    else:
        ours(args.folder, args.scene, args.size, args.seeds)


if __name__ == "__main__":
    main()
