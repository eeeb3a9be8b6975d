# SPDX-License-Identifier: GPL-3.0-or-later
"""Show a picture's illuminance in false colours: `python build.py lux PICTURE.exr`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import PhotonStreamError, RenderError
from ..film.false_colour import false_colour
from ..film.picture_file import check_writable, encode_png

CHANNEL = ".Illuminance.X"


def main(argv: list[str] | None = None) -> int:
    """Exit status: 0 with a picture, 1 without."""
    parser = argparse.ArgumentParser(prog="build.py lux", description=__doc__)
    parser.add_argument("picture", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--most", type=float)
    arguments = parser.parse_args(argv)
    output = arguments.output or Path(arguments.picture.stem + "_lux.png")
    try:
        if arguments.most is not None and not 0.0 < arguments.most < 1e30:
            raise RenderError(f"--most {arguments.most} is no illuminance")
        check_writable(output)
        if output.suffix.lower() != ".png":
            raise RenderError(f"{output}: the name must end in .png")
        lux = illuminance(arguments.picture)
        picture = false_colour(lux[::-1], arguments.most)
        output.write_bytes(encode_png(np.ascontiguousarray(picture[::-1])))
    except (PhotonStreamError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    lit = lux[lux > 0.0]
    mean = float(lit.mean()) if len(lit) else 0.0
    print(f"wrote {output}: {mean:.1f} lx in the mean where light falls, {lux.max():.1f} at most")
    return 0


def illuminance(path: Path) -> NDArray[np.float32]:
    """The pass of an OpenEXR file, (h, w) [lx], row 0 at the top; RenderError if it has none."""
    import OpenEXR  # as picture_file.py

    if not path.is_file():
        raise RenderError(f"{path}: no such file")
    try:
        file = OpenEXR.File(str(path), separate_channels=True)
        parts = [part.channels for part in file.parts]
    except Exception as error:  # it raises whatever the file's damage leads to
        raise RenderError(f"{path}: not an OpenEXR picture ({error})") from error
    for channels in parts:
        for name, channel in channels.items():
            if name.endswith(CHANNEL):
                return np.asarray(channel.pixels, np.float32)
    raise RenderError(f"{path}: has no Illuminance pass; render it with --illuminance")


if __name__ == "__main__":
    sys.exit(main())
