"""A new package is complete: it passes its own tests, lint and types, and becomes a payload."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.kit.payloads import SDK

from nondum.sdk.errors import ConfigRefused
from nondum.wheelhouse.build import build
from nondum.wheelhouse.build.scaffold import NewPackage, build_command, new_package
from nondum.wheelhouse.build.verification import verify
from nondum.wheelhouse.format import manifest
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.payload import host_facts


@pytest.fixture
def made(tmp_path: Path) -> NewPackage:
    return new_package("window-opener", tmp_path / "window-opener")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(SDK), *sys.path])
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "PYTEST_ADDOPTS": "-p no:cacheprovider"},
        capture_output=True,
        text=True,
        check=False,
    )


def own_tests(made: NewPackage) -> subprocess.CompletedProcess[str]:
    plugins = [] if _sdk_is_installed() else ["-p", "nondum.sdk.testing"]
    return run(made.folder, "pytest", "-q", *plugins)


def test_it_passes_its_own_tests(made: NewPackage) -> None:
    done = own_tests(made)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout


def test_a_typo_in_its_fragment_fails_its_own_tests_with_the_place(made: NewPackage) -> None:
    fragment = made.folder / "nondum_window_opener/domain.pddl"
    text = fragment.read_text().replace(":effect (lit", ":effect (litt")
    fragment.write_text(text)
    line = text[: text.index("(litt")].count("\n") + 1
    column = text.splitlines()[line - 1].index("litt") + 1
    done = own_tests(made)
    assert "1 failed, 2 passed" in done.stdout
    assert f"domain.pddl:{line}:{column}" in done.stdout


def test_it_says_which_files_it_made(made: NewPackage) -> None:
    there = {p.relative_to(made.folder) for p in made.folder.rglob("*") if p.is_file()}
    assert set(made.files) == there
    assert {str(path) for path in there} >= {".gitignore", "pyproject.toml", "payload.toml"}


def test_nothing_of_the_template_shows_through(made: NewPackage) -> None:
    for path in made.files:
        text = (made.folder / path).read_text(encoding="utf-8")
        assert "$" not in text
        assert "$" not in str(path)


def test_its_manifest_is_right(made: NewPackage) -> None:
    said = manifest.parse((made.folder / "payload.toml").read_text(), "payload.toml")
    assert (said.id, said.name) == ("org.example.window-opener", "Window opener")
    assert [c.distribution for c in said.components] == ["window-opener"]


def test_the_id_can_be_chosen(tmp_path: Path) -> None:
    made = new_package("a", tmp_path / "a", payload_id="com.example.tools.a")
    said = manifest.parse((made.folder / "payload.toml").read_text(), "payload.toml")
    assert said.id == "com.example.tools.a"


@pytest.mark.parametrize("name", ["", "A", "9", "a_b", "a--b", "-a", "a-", "a.b", "é", "a" * 64])
def test_odd_names_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigRefused) as refused:
        new_package(name, tmp_path / "made")
    assert refused.value.code == "NAME_INVALID"
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("payload_id", ["nodots", "Org.example", 'org.example"'])
def test_odd_ids_are_refused(tmp_path: Path, payload_id: str) -> None:
    with pytest.raises(ConfigRefused) as refused:
        new_package("a", tmp_path / "a", payload_id=payload_id)
    assert refused.value.code == "NAME_INVALID"


def test_nothing_is_overwritten(made: NewPackage) -> None:
    (made.folder / "payload.toml").write_text("mine")
    with pytest.raises(ConfigRefused) as refused:
        new_package("other", made.folder)
    assert refused.value.code == "FOLDER_NOT_EMPTY"
    assert (made.folder / "payload.toml").read_text() == "mine"


@pytest.mark.slow
def test_it_becomes_a_payload_that_hosts_take(made: NewPackage, tmp_path: Path) -> None:
    """Its build tool and what the SDK depends on come from the package index."""
    options = build.Options(targets=(Target.here(),), libraries=(SDK,))
    told: list[tuple[str, int, int]] = []
    folder = build.build(made.folder, tmp_path / "drive", options, lambda *s: told.append(s))
    facts = host_facts.probe(tmp_path, reserve_mb=0, confinement=Level.NONE)
    assert folder == tmp_path / "drive/nondum/org.example.window-opener"
    assert verify(folder, UnsignedAllowed(), facts).problems == ()
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)
    assert told[-1][1] == told[-1][2]


def _sdk_is_installed() -> bool:
    done = subprocess.run(
        [sys.executable, "-m", "pip", "show", "-q", "nondum-sdk"], capture_output=True, check=False
    )
    return done.returncode == 0


def test_build_is_told_where_the_sources_of_the_sdk_are() -> None:
    folder = SimpleNamespace(editable=True)
    url = "file:///home/me/my%20nondum/plugins/sdk"
    *_, option, library = shlex.split(build_command(SimpleNamespace(url=url, dir_info=folder)))
    assert (option, library) == ("--library", "/home/me/my nondum/plugins/sdk")


@pytest.mark.parametrize(
    "sdk", [None, SimpleNamespace(url="https://example.org/a.whl", archive_info=SimpleNamespace())]
)
def test_build_finds_an_sdk_that_is_a_wheel_by_itself(sdk: object) -> None:
    assert "--library" not in build_command(sdk)
