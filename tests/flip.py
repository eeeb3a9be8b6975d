# SPDX-License-Identifier: GPL-3.0-or-later
"""FLIP: the difference that a viewer sees when flipping between two pictures, 0 to 1.

Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", for low dynamic range,
at 67 pixels a degree. Section and constant names are the paper's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

PIXELS_PER_DEGREE = 67.0
# Contrast sensitivity of the channels Y, Cx, Cz: (a1, b1, a2, b2)
CSF = ((1.0, 0.0047, 0.0, 1e-5), (1.0, 0.0053, 0.0, 1e-5), (34.1, 0.04, 13.5, 0.025))
QC, PC, PT, QF, FEATURE_WIDTH = 0.7, 0.4, 0.95, 0.5, 0.082
RGB_TO_XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = RGB_TO_XYZ.sum(axis=1)


def mean_flip(reference: Any, test: Any) -> float:
    """The mean over pictures (h, w, 3) of linear RGB, each as seen at the reference's exposure."""
    exposure = 0.8 / max(float(np.quantile(reference, 0.98)), 1e-30)
    return float(flip(reference * exposure, test * exposure).mean())


def flip(reference: Any, test: Any) -> NDArray[np.float64]:
    """The difference at each pixel of pictures (h, w, 3) in linear RGB, shown in [0, 1]."""
    a, b = (_opponent(np.clip(np.asarray(x, np.float64), 0, 1)) for x in (reference, test))
    colour = _hyab(_perceived(a), _perceived(b)) ** QC
    green, blue = (_hunt(_lab(np.array([[c]], float))) for c in ((0, 1, 0), (0, 0, 1)))
    largest = float(_hyab(green, blue)[0, 0] ** QC)
    knee = PC * largest
    colour = np.where(
        colour < knee, PT / knee * colour, PT + (colour - knee) / (largest - knee) * (1 - PT)
    )
    edges, points = (
        np.abs(_feature(a[..., 0], kind) - _feature(b[..., 0], kind)) for kind in ("edge", "point")
    )
    feature = (np.maximum(edges, points) / np.sqrt(2.0)) ** QF
    difference: NDArray[np.float64] = colour ** (1 - feature)
    return difference


def _opponent(rgb: Any) -> NDArray[np.float64]:
    """Linear RGB in YCxCz."""
    x, y, z = np.moveaxis(rgb @ RGB_TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def _perceived(ycxcz: Any) -> NDArray[np.float64]:
    """Filtered by contrast sensitivity, in Hunt-adjusted L*a*b*."""
    filtered = np.stack([_blur(ycxcz[..., i], CSF[i]) for i in range(3)], -1)
    y = (filtered[..., 0] + 16) / 116
    xyz = np.stack([y + filtered[..., 1] / 500, y, y - filtered[..., 2] / 200], -1) * WHITE
    return _hunt(_lab(np.clip(xyz @ np.linalg.inv(RGB_TO_XYZ).T, 0, 1)))


def _blur(channel: Any, csf: tuple[float, ...]) -> NDArray[np.float64]:
    a1, b1, a2, b2 = csf
    widest = max(b for _, b, _, d in CSF for b in (b, d))
    reach = int(np.ceil(3 * np.sqrt(widest / (2 * np.pi**2)) * PIXELS_PER_DEGREE))
    x = np.arange(-reach, reach + 1) / PIXELS_PER_DEGREE
    # Each of the two Gaussians is separable.
    parts = [
        (a * np.sqrt(np.pi / b), np.exp(-(np.pi**2) * x**2 / b)) for a, b in ((a1, b1), (a2, b2))
    ]
    total = sum(a * g.sum() ** 2 for a, g in parts)
    return sum(a / total * _separable(channel, g, g) for a, g in parts if a > 0)


def _separable(image: Any, along_x: Any, along_y: Any) -> NDArray[np.float64]:
    """Convolved with both, the border repeated."""
    for axis, weights in ((1, along_x), (0, along_y)):
        reach = len(weights) // 2
        pad = [(0, 0), (0, 0)]
        pad[axis] = (reach, reach)
        padded = np.pad(image, pad, mode="edge")
        image = np.apply_along_axis(np.convolve, axis, padded, weights[::-1], "valid")
    return image


def _feature(y: Any, kind: str) -> NDArray[np.float64]:
    """Strength of edges or points in the achromatic channel."""
    deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE
    reach = int(np.ceil(3 * deviation))
    x = np.arange(-reach, reach + 1)
    gaussian = np.exp(-(x**2) / (2 * deviation**2))
    detector = -x * gaussian if kind == "edge" else (x**2 / deviation**2 - 1) * gaussian
    for sign in (1, -1):
        part = np.sign(detector) == sign
        detector[part] /= np.abs(detector[part]).sum()
    gaussian /= gaussian.sum()
    luminance = (y + 16) / 116
    return np.hypot(
        _separable(luminance, detector, gaussian), _separable(luminance, gaussian, detector)
    )


def _lab(rgb: Any) -> NDArray[np.float64]:
    t = rgb @ RGB_TO_XYZ.T / WHITE
    d = 6 / 29
    x, y, z = np.moveaxis(np.where(t > d**3, np.cbrt(t), t / (3 * d * d) + 4 / 29), -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def _hunt(lab: Any) -> NDArray[np.float64]:
    """Colours are seen less where it is dark."""
    return np.concatenate([lab[..., :1], 0.01 * lab[..., :1] * lab[..., 1:]], -1)


def _hyab(a: Any, b: Any) -> NDArray[np.float64]:
    d = np.abs(a - b)
    return np.asarray(d[..., 0] + np.hypot(d[..., 1], d[..., 2]))
