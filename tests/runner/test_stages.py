"""The sessions of a run collect what the project's own configuration names."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runner import job, stages


def test_options_are_not_taken_for_places(tmp_path: Path) -> None:
    """pytest looks for its configuration near every word that may be a place, in the processes of
    pytest-xdist too, where the file of results is there already."""
    project, run = tmp_path / "project", tmp_path / "run"
    for folder in (project / "named", project / "other", run):
        folder.mkdir(parents=True)
    ini = "[pytest]\naddopts = -p no:hypothesispytest\ntestpaths = named\n"
    (project / "pytest.ini").write_text(ini, encoding="utf-8")
    for name in ("named", "other"):
        file = project / name / f"test_{name}.py"
        file.write_text("def test_it():\n    pass\n", encoding="utf-8")
    options = (*stages.at_once(2), "--current=packages,peers")
    done = job.run(stages.pytest_job("some", run, options, folder=project))
    assert [one.test for one in done.results] == ["named/test_named.py::test_it"]


@pytest.mark.parametrize("place", ["tests/no_such_folder", "tests/no.py::test_x"])
def test_place_that_is_not_there_ends_the_run(
    place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        stages.check_places(["tests/runner", "-k", "merge or x", place])
    assert ended.value.code == 2
    assert place.split("::", 1)[0] in capsys.readouterr().err


def test_places_that_are_there_and_options_are_taken() -> None:
    stages.check_places(["tests/runner", "-k", "merge", f"{__file__}::test_x", "--x=a/b"])
