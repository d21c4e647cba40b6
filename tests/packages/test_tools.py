"""Installed by pipx and by uv, as a person does who may not install packages: from built wheels."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests.daemon.plugins import talker
from tests.kit.payloads import make_payload
from tests.packages.conftest import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900), pytest.mark.long("packages")]
PLUGINS = ("plugins/host-lamps", "plugins/planner-pyperplan", "plugins/pddl-workbench")
DISTRIBUTIONS = ("plugins/sdk", *PLUGINS, ".")
MORE = ("nondum-host-lamps", "nondum-planner-pyperplan", "nondum-pddl-workbench")
PAYLOAD = "org.example.talker"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """nondum's own wheels, built."""
    folder = tmp_path_factory.mktemp("wheels")
    places = [ROOT / place for place in DISTRIBUTIONS]
    command: list[str | Path] = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "-w",
        folder,
        *places,
    ]
    subprocess.run(command, check=True)
    return folder


@pytest.fixture(params=["pipx", "uv"])
def nondum(
    request: pytest.FixtureRequest, wheels: Path, tmp_path: Path, clean: dict[str, str]
) -> Path:
    """The command, installed in a clean home by one of the tools."""
    tool = _tool(request.param, tmp_path / "tool", clean)
    (wheel,) = wheels.glob("nondum-*.whl")
    words: list[str | Path]
    if request.param == "pipx":
        words = ["install", "--python", sys.executable, f"--pip-args=--find-links {wheels}", wheel]
    else:
        more = ["--find-links", str(wheels), *(f"--with={name}" for name in MORE)]
        words = ["tool", "install", "--python", sys.executable, *more, wheel]
    subprocess.run([tool, *words], env=clean, check=True)
    if request.param == "pipx":
        more = ["inject", f"--pip-args=--find-links {wheels}", "nondum", *MORE]
        subprocess.run([tool, *more], env=clean, check=True)
    return Path(clean["HOME"], ".local/bin/nondum")


@pytest.fixture
def clean(tmp_path: Path) -> dict[str, str]:
    """The surroundings of a user who has nothing yet, with a short path for sockets."""
    home = tmp_path / "h"
    home.mkdir()
    network = ("PIP_", "UV_", "SSL_")
    kept = {name: value for name, value in os.environ.items() if name.startswith(network)}
    path = os.pathsep.join((str(home / ".local/bin"), os.environ.get("PATH", os.defpath)))
    return {**kept, "HOME": str(home), "PATH": path, "LC_ALL": "C.UTF-8"}


def test_host_of_a_user_runs_what_is_in_a_slot(
    nondum: Path, clean: dict[str, str], tmp_path: Path
) -> None:
    said = subprocess.run([nondum, "--version"], env=clean, capture_output=True, text=True)
    assert said.stdout.split()[-1] == "0.1.0"
    file = tmp_path / "host.toml"
    file.write_text('[host]\nname = "rover"\n[drives]\nallow_unsigned = true\n')
    slots = Path(clean["HOME"], ".local/state/nondum/slots")
    make_payload(tmp_path / "stick", talker(), payload_id=PAYLOAD)
    with _running([nondum, "host", "run", "--user", "--config", file], clean) as daemon:
        assert daemon.stderr is not None
        line = next(line for line in daemon.stderr if "listens at" in line)
        assert str(slots.parent) in line
        shutil.move(tmp_path / "stick", slots / "stick")
        with _running([nondum, "status", "--follow", "--json"], clean) as status:
            assert status.stdout is not None
            assert any(_is_active(json.loads(line)) for line in status.stdout)


def _is_active(view: dict[str, Any]) -> bool:
    rows = view["payloads"]
    return any(row["payload"] == PAYLOAD and row["state"] == "active" for row in rows)


def _tool(name: str, folder: Path, clean: dict[str, str]) -> Path:
    """A tool from PyPI, in a new venv."""
    venv.create(folder, with_pip=True)
    subprocess.run([folder / "bin/pip", "install", "-q", name], env=clean, check=True)
    return folder / "bin" / name


@contextmanager
def _running(command: list[str | Path], clean: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=clean, text=True, stdout=pipe, stderr=pipe) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGTERM)
            process.communicate()
