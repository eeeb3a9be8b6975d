# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart as one self-contained HTML page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from addon.photon.film.picture_file import encode_png

from .results import SceneResult, Table, equal_error, equal_time, where_time_goes
from .scenes import CROP, CROPS
from .svg import figure

GREY = 0.2  # what the mean of a reference is shown as, before the sRGB curve
STRONG = 0.25  # relative difference that is shown in full red or blue
STYLE = """
body { font-family: sans-serif; max-width: 76em; margin: auto; padding: 1em; line-height: 1.4 }
td, th { padding: .15em .7em; text-align: right; border-bottom: 1px solid #ddd }
td:first-child, th:first-child { text-align: left }
table { border-collapse: collapse; margin: .8em 0; font-size: 90% }
figure { display: inline-block; margin: .3em; font-size: 80% }
figcaption { max-width: 15em }
img { image-rendering: pixelated; width: 15em; display: block }
.notes { font-size: 85%; color: #444 }
"""
SECONDS = """
<h2>What is in the seconds</h2>
<ul>
<li>Photon Stream: its photons, radii and passes, until OpenGL is done. Not: start-up, export, the
BVH, compiling programs, making the picture of the sums. With Denoise, that and the denoising are in
it.</li>
<li>Cycles: what it calls render time itself (a stamp of 10 ms resolution). Not: start-up, loading
kernels, its synchronization of the scene. With OpenImageDenoise, the denoising is in it, loading
the denoiser is not.</li>
<li>Mitsuba: rendering, in launches of at most 16 samples a pixel (64 on a GPU), pictures of fewer
anew in one. Not: start-up, converting the scene, its BVH, compiling kernels; each is run
before.</li>
<li>LuxCore: wall time since its session started, less that of starting one which renders nothing
(BVH, threads). PhotonGI's photon maps are in it.</li>
<li>Seconds of less than half a second are medians of up to five climbs, of every contender, without
looking at pictures, after one that warms up.</li>
</ul>
<h2>What is measured</h2>
<ul>
<li>Strict relMSE: squared error over r&sup2; + (0.1 r&#772;)&sup2; of the reference r and its mean
r&#772;, averaged over pixels and channels. The lenient one has the larger of r and r&#772;,
squared, below instead: it hides what is darker than the mean. References come in two halves A and B
of independent noise; the mean of (x - A)(x - B) has no bias from it but by what r is off, squared.
The standard error is from the scatter of 16x16 blocks; points of less than two
standard errors are left out of curves, slopes and ratios.</li>
<li>HDR-FLIP: NVIDIA's flip-evaluator against the mean of A and B, whose own noise is in it.</li>
<li>The edge band is what lies within 3 pixels of a discontinuity of depth or normal, as the camera
sees them (not in mirrors); the interior is the rest.</li>
<li>Slope: fitted exponent of strict relMSE against seconds. 1/(MSE t): of the last point.</li>
<li>In brackets: how many times as long as ours. "&gt;" means not reached within the budget, after
so many seconds; "~" what the slope of the last three points leads to, where it has not levelled
off.</li>
</ul>
"""


def page(head: Sequence[str], verdicts: Sequence[str], scenes: Sequence[SceneResult]) -> str:
    """The whole chart; `head` are lines about the run."""
    lines = "".join(f"<li>{escape(line)}</li>" for line in head)
    promises = "".join(f"<li>{escape(line)}</li>" for line in verdicts)
    body = [
        "<h1>Photon Stream: error against time</h1>",
        f"<ul>{lines}</ul><h2>Promises</h2><ul>{promises}</ul>",
        *(_scene(scene) for scene in scenes),
        SECONDS,
    ]
    title = "<meta charset=utf-8><title>Photon Stream: error against time</title>"
    return f"<!doctype html>{title}<style>{STYLE}</style>{''.join(body)}"


def curves_figure(scene: SceneResult) -> str:
    """Strict relMSE against seconds, as SVG."""
    curves = {
        name: [(p.seconds, p.error.value) for p in points if p.error.resolved]
        for name, points in scene.curves.items()
    }
    return figure(scene.name, "strict relMSE", curves)


def _scene(scene: SceneResult) -> str:
    flips = {
        name: [(p.seconds, p.flip) for p in points if p.flip > 0]
        for name, points in scene.curves.items()
    }
    refused = "".join(
        f"<li>{escape(name)} is not here: {escape(why)}</li>" for name, why in scene.refused.items()
    )
    where = escape(where_time_goes(scene)) if scene.where else "no pass was rendered"
    return (
        f"<h2>{escape(scene.name)}</h2>{curves_figure(scene)}"
        f"{figure(scene.name, 'mean HDR-FLIP', flips)}"
        f"{_table(equal_error(scene))}{_table(equal_time(scene))}{_crops(scene)}"
        f'<ul class="notes">{refused}<li>Where our time goes: {where}</li>'
        f"<li>Reference: {escape(scene.notes)}; variance of a half, relative: "
        f"{scene.half_noise:.1e}</li></ul>"
    )


def _table(table: Table) -> str:
    titles, rows = table
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _crops(scene: SceneResult) -> str:
    """The whole reference, and a part of each contender's picture after the same time."""
    x, y = CROPS[scene.name]
    part = np.s_[y : y + CROP, x : x + CROP]
    exposure = GREY / scene.reference.mean()
    parts = [
        _image(shown(scene.reference * exposure)[::-1], "reference"),
        _image(shown(scene.reference[part] * exposure)[::-1], "reference, part"),
    ]
    for name, index in scene.at_equal_time().items():
        picture = scene.pictures[name][index]
        halves = (shown(picture * exposure)[part], difference(picture, scene.reference)[part])
        caption = f"{name}, {scene.curves[name][index].seconds:.2f} s; below: difference, ±"
        both = np.concatenate([half[::-1] for half in halves])
        parts.append(_image(both, f"{caption}{STRONG:.0%}"))
    return "<div>" + "".join(parts) + "</div>"


def shown(linear: Any) -> Any:
    """sRGB bytes of linear RGB."""
    x = np.clip(linear, 0.0, 1.0)
    encoded = np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055)
    return (encoded * 255 + 0.5).astype(np.uint8)


def difference(picture: Any, reference: Any) -> Any:
    """Bytes: white where they are equal, red where the picture is too bright, blue too dark."""
    floor = np.maximum(reference, reference.mean())
    x = np.clip(((picture - reference) / floor).mean(axis=2) / STRONG, -1.0, 1.0)
    colours = np.stack([1 - np.maximum(-x, 0), 1 - np.abs(x), 1 - np.maximum(x, 0)], axis=-1)
    return (colours * 255 + 0.5).astype(np.uint8)


def _image(pixels: Any, caption: str) -> str:
    """`pixels` has row 0 at the top."""
    data = base64.b64encode(encode_png(np.ascontiguousarray(pixels))).decode()
    return (
        f'<figure><img src="data:image/png;base64,{data}"><figcaption>{escape(caption)}'
        "</figcaption></figure>"
    )
