# SPDX-License-Identifier: GPL-3.0-or-later
"""The READMEs say what is so: code and commands run, links, files, options and names exist.

README.md is for users, addon/photon/README.md for developers, tests/bench/README.md is the ledger
of measurements.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from addon.streams import Device
from tests.scenes import cornell

ROOT = Path(__file__).resolve().parents[1]
LEDGER = "tests/bench/README.md"
HOW_IT_WORKS = "addon/photon/README.md"
READMES = ("README.md", HOW_IT_WORKS, LEDGER)
TEXTS = {name: (ROOT / name).read_text(encoding="utf-8") for name in READMES}
README = TEXTS["README.md"]
MOST_LINES = 200
# What the READMEs name and commands write: it is not in the repository.
WRITTEN = {"bench.md", "bench.json", "bench.svg", "chart/chart.html"}
KINDS = "blend|exr|glsl|html|json|md|npz|png|py|rs|svg|toml|zip"
PLACEHOLDER = re.compile(r"[A-Z]+\b")  # FILE.exr, SCENE.blend
BENCHES = {"bench": "tests.bench.speed", "chart": "tests.bench.chart"}  # after build.py's `--`


def package_file() -> str:
    """What `build.py package` writes, by pyproject.toml's version."""
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (version,) = re.findall(r'^version = "(.*)"', project, re.M)
    return f"dist/photon_stream-{version}.zip"


def code(text: str) -> list[str]:
    """Lines of blocks but Python's, and spans, each on one line and without continuations."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S)
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    lines = [re.sub(r"\n +", " ", block) for kind, block in blocks if kind != "python"]
    spans = [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", rest)]
    return [*(line for block in lines for line in block.splitlines()), *spans]


def named_files(text: str) -> set[str]:
    """Files and folders that a README names in code: words with a slash or a known ending."""
    words = [word for line in code(text) for word in line.split()]
    ended = re.compile(rf"[\w./-]+\.({KINDS})")
    files = {word for word in words if ended.fullmatch(word)}
    files |= {word for word in words if re.fullmatch(r"\.?\w[\w.-]*(/[\w.-]+)+/?", word)}
    return {word for word in files if not PLACEHOLDER.match(word)}


def links(text: str) -> list[str]:
    """Where links and pictures lead, but for the web."""
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return [to for to in re.findall(r"\]\(\s*(\S+?)\s*\)", rest) if "://" not in to]


def anchors(text: str) -> set[str]:
    """What the headings are called in links."""
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    heads = re.findall(r"^#+ (.*)$", rest, re.M)
    return {re.sub(r"[^\w -]", "", head).strip().lower().replace(" ", "-") for head in heads}


def commands(text: str) -> set[str]:
    """The command lines that a README shows whole: `python build.py ...`, `python -m ...`."""
    return {line for line in code(text) if line.startswith(("python build.py", "python -m"))}


COMMANDS = sorted({line for text in TEXTS.values() for line in commands(text)})


@cache
def options_of(*command: str) -> set[str]:
    """The options in a command's `--help`, which has to be answered."""
    result = subprocess.run(
        [sys.executable, *command, "--help"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(re.findall(r"(?<![\w-])-{1,2}[a-z][a-z-]*", result.stdout))


def shown_options(line: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])-{1,2}[a-z][a-z-]*", line))


def test_is_short() -> None:
    assert len(README.splitlines()) <= MOST_LINES


def test_python_example(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The example of "From scripts", with a small picture instead of its large one."""
    (example,) = re.findall(r"```python\n(.*?)```", README, re.S)
    small = example.replace("width=512, height=512, passes=16", "width=16, height=16, passes=2")
    assert small != example
    cornell().save(tmp_path / "scene.npz")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(small, names)
    images = names["images"]
    assert isinstance(images, dict) and images["Combined"].shape == (16, 16, 4)
    renderer = names["renderer"]
    renderer.release()  # type: ignore[attr-defined]
    renderer.device.release()  # type: ignore[attr-defined]


def test_reads_what_it_has_to() -> None:
    """Links, files, commands and names are found in every form that the READMEs have."""
    text = (
        "`a/b.py` and `python -m tests.x FILE.npz --size\n  8`, ![p](c/d.png) [e](f.md#g-h)\n"
        "## G: `h`\n```\npython build.py render e.blend [--seed N]\n    [--width N]\n```\n"
        "```python\nScene.load('s.npz')\n```\n`dist/i.zip` `glsl/lib` `splat = gather` `1/2`\n"
    )
    assert named_files(text) == {"a/b.py", "build.py", "e.blend", "dist/i.zip", "glsl/lib", "1/2"}
    assert links(text) == ["c/d.png", "f.md#g-h"] and anchors(text) == {"g-h"}
    render = "python build.py render e.blend [--seed N] [--width N]"
    assert commands(text) == {render, "python -m tests.x FILE.npz --size 8"}
    assert shown_options(render) == {"--seed", "--width"}


@pytest.mark.parametrize("name", READMES)
def test_links_lead_somewhere(name: str) -> None:
    """Links, pictures among them, lead from the README to a file, and to a heading of it."""
    wrong = []
    for link in links(TEXTS[name]):
        path, _, heading = link.partition("#")
        file = ((ROOT / name).parent / path).resolve() if path else ROOT / name
        known = file.exists() and file.is_relative_to(ROOT)
        if not known or (heading and heading not in anchors(file.read_text(encoding="utf-8"))):
            wrong.append(link)
    assert links(TEXTS[name]) and wrong == []


@pytest.mark.parametrize("name", READMES)
def test_named_files_exist(name: str) -> None:
    """Files and folders in code are those of the repository, from its root."""
    files = named_files(TEXTS[name])
    assert files
    assert [x for x in files - WRITTEN - {package_file()} if not (ROOT / x).exists()] == []


def test_table_of_folders_is_complete() -> None:
    """Each folder of the renderer's code has a row, and each row a folder."""
    section = TEXTS[HOW_IT_WORKS].split("## The folders\n")[1].split("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`([^`]+)`", row)}
    there = {
        str(file.parent.relative_to(ROOT))
        for top, kind in (("addon", "py"), ("glsl", "glsl"))
        for file in (ROOT / top).rglob(f"*.{kind}")
    }
    assert there - {"addon"} <= named and all((ROOT / name).is_dir() for name in named)


def test_written_files_are_named() -> None:
    """No file passes for a written one that no README names any more."""
    named = {word for text in TEXTS.values() for line in code(text) for word in line.split()}
    assert [x for x in {*WRITTEN, package_file()} if x not in named] == []


@pytest.mark.parametrize("line", COMMANDS)
def test_commands_exist(line: str) -> None:
    """Every command that is shown whole answers, and knows the options that are shown."""
    ours, _, theirs = line.partition(" -- ")
    words = ours.split()
    if words[1] == "-m":
        assert shown_options(ours) - {"-m"} <= options_of("-m", words[2])
        return
    assert shown_options(ours) <= options_of(*words[1:3])
    if words[2] in BENCHES and theirs:
        assert shown_options(theirs) <= options_of("-m", BENCHES[words[2]])
    elif theirs:
        assert words[2] == "test" and shown_options(theirs) <= options_of("-m", "pytest")


def test_options_exist() -> None:
    """Every option that is shown, alone or in a command, is one of some command."""
    build = [("build.py", name) for name in ("render", "test", "chart", "bench")]
    modules = [*BENCHES.values(), "tests.bench.race", "tests.bench.scale"]
    modules.append("addon.photon.check_shaders")
    known = set().union(*(options_of(*words) for words in build))
    known = known.union(*(options_of("-m", module) for module in modules))
    for name, text in TEXTS.items():
        shown = {option for line in code(text) for option in shown_options(line)}
        assert {option for option in shown if option.startswith("--")} - known == set(), name


def test_settings_have_their_names() -> None:
    """The settings table names settings as Blender's panels do."""
    properties = (ROOT / "addon/blender/properties.py").read_text(encoding="utf-8")
    table = README.split("| setting | means |")[1].split("\n\n")[0]
    rows = re.findall(r"^\| ([A-Z][^|]*?) \|", table, re.M)
    names = [name for row in rows for name in row.split(", ")]
    assert len(names) > 10 and [name for name in names if f'"{name}"' not in properties] == []


def test_classes_have_their_names() -> None:
    """How it works names classes of the renderer and its framework: those of the frame, and those
    in code elsewhere."""
    files = [x for room in ("photon", "streams") for x in (ROOT / "addon" / room).rglob("*.py")]
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in files]
    classes = {x.name for tree in trees for x in ast.walk(tree) if isinstance(x, ast.ClassDef)}
    lines = [line for line in code(TEXTS[HOW_IT_WORKS]) if "/" not in line]
    names = {name for line in lines for name in re.findall(r"\b[A-Z][a-z]\w*", line)}
    assert len(names) > 20 and names - classes == set()


def test_figures_are_those_of_the_ledger() -> None:
    """The README's one table of figures has the ledger's, not rounded differently."""

    def table(text: str) -> dict[tuple[str, str], str]:
        """Cells by the heads of row and column."""
        (found,) = re.findall(r"^(\| seconds to (?:strict )?relMSE .*?)\n\n", text, re.M | re.S)
        heads, _, *rows = ([x.strip() for x in row.split("|")[1:-1]] for row in found.splitlines())
        return {
            (row[0], head): cell
            for row in rows
            for head, cell in zip(heads[1:], row[1:], strict=True)
        }

    ours, ledger = table(README), table(TEXTS[LEDGER])
    assert len(ours) > 20 and ours.items() <= ledger.items()
