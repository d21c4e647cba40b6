"""What the SDK does to have a source folder checked: it asks those who are installed."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from nondum.sdk.bench import WorkerFactory
from nondum.sdk.errors import PayloadRefused
from nondum.sdk.source_check import check, source_folder


def refused(folder: Path) -> list[str]:
    with pytest.raises(PayloadRefused) as found:
        check(folder)
    return [problem.code for problem in found.value.problems]


def install(site_packages: Path, monkeypatch: pytest.MonkeyPatch, **modules: str) -> None:
    """Distributions, each with a check, in place of all that are installed."""
    for name, text in modules.items():
        (site_packages / f"{name}.py").write_text(text)
        info = site_packages / f"{name}-1.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
        (info / "entry_points.txt").write_text(f"[nondum.checks]\nit = {name}:check\n")
    monkeypatch.setattr(sys, "path", [str(site_packages)])


def test_without_anybody_who_can_check_it_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, monkeypatch)
    assert refused(tmp_path) == ["CHECK_MISSING"]


def test_what_all_of_them_find_is_told_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = (
        "from nondum.sdk.errors import Problem\n"
        "def check(folder): return [Problem(folder.name.upper(), __name__)]\n"
    )
    install(tmp_path, monkeypatch, first_check=found, second_check=found)
    folder = tmp_path / "sources"
    folder.mkdir()
    assert refused(folder) == ["SOURCES", "SOURCES"]


def test_source_without_findings_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch, content_check="def check(folder): return []\n")
    check(tmp_path)


def test_the_source_folder_is_the_nearest_with_a_manifest(tmp_path: Path) -> None:
    tests = tmp_path / "outer/inner/tests"
    tests.mkdir(parents=True)
    for folder in (tmp_path / "outer", tmp_path / "outer/inner"):
        (folder / "payload.toml").touch()
    assert source_folder(tests / "test_it.py") == tmp_path / "outer/inner"
    assert source_folder(tmp_path / "test_it.py") == tmp_path


def test_a_folder_that_is_no_source_is_told_by_the_bench(
    worker: WorkerFactory, tmp_path: Path
) -> None:
    with pytest.raises(PayloadRefused) as found:
        worker.check(tmp_path)
    assert found.value.code == "SOURCE_INCOMPLETE"
