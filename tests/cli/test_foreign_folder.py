"""Commands in a stranger's folder: modules that lie there are not run, by no process of nondum."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit.command_line import clean_environment
from tests.kit.payloads import installed_wheel, make_wheel, sdk_wheel
from tests.kit.running_host import COMMAND, running
from tests.kit.until import PATIENCE_S
from tests.wheelhouse.sources import make_source

NONDUM = COMMAND[0]
"""The installed command: `python -m` would itself look into the current folder."""
OTHERS = ("click", "isal", "lark", "msgpack", "packaging", "pip", "pluggy", "py_trees", "zmq")
DOMAIN = """(define (domain roads)
  (:predicates (at ?x) (road ?x ?y))
  (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
    :effect (and (at ?y) (not (at ?x)))))
"""
PROBLEM = """(define (problem map) (:domain roads)
  (:objects a b) (:init (at a) (road a b)) (:goal (at b)))
"""
NOTING = "with open({notes!r}, 'a') as file:\n    file.write('{name} ')\n"
NAMES = sorted({*sys.stdlib_module_names, *OTHERS, "nondum/host/__init__", "nondum/sdk/__init__"})


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """A folder with a module for every name that nondum imports; each notes that it was run."""
    folder = tmp_path / "foreign"
    for name in NAMES:
        path = folder / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(NOTING.format(name=name, notes=str(ran(folder))))
    return folder


def ran(foreign: Path) -> Path:
    """Where the folder's modules note that they were run."""
    return foreign.parent / "ran"


def run_there(foreign: Path, *words: str | Path) -> None:
    """Run the command in the folder, to its end."""
    done = subprocess.run(
        [NONDUM, *words],
        cwd=foreign,
        capture_output=True,
        text=True,
        env=clean_environment(),
        timeout=PATIENCE_S,
        check=False,
    )
    notes = ran(foreign)
    assert not notes.exists(), notes.read_text()
    assert done.returncode == 0, done.stderr


def test_modules_there_do_what_they_are_for(foreign: Path) -> None:
    """What the other tests miss is there to be run."""
    subprocess.run([sys.executable, "-c", "import msgpack"], cwd=foreign, check=True)
    assert ran(foreign).read_text() == "msgpack "


def test_planning_runs_nothing_that_lies_there(foreign: Path) -> None:
    (foreign / "domain.pddl").write_text(DOMAIN)
    (foreign / "problem.pddl").write_text(PROBLEM)
    run_there(foreign, "pddl", "plan", "domain.pddl", "problem.pddl")


def test_building_runs_nothing_that_lies_there(foreign: Path, tmp_path: Path) -> None:
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    for wheel in (sdk_wheel(), installed_wheel("pluggy")):
        (wheels / wheel.name).write_bytes(wheel.read_bytes())
    make_wheel(wheels, "msgpack", "1.2.0", {"msgpack/__init__.py": ""})
    source, drive = make_source(tmp_path / "blinker"), tmp_path / "drive"
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    words = ("-o", drive, "--offline", "--wheels", wheels, "--python", python)
    run_there(foreign, "payload", "build", source, *words)
    assert list(drive.rglob("CONTENTS"))


@pytest.mark.daemon
@pytest.mark.parametrize("method", ["store", "pip"])
def test_a_daemon_runs_nothing_that_lies_there(foreign: Path, tmp_path: Path, method: str) -> None:
    program = ("env", f"--chdir={foreign}", *COMMAND)
    more = f'[install]\nmethod = "{method}"\n'
    with running(tmp_path / "host", more=more, program=program) as host:
        host.bring("talk", talker())
        host.bring("write", scribe())
        host.until_goal(host.want("(written spot)"), "holds")
    notes = ran(foreign)
    assert not notes.exists(), notes.read_text()
