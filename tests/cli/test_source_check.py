"""A source folder is refused by its own tests for what `payload build` and hosts refuse."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from nondum.cli.source_check import check
from nondum.wheelhouse.build.scaffold import new_package

PLUGIN, DOMAIN = "nondum_{}/plugin.py", "nondum_{}/domain.pddl"
NUMBERS = itertools.count()
OTHERS = """
[[component]]
id = "other"
distribution = "third-party"
"""


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new package, of a name that no other test has imported."""
    name = f"lamp{next(NUMBERS)}"
    folder = new_package(name, tmp_path / name).folder
    monkeypatch.syspath_prepend(folder)
    return folder


def change(source: Path, file: str, old: str, new: str) -> None:
    path = source / file.format(source.name)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def append(source: Path, file: str, text: str) -> None:
    with (source / file).open("a") as opened:
        opened.write(text)


def codes(source: Path) -> list[str]:
    return [problem.code for problem in check(source)]


WRONG: dict[str, tuple[str, Callable[[Path], None]]] = {
    "fragment": ("PDDL_UNKNOWN", lambda s: change(s, DOMAIN, ":effect (lit", ":effect (litt")),
    "phrase": ("PHRASE_INVALID", lambda s: change(s, PLUGIN, "(lit self)", "(litt self)")),
    "manifest": ("MANIFEST_KEY", lambda s: change(s, "payload.toml", "summary", "sumary")),
    "device": (
        "DEVICE_RULES",
        lambda s: change(
            s,
            "payload.toml",
            "# A device",
            '[[component.device]]\nname = "relay"\nmatch = { subsystem = "tty" }\n#',
        ),
    ),
    "plugin": ("BEHAVIOUR_PARAMETERS", lambda s: change(s, PLUGIN, "u: str, h: str", "h: str")),
    "import": ("IMPORT_FAILED", lambda s: change(s, PLUGIN, '"""A lamp', 'import no_such\n"""')),
    "entry point": (
        "IMPORT_FAILED",
        lambda s: change(s, "pyproject.toml", f"nondum_{s.name}.plugin", "no_such"),
    ),
    "goals": ("GOAL_FILE", lambda s: append(s, "goal.txt", "")),
    "no TOML": ("BUILD_FAILED", lambda s: append(s, "pyproject.toml", "[")),
    "distribution": (
        "ENTRY_POINT",
        lambda s: append(s, "payload.toml", OTHERS),
    ),
}


@pytest.mark.parametrize(("code", "spoil"), WRONG.values(), ids=WRONG)
def test_what_hosts_would_refuse_is_told(
    source: Path, code: str, spoil: Callable[[Path], None]
) -> None:
    spoil(source)
    assert codes(source) == [code]


def test_new_source_has_no_problems(source: Path) -> None:
    assert codes(source) == []


def test_places_have_the_version_of_the_project_though_it_is_not_installed(source: Path) -> None:
    WRONG["fragment"][1](source)
    change(source, "pyproject.toml", 'version = "0.1.0"', 'version = "3.7"')
    (problem,) = check(source)
    assert " 3.7 " in f"{problem.where} {problem.message}"


def test_all_components_are_told_at_once(source: Path) -> None:
    change(source, PLUGIN, "u: str, h: str", "h: str")
    append(source, "payload.toml", OTHERS)
    assert codes(source) == ["BEHAVIOUR_PARAMETERS", "ENTRY_POINT"]


def test_an_installed_distribution_may_have_the_plugin(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = tmp_path / "third_party-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: third-party\nVersion: 1\n")
    points = f"[nondum.plugins]\nother = nondum_{source.name}.plugin\n"
    (info / "entry_points.txt").write_text(points)
    monkeypatch.syspath_prepend(tmp_path)
    change(
        source, "payload.toml", f'distribution = "{source.name}"', 'distribution = "third-party"'
    )
    assert codes(source) == []
