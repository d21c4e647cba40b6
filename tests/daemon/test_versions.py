"""Payloads that need incompatible versions of one library work side by side."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.kit.payloads import Part, make_wheel
from tests.kit.running_host import RunningHost

pytestmark = pytest.mark.daemon

USER = '''"""Says which version of a library it runs with."""
from nondum.sdk import Fragment, Header, Text, Unit, hookimpl

DOMAIN = """
(define (domain user)
  (:predicates (runs-with ?u - unit))
  (:valued runs-with))
"""

@hookimpl
def units():
    return [Unit("reader", "sensor")]

@hookimpl
def fragments():
    return [Fragment("user.pddl", DOMAIN)]

@hookimpl
def start(ctx):
    import LIBRARY
    ctx.know("runs-with", "reader", value=Text(Header(), LIBRARY.__version__))
'''


def user(id: str, library: str, *wheels: Path) -> Part:
    """A plugin that knows which version of a library its worker has imported."""
    return Part(id, USER.replace("LIBRARY", library), wheels=wheels)


def versions(host: RunningHost) -> dict[str, str]:
    """Component → the version that it runs with."""
    facts = {f: value for f, value in host.facts().items() if f.startswith("runs-with ")}
    return {fact.split("__")[1]: value[1]["text"] for fact, value in facts.items()}


def test_two_versions_of_one_library_run_side_by_side(host: RunningHost, tmp_path: Path) -> None:
    for version in ("1.0", "2.0"):
        module = f"__version__ = {version!r}\n"
        wheel = make_wheel(tmp_path, "library", version, {"library.py": module})
        name = f"user-{version[0]}"
        host.bring(name, user(name, "library", wheel))
    assert versions(host) == {"user-1": "1.0", "user-2": "2.0"}
    assert {row["state"] for row in host.ask("components")} == {"ready"}
    shared = {row["wheel"].split("-")[0]: row["used_by"] for row in host.ask("store")}
    assert len(shared["nondum_sdk"]) == 2, "what both need is stored once"


@pytest.mark.slow
def test_opencv_4_and_5_run_side_by_side(host: RunningHost, tmp_path: Path) -> None:
    for name, wanted in (("old-eyes", "<5"), ("new-eyes", ">=5")):
        wheels = downloaded(f"opencv-python-headless{wanted}", tmp_path / name)
        host.bring(name, user(name, "cv2", *wheels))
    found = versions(host)
    assert {name: version.split(".")[0] for name, version in found.items()} == {
        "old-eyes": "4",
        "new-eyes": "5",
    }


def downloaded(requirement: str, folder: Path) -> list[Path]:
    """A distribution and all that it needs, as wheels for this machine; skips without an index."""
    command = [*(sys.executable, "-m", "pip", "download", "-q", "--only-binary", ":all:"), "-d"]
    done = subprocess.run([*command, str(folder), requirement], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"the package index does not give {requirement}: {done.stderr[-300:]}")
    return sorted(folder.glob("*.whl"))
