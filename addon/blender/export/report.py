# SPDX-License-Identifier: GPL-3.0-or-later
"""What became of every part of the Blender scene: rendered exactly, approximated, or ignored."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

MATERIAL = "Material '"  # how their names begin in entries
Status = Literal["exact", "approximated", "ignored"]


@dataclass(frozen=True)
class Entry:
    """One sentence of the report, about one feature of one object."""

    object: str  # what the user sees in Blender, e.g. "Material 'Glass'"
    feature: str  # e.g. "Roughness"
    status: Status
    detail: str = ""

    def __str__(self) -> str:
        text = f"{self.status}: {self.object}: {self.feature}"
        return f"{text}: {self.detail}" if self.detail else text


@dataclass(frozen=True)
class Report:
    """All entries of one export, in the order in which they were found, and loose warnings."""

    entries: tuple[Entry, ...] = ()
    warnings: tuple[str, ...] = ()  # what the renderer said about the same scene

    def of(self, status: Status) -> tuple[Entry, ...]:
        return tuple(entry for entry in self.entries if entry.status == status)

    def with_warnings(self, warnings: Iterable[str]) -> Report:
        return replace(self, warnings=self.warnings + tuple(warnings))

    def joined(self, other: Report) -> Report:
        """Return both reports, as of two view layers of a scene, without repetitions."""
        return Report(
            tuple(dict.fromkeys(self.entries + other.entries)),
            tuple(dict.fromkeys(self.warnings + other.warnings)),
        )

    @property
    def summary(self) -> str:
        """One line for a status bar: how many materials are rendered as they are, and how many
        entries there are of each status."""
        counts = ", ".join(
            f"{len(self.of(status))} {status}" for status in ("exact", "approximated", "ignored")
        )
        if self.warnings:
            counts += f", {len(self.warnings)} warnings"
        materials = {x.object for x in self.entries if x.object.startswith(MATERIAL)}
        if not materials:
            return counts
        exact = len(materials - {x.object for x in self.entries if x.status != "exact"})
        return f"{exact} of {len(materials)} materials exact; {counts}"

    def lines(self) -> list[str]:
        """What the console says: everything that is not exactly what the scene asks for.

        Warnings are not among them, because Blender prints those itself.
        """
        return [str(entry) for entry in self.entries if entry.status != "exact"]

    def as_json(self) -> str:
        """The whole report as JSON text."""
        data = {
            "summary": self.summary,
            "entries": [vars(entry) for entry in self.entries],
            "warnings": list(self.warnings),
        }
        return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


@dataclass
class Notes:
    """The report while it is being written; an entry that repeats is kept once."""

    _entries: dict[Entry, None] = field(default_factory=dict)
    _objects: set[str] = field(default_factory=set)

    def exact(self, object: str, feature: str, detail: str = "") -> None:
        self._add(Entry(object, feature, "exact", detail))

    def approximated(self, object: str, feature: str, detail: str) -> None:
        self._add(Entry(object, feature, "approximated", detail))

    def ignored(self, object: str, feature: str, detail: str = "") -> None:
        self._add(Entry(object, feature, "ignored", detail))

    def mentions(self, object: str) -> bool:
        """Whether anything was written about `object` so far."""
        return object in self._objects

    def _add(self, entry: Entry) -> None:
        self._entries[entry] = None
        self._objects.add(entry.object)

    def finish(self) -> Report:
        return Report(tuple(self._entries))
