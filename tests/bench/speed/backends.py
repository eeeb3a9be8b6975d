# SPDX-License-Identifier: GPL-3.0-or-later
"""What each backend and estimator takes, kernel by kernel, beside the machine's own ceiling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from addon.photon.scene import Scene
from addon.photon.settings import Settings
from addon.photon.stage.geometry import Mesh, frame_of
from addon.streams import Device
from tests.scenes import corners_of

from ..host import CORES
from . import machine
from .counts import Work, count_work
from .launches import EYE, PHOTONS, Timer
from .passes import Clock, Predictor, Timing, rates_of, steady, time_way, ways_of
from .report import Report, Table, amount, duration

_SLICE = 1.5  # [s] of passes that a way gets


def measure_machine(report: Report, timer: Timer, scene: Scene, settings: Settings) -> None:
    """Ceilings of the machine, and what a render pays once."""
    table = report.table("The machine's own ceiling", "what", "measured")
    device, data = timer.device, {}
    for name, speed in machine.device_copies(timer).items():
        table.add(f"copy, {name}", amount(speed, "B/s"))
        data[f"copy, {name} [B/s]"] = speed
    for threads in sorted({1, CORES}):
        speed = machine.host_copy(threads)
        name = f"copy, host, {threads} thread{'s'[: threads > 1]}"
        table.add(name, amount(speed, "B/s"))
        data[f"{name} [B/s]"] = speed
    for name, each in (("the scene", scene), ("a bumpy sphere", machine.bumpy_sphere())):
        seconds, mesh = machine.build_bvh(each)
        what = f"{name}, {len(mesh.triangles)} triangles"
        table.add(f"BVH of {what}", duration(seconds))
        data[f"BVH of {name} [s]"], data[f"triangles of {name}"] = seconds, len(mesh.triangles)
        rays = machine.native_rays(mesh, machine.incoherent_rays(corners_of(mesh)))
        table.add(f"incoherent rays, native core, {what}", amount(rays, "rays/s"))
        data[f"native rays, {name} [1/s]"] = rays
        embree = machine.embree_rays(mesh)
        told = embree if isinstance(embree, str) else amount(embree, "rays/s")
        table.add(f"incoherent rays, Embree, {what}", told)
        data[f"Embree rays, {name} [1/s]"] = embree
    for rows in (22, 283):
        room = machine.room_with_spheres(rows)
        mesh = Mesh.build(room, frame_of(room))
        triangles = len(mesh.triangles)
        what = f"two balls in a room, {triangles} triangles"
        rays = machine.native_rays(mesh, machine.wall_rays(machine.RAYS))
        table.add(f"rays off the walls, native core, {what}", amount(rays, "rays/s"))
        data[f"native tracer, {triangles} triangles [1/s]"] = rays
        rays = machine.device_rays(timer, room, mesh)
        table.add(f"rays off the walls, tracer on the device, {what}", amount(rays, "rays/s"))
        data[f"tracer, {triangles} triangles [1/s]"] = rays
    table.note("bytes copied on host or device count as read and as written; rays: closest hits")
    first, next_one = machine.process_start(scene)
    table.add("renderer process, first 64x64 picture", duration(first))
    table.add("renderer process, next 64x64 picture", duration(next_one))
    data |= {"process, first picture [s]": first, "process, next picture [s]": next_one}
    peak, before = machine.peak_memory(scene, settings)
    size = f"{settings.width}x{settings.height}, {settings.photons_a_pass} photons"
    table.add(f"memory at most, {size}", amount(peak, "B"))
    table.add("of which before the renderer: Python, OpenGL", amount(before, "B"))
    data |= {"memory [B]": peak, "memory before the renderer [B]": before}
    report.data["machine"] = {"device": machine.describe(device), **data}


def measure_ways(
    report: Report, timer: Timer, name: str, scene: Scene, settings: Settings, clock: Clock
) -> None:
    """Every backend and estimator on one scene."""
    device = timer.device
    work = count_work(scene, steady(settings), device)
    picture = f"{name}, {settings.width}x{settings.height}, {settings.photons_a_pass} photons"
    table = _rates_table(report, f"One pass: {picture}")
    kernels: dict[str, Timing] = {}
    ways, predictor = ways_of(device), Predictor()
    for number, way in enumerate(ways):
        # A way is begun, passed through to warm up, timed and watched.
        guess = 4 * max(predictor.seconds(known, 1.0) for known in ways)
        if clock.left < guess:
            table.note(f"{way}: not measured, no time left for it")
            continue
        fair = clock.left / (len(ways) - number)
        timing = time_way(scene, way.of(settings), device, min(_SLICE, fair / 2), timer)
        predictor.learn(way, 1.0, timing.seconds)
        kernels[str(way)] = timing
        _add_rates(table, str(way), timing, work)
    _work_notes(table, work, device)
    report.bars_title = f"{picture}: a pass (logarithmic)"
    report.bars = [(way, timing.seconds) for way, timing in kernels.items()]
    report.data["ways"] = {
        "scene": name,
        "settings": asdict(settings),
        "work": asdict(work),
        "ways": {way: timing_data(timing, work) for way, timing in kernels.items()},
    }
    _kernel_table(report, f"Time of each kernel in a pass: {picture}", kernels)


def measure_scenes(
    report: Report, timer: Timer, scenes: Mapping[str, Scene], settings: Settings, clock: Clock
) -> None:
    """What the renderer chooses by itself, on each scene."""
    table = _rates_table(report, f"One pass, {settings.width}x{settings.height}, chosen by itself")
    results = report.data["scenes"] = {}
    for number, (name, scene) in enumerate(scenes.items()):
        fair = clock.left / (len(scenes) - number)
        if fair <= 0:
            table.note(f"{name}: not measured, no time left for it")
            continue
        work = count_work(scene, steady(settings), timer.device)
        timing = time_way(scene, settings, timer.device, min(_SLICE, fair / 4), timer)
        _add_rates(table, name, timing, work)
        results[name] = timing_data(timing, work) | {"triangles": len(scene.triangles)}


def _rates_table(report: Report, title: str) -> Table:
    heads = ("", "pass", "least to most", "passes", "start", "no kernel")
    rates = ("photon paths/s", "photon rays/s", "eye rays/s", "pairs/s")
    return report.table(title, *heads, *rates, "streams", "streams/s", "to host", "to device")


def _add_rates(table: Table, name: str, timing: Timing, work: Work) -> None:
    rates, watch = rates_of(timing, work), timing.watch
    assert watch
    moved = sum(spent.moved for spent in watch.spent.values())
    table.add(
        name,
        duration(timing.seconds),
        " to ".join(map(duration, timing.spread)),
        timing.passes,
        duration(timing.start),
        duration(rates.overhead),
        *(amount(x) for x in (rates.paths, rates.photon_rays, rates.eye_rays, rates.pairs)),
        amount(moved, "B"),
        amount(moved / watch.seconds if watch.seconds else 0.0, "B/s"),
        amount(watch.to_host, "B"),
        amount(watch.to_device, "B"),
    )


def _work_notes(table: Table, work: Work, device: Device) -> None:
    table.note(
        f"a pass has {amount(work.rays[PHOTONS])} photon rays; {amount(work.rays[EYE])} eye, mirror"
        f" and shadow rays; {amount(work.deposits)} deposits; {amount(work.gather_pairs)} pairs of"
        " a photon and a visible point that it adds to,"
        f" {amount(work.splat_pairs)} of them of the camera's own points, which alone are splatted"
    )
    table.note(
        "kernels by the clock, OpenGL waited for around each"
        if device.is_software
        else "kernels by timer queries of OpenGL"
    )
    table.note(
        "start: building the renderer and its first pass; no kernel: of a pass, what no kernel"
        " runs; streams: bytes at kernels' ports, tables not counted"
    )


def _kernel_table(report: Report, title: str, timings: Mapping[str, Timing]) -> None:
    most: dict[tuple[str, str], float] = {}
    for timing in timings.values():
        assert timing.watch
        for place, spent in timing.watch.spent.items():
            most[place] = max(most.get(place, 0.0), spent.seconds)
    names = sorted(most, key=lambda place: (place[0] != PHOTONS, place[0] == EYE, -most[place]))
    table = report.table(title, "kernel (launches)", *timings)
    for part, stem in names:
        cells, launches = [], set()
        for timing in timings.values():
            assert timing.watch
            spent = timing.watch.of(stem, part)
            if spent.launches:
                launches.add(spent.launches)
            cells.append(duration(spent.seconds) if spent.launches else "-")
        if launches:
            table.add(f"{part}: {stem} ({'-'.join(map(str, sorted(launches)))})", *cells)


def timing_data(timing: Timing, work: Work) -> dict[str, Any]:
    """A timing as JSON."""
    watch, rates = timing.watch, rates_of(timing, work)
    assert watch
    return {
        "way": str(timing.way),
        "pass [s]": timing.seconds,
        "least [s]": timing.spread[0],
        "most [s]": timing.spread[1],
        "passes": timing.passes,
        "start [s]": timing.start,
        "phases [s]": timing.phases,
        "rates [1/s]": _without(asdict(rates), "overhead"),
        "overhead [s]": rates.overhead,
        "to host [B]": watch.to_host,
        "to device [B]": watch.to_device,
        "kernels": {
            f"{part}: {stem}": asdict(spent) for (part, stem), spent in watch.spent.items()
        },
        "work": asdict(work),
    }


def _without(data: dict[str, Any], name: str) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key != name}
