"""The campaigns that there are, and which changes make the last result of each old."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

HOST = "host/nondum/host"
PORTIONS = (
    "host/nondum",
    "planning/nondum",
    "transport/nondum",
    "wheelhouse/nondum",
    "plugins/sdk/nondum",
)
"""The source of nondum itself."""
SUITES = ("python", "-m", "tests.campaign.suites")
"""Runs the tests of pytest that are marked `long(NAME)`, file by file."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """Tests that take too long for the full run."""

    name: str
    sentence: str
    """What it does."""
    covers: tuple[str, ...]
    """Pathspecs of git: a change there makes its last result old."""
    command: tuple[str, ...]
    """Its long form. `{minutes}`, `{folder}` (keeps what was done) and `{seed}` are filled in."""
    extras: tuple[str, ...] = ()
    """Dependency groups of pyproject.toml that it needs beside those of the tests."""
    needs_lab: bool = False
    """Whether it needs the system packages of `./run lab`."""

    @property
    def is_pytest(self) -> bool:
        """Whether it consists of tests that are marked `long(NAME)`."""
        return self.command[: len(SUITES)] == SUITES


def _module(name: str, *options: str) -> tuple[str, ...]:
    return ("python", "-m", name, "--minutes", "{minutes}", "--folder", "{folder}", *options)


def _suites(name: str) -> tuple[str, ...]:
    return (*SUITES, name, "--minutes", "{minutes}", "--folder", "{folder}", "--seed", "{seed}")


_ALL = (
    Campaign(
        "faults",
        "Kills, failing system calls and power cuts at points of a payload's life",
        (
            *(f"{HOST}/{room}" for room in ("lifecycle", "catalogue", "drives", "workers")),
            "wheelhouse/nondum",
            "tests/faults",
        ),
        _module("tests.faults"),
    ),
    Campaign(
        "fuzz",
        "Every reader of foreign bytes, by a coverage-guided fuzzer",
        (*PORTIONS, "tests/fuzz"),
        _module("tests.fuzz"),
        extras=("fuzz",),
    ),
    Campaign(
        "mutation",
        "Each step of verification removed in turn: a test must fail",
        (*PORTIONS, "tests/mutation"),
        _module("tests.mutation"),
    ),
    Campaign(
        "drives",
        "Hostile drives, 500 yanks, a crowd of a hundred drives and a soak",
        (
            *(f"{HOST}/{room}" for room in ("drives", "lifecycle", "workers", "catalogue")),
            "wheelhouse/nondum",
            "tests/faults",
        ),
        _module("tests.faults.drive_figures"),
    ),
    Campaign(
        "machines",
        "Every scenario of the laboratory on emulated machines",
        (
            "packaging",
            *(f"{HOST}/{room}" for room in ("drives", "helper", "confinement", "service")),
            *(f"{HOST}/{room}" for room in ("devices", "cgroups", "feedback", "peers")),
            "tests/lab",
        ),
        _module("tests.lab"),
        needs_lab=True,
    ),
    Campaign(
        "packages",
        "Debian packages of both architectures, lintian, installation by pipx and uv",
        ("packaging", "pyproject.toml", "plugins/*/pyproject.toml", "tests/packages"),
        _suites("packages"),
    ),
    Campaign(
        "conformance",
        "Real wheels from PyPI, installed as pip installs them",
        ("wheelhouse/nondum", "tests/wheelhouse"),
        _suites("conformance"),
    ),
    Campaign(
        "demonstrations",
        "Both demonstrations in all their forms: shuffled drives, loopback, several seeds",
        (*PORTIONS, "plugins", "demo", "tests/demo"),
        _suites("demonstrations"),
    ),
    Campaign(
        "properties",
        "Tests of properties with many random examples",
        (*PORTIONS, "demo"),
        ("python", "-m", "tests.campaign.properties", *_module("")[3:], "--seed", "{seed}"),
    ),
    Campaign(
        "peers",
        "Bad peers, links that flap, partitions and restarts of hosts, at length",
        (
            "transport/nondum",
            f"{HOST}/peers",
            f"{HOST}/bridge",
            "tests/daemon/peer_faults",
        ),
        _suites("peers"),
    ),
)

CAMPAIGNS: Mapping[str, Campaign] = MappingProxyType({one.name: one for one in _ALL})
"""By name."""
