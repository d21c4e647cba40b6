"""An environment in which somebody has not what they ask for is an error of set-up."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import venv
from pathlib import Path

import pip
import pytest
from tests.kit.payloads import make_wheel

from nondum_dev.consistency import Checked
from nondum_dev.places import CHECKOUT, LOCK, PACKAGING
from nondum_dev.problem import DoesNotFit

FITS = "a 1.0 has requirement b<2, but you have b 2.1."
MISSING = "a 1.0 requires {}, which is not installed."
OWN = frozenset({"nondum", "nondum-sdk"})


@pytest.mark.parametrize(
    ("status", "output", "flaws"),
    [
        pytest.param(0, "No broken requirements found.\n", (), id="whole"),
        pytest.param(1, f"{FITS}\n", (FITS,), id="another version"),
        pytest.param(1, MISSING.format("b"), (MISSING.format("b"),), id="missing"),
        pytest.param(1, MISSING.format("nondum_sdk"), (), id="missing of the checkout"),
        pytest.param(
            1, f"{MISSING.format('nondum')}\n{FITS}\n", (FITS,), id="one of each is told alone"
        ),
        pytest.param(1, "something new\n", ("something new",), id="unknown"),
    ],
)
def test_what_pip_says_is_a_flaw(status: int, output: str, flaws: tuple[str, ...]) -> None:
    assert Checked(status, output).flaws(OWN) == flaws


def test_pip_that_fails_without_a_word_is_a_flaw() -> None:
    assert Checked(2, "").flaws(OWN)


@pytest.mark.slow
def test_environment_that_does_not_fit_is_not_set_up(tmp_path: Path) -> None:
    """A lock that holds a version which somebody asks to be another one."""
    checkout, index = tmp_path / "checkout", tmp_path / "index"
    shutil.copytree(PACKAGING / "development", checkout / "packaging/development")
    shutil.copy(CHECKOUT / "pyproject.toml", checkout)
    index.mkdir()
    wheels = {
        "needy": make_wheel(index, "needy", "1.0", {"needy.py": ""}, requires=["its-need<2"]),
        "its-need": make_wheel(index, "its-need", "2.0", {"its_need.py": ""}),
        "pddl": make_wheel(index, "pddl", "0.5.1", {"pddl.py": ""}, requires=["its-need<2"]),
    }
    locked = {"its-need": "2.0", "needy": "1.0", "pddl": "0.5.1"}
    (checkout / LOCK.relative_to(CHECKOUT)).write_text(
        "".join(
            f"{name}=={version} \\\n"
            f"    --hash=sha256:{hashlib.sha256(wheels[name].read_bytes()).hexdigest()}\n"
            for name, version in locked.items()
        )
    )
    venv.create(tmp_path / "venv", symlinks=True)
    (site_packages,) = tmp_path.glob("venv/lib/python*/site-packages")
    shutil.copytree(Path(pip.__file__).parent, site_packages / "pip")  # ensurepip takes a while
    python = tmp_path / "venv/bin/python"

    def install(*names: str) -> subprocess.CompletedProcess[str]:
        ours = {"PIP_FIND_LINKS": str(index), "PIP_NO_INDEX": "1"}
        program = str(checkout / "packaging/development")
        command = [str(python), "-P", program, "install", *names]
        return subprocess.run(command, env=os.environ | ours, capture_output=True, text=True)

    done = install("its-need", "pddl")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "venv/beside/pddl.py").exists(), "what is overruled lies beside"
    done = install("needy")
    assert done.returncode == DoesNotFit.status
    assert "needy 1.0 has requirement its-need<2, but you have its-need 2.0." in done.stderr
