"""`./run setup` makes an environment, looks at the one that is there, and makes it again if it does
not fit. What is installed, and whether it fits, is the installer's to say: here a script does."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pip
import pytest

from nondum_dev.places import CHECKOUT
from nondum_dev.problem import DoesNotFit, SetUpFailed

INSTALLER = """
import pathlib, sys
here = pathlib.Path(__file__).parent
with (here / "asked").open("a") as asked:
    asked.write(" ".join(sys.argv[2:]) + "\\n")
answers = (here / "answers").read_text().split()
(here / "answers").write_text(" ".join(answers[1:]))
sys.exit(int(answers[0]) if answers else 0)
"""
PYTHON = f"""#!/bin/sh -e
[ "$2" = venv ] || exec {sys.executable} "$@"
for folder; do :; done
{sys.executable} -m venv --without-pip "${{folder:?}}"
ln -s {Path(pip.__file__).parent} "$folder"/lib/python3*/site-packages
"""
"""Makes environments without ensurepip, which takes a while."""


@dataclass
class Checkout:
    folder: Path

    def set_up(self, *answers: int) -> tuple[int, list[str]]:
        """Run it with what the installer ends with; its status, and what the installer was asked
        for, of host (`.[fast]`) and dev."""
        installer = self.folder / "packaging/development"
        (installer / "asked").write_text("")
        (installer / "answers").write_text(" ".join(map(str, answers)))
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        done = subprocess.run([self.folder / "run", "setup"], env=os.environ | {"PATH": path})
        lines = (installer / "asked").read_text().splitlines()
        kept = ("kept " if "--keep" in line else "" for line in lines)
        names = ("host" if ".[fast]" in line else "dev" for line in lines)
        return done.returncode, [f"{keep}{name}" for keep, name in zip(kept, names, strict=True)]


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    for name in ("pyproject.toml", "plugins/sdk/pyproject.toml", "run"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(CHECKOUT / name, tmp_path / name)
    installer = tmp_path / "packaging/development"
    installer.mkdir(parents=True)
    (installer / "requirements.lock").touch()
    (installer / "__main__.py").write_text(INSTALLER)
    (tmp_path / "bin").mkdir()
    make(tmp_path / "bin/python3", PYTHON)
    (tmp_path / "bin/apt-get").symlink_to("/bin/false")  # what this machine lacks, it lacks
    return Checkout(tmp_path)


OLD = """#!/bin/sh
[ "$1" != -V ] || echo "Python 3.10.12"
[ "$1" = -V ]
"""


def make(program: Path, text: str) -> None:
    program.write_text(text)
    program.chmod(0o755)


def test_newer_python_is_taken_where_the_systems_is_too_old(checkout: Checkout) -> None:
    make(checkout.folder / "bin/python3", OLD)
    make(checkout.folder / "bin/python3.13", OLD)
    make(checkout.folder / "bin/python3.12", PYTHON)
    assert checkout.set_up() == (0, ["host", "dev"])


def test_without_a_newer_python_nothing_is_made(checkout: Checkout) -> None:
    for name in ("python3", "python3.13", "python3.12", "python3.11"):
        make(checkout.folder / "bin" / name, OLD)
    assert checkout.set_up() == (1, [])
    assert not (checkout.folder / ".venv").exists()


def test_set_up_looks_again_at_what_is_there(checkout: Checkout) -> None:
    assert checkout.set_up() == (0, ["host", "dev"])
    (checkout.folder / ".venv/mark").touch()
    assert checkout.set_up() == (0, ["kept host", "kept dev"])
    assert (checkout.folder / ".venv/mark").exists()


def test_environment_that_does_not_fit_is_made_again_once(checkout: Checkout) -> None:
    assert checkout.set_up() == (0, ["host", "dev"])
    (checkout.folder / ".venv/mark").touch()
    status = DoesNotFit.status
    assert checkout.set_up(0, status) == (0, ["kept host", "kept dev", "host", "dev"])
    assert not (checkout.folder / ".venv/mark").exists()
    assert checkout.set_up(status, status) == (status, ["kept host", "host"])


def test_environment_stays_where_something_else_is_wrong(checkout: Checkout) -> None:
    assert checkout.set_up() == (0, ["host", "dev"])
    (checkout.folder / ".venv/mark").touch()
    assert checkout.set_up(SetUpFailed.status) == (SetUpFailed.status, ["kept host"])
    assert (checkout.folder / ".venv/mark").exists()
