"""The sessions of a run collect what the project's own configuration names."""

from __future__ import annotations

from pathlib import Path

from tests.runner import job, stages


def test_options_are_not_taken_for_places(tmp_path: Path) -> None:
    """pytest looks for its configuration near every word that may be a place, in the processes of
    pytest-xdist too, where the file of results is there already."""
    project, run = tmp_path / "project", tmp_path / "run"
    for folder in (project / "named", project / "other", run):
        folder.mkdir(parents=True)
    (project / "pytest.ini").write_text("[pytest]\ntestpaths = named\n", encoding="utf-8")
    for name in ("named", "other"):
        file = project / name / f"test_{name}.py"
        file.write_text("def test_it():\n    pass\n", encoding="utf-8")
    options = (*stages.at_once(2), "--current=packages,peers")
    done = job.run(stages.pytest_job("some", run, options, folder=project))
    assert [one.test for one in done.results] == ["named/test_named.py::test_it"]
