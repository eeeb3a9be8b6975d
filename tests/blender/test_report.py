# SPDX-License-Identifier: GPL-3.0-or-later
"""The report counts, repeats nothing and reads as JSON."""

from __future__ import annotations

import json

import pytest

from addon.blender.export.report import Notes

pytestmark = pytest.mark.blender


def test_report() -> None:
    notes = Notes()
    notes.exact("Light 'Spot'", "Spot light")
    notes.ignored("Light 'Sun'", "Sun light", "not simulated")
    notes.ignored("Light 'Sun'", "Sun light", "not simulated")
    report = notes.finish().with_warnings(["2 triangles skipped"])
    assert report.summary == "1 exact, 0 approximated, 1 ignored, 1 warnings"
    assert report.lines() == ["ignored: Light 'Sun': Sun light: not simulated"]
    data = json.loads(report.as_json())
    assert data["entries"][1] == {
        "object": "Light 'Sun'",
        "feature": "Sun light",
        "status": "ignored",
        "detail": "not simulated",
    }
    assert data["warnings"] == ["2 triangles skipped"]
    assert report.joined(report) == report


def test_head_counts_materials() -> None:
    notes = Notes()
    notes.exact("Material 'A'", "Shader")
    notes.exact("Material 'B'", "Shader")
    notes.approximated("Material 'B'", "Bevel", "edges are sharp")
    notes.ignored("Material 'C'", "Volume", "not rendered")
    assert notes.finish().summary == ("1 of 3 materials exact; 2 exact, 1 approximated, 1 ignored")
