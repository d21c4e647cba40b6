"""The campaigns that there are, and which changes make the last result of each old."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

HOST = "host/nondum/host"
PORTIONS = (
    "host/nondum",
    "planning/nondum",
    "transport/nondum",
    "wheelhouse/nondum",
    "plugins/host-zenoh",
    "plugins/sdk/nondum",
)
"""The source of nondum itself."""
SUITES = "tests.campaign.suites"
"""Runs the tests of pytest that are marked `long(NAME)`, file by file."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """Tests that take too long for the full run."""

    name: str
    sentence: str
    """What it does."""
    covers: tuple[str, ...]
    """Pathspecs of git: a change there makes its last result old."""
    module: str
    """Its long form: `python -m MODULE --minutes N --folder F`. F keeps what was done."""
    options: tuple[str, ...] = ()
    """Further ones, in which `{seed}` and `{keep}` (a folder that stays) are filled in."""
    needs: tuple[str, ...] = ()
    """Groups of `set_up` in `./run` that it needs beside those of the tests."""

    @property
    def is_pytest(self) -> bool:
        """Whether it consists of tests that are marked `long(NAME)`."""
        return self.module == SUITES

    def arguments(self, minutes: float | None, *, seed: int, folder: Path, keep: Path) -> list[str]:
        """Of Python, to go on for `minutes`; None: until it is done."""
        time = [] if minutes is None else ["--minutes", f"{minutes:g}"]
        more = [word.format(seed=seed, keep=keep) for word in self.options]
        return ["-m", self.module, *more, *time, "--folder", str(folder)]


_SEED = ("--seed", "{seed}")

_OF_PAYLOADS = tuple(
    f"{HOST}/{name}" for name in ("core", "lifecycle", "manager", "jobs", "catalogue", "workers")
)
"""What a payload's life is made of."""

_OF_MACHINES = (
    "packaging",
    *(f"{HOST}/{name}" for name in ("sources", "sandbox", "service", "people", "peers")),
    "plugins/host-lamps/nondum_host_lamps",
    "tests/lab",
)
"""What only a whole machine shows."""

_ALL = (
    Campaign(
        "faults",
        "Kills, failing system calls and power cuts at points of a payload's life",
        (
            *_OF_PAYLOADS,
            f"{HOST}/sources",
            "wheelhouse/nondum",
            "tests/faults",
        ),
        "tests.faults",
        ("--points", "100", *_SEED),
    ),
    Campaign(
        "restarts",
        "Daemons killed at random moments and started again at once, under load",
        (
            *_OF_PAYLOADS,
            "tests/faults",
            "tests/kit",
        ),
        "tests.faults.restarts",
        _SEED,
    ),
    Campaign(
        "fuzz",
        "Every reader of foreign bytes, by a coverage-guided fuzzer",
        (*PORTIONS, "tests/fuzz"),
        "tests.fuzz",
        ("--work", "{keep}"),
        needs=("fuzz",),
    ),
    Campaign(
        "mutation",
        "Each step of verification removed in turn: a test must fail",
        (*PORTIONS, "tests/mutation"),
        "tests.mutation",
        ("--keep", "{keep}"),
    ),
    Campaign(
        "drives",
        "Hostile drives, drives yanked at any moment, a crowd of a hundred drives and a soak",
        (
            *_OF_PAYLOADS,
            f"{HOST}/sources",
            "wheelhouse/nondum",
            "tests/faults",
        ),
        "tests.faults.drive_figures",
        ("--due", "--rounds", "3", "--points", "100", "--cycles", "160", *_SEED),
    ),
    Campaign(
        "machines",
        "Every scenario of the laboratory on emulated x86_64 machines with Debian 12",
        _OF_MACHINES,
        "tests.lab",
        ("--jobs", "2"),
        needs=("lab",),
    ),
    Campaign(
        "debian-13",
        "A yanked stick, the package and the first demonstration on machines with Debian 13",
        _OF_MACHINES,
        "tests.lab",
        ("--suite", "trixie", "--jobs", "2", "yank", "package", "following"),
        needs=("lab",),
    ),
    Campaign(
        "packages",
        "Debian packages of both architectures, lintian, installation by pipx and uv",
        ("packaging", "pyproject.toml", "plugins/*/pyproject.toml", "tests/packages"),
        SUITES,
        ("packages", *_SEED),
    ),
    Campaign(
        "conformance",
        "Real wheels from PyPI, installed as pip installs them",
        ("wheelhouse/nondum", "tests/wheelhouse"),
        SUITES,
        ("conformance", *_SEED),
    ),
    Campaign(
        "demonstrations",
        "Both demonstrations in all their forms: shuffled drives, loopback, several seeds",
        (*PORTIONS, "plugins", "demo", "tests/demo"),
        SUITES,
        ("demonstrations", *_SEED),
    ),
    Campaign(
        "properties",
        "Tests of properties with many random examples",
        (*PORTIONS, "demo"),
        "tests.campaign.properties",
        _SEED,
    ),
    Campaign(
        "peers",
        "Bad peers, links that flap, partitions and restarts of hosts, at length",
        (
            "transport/nondum",
            f"{HOST}/peers",
            "tests/daemon/peer_faults",
        ),
        SUITES,
        ("peers", *_SEED),
    ),
)

CAMPAIGNS: Mapping[str, Campaign] = MappingProxyType({one.name: one for one in _ALL})
"""By name."""
