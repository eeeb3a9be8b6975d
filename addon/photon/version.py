# SPDX-License-Identifier: GPL-3.0-or-later
"""The version that pictures say they were made with."""

import tomllib
from pathlib import Path

_MANIFEST = Path(__file__).resolve().parents[1] / "blender_manifest.toml"
VERSION: str = tomllib.loads(_MANIFEST.read_text(encoding="utf-8"))["version"]
