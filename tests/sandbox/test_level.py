"""Which level a host runs at: found by trying, kept as long as it counts, refused where too low."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.golden import Golden

from nondum.host.config import confinement_level
from nondum.host.config.confinement_level import ConfinementState, Finding
from nondum.host.sandbox.levels import landlock, visibility
from nondum.host.sandbox.levels.users import FIRST_USER
from nondum.host.workers import confinement_choice, confinement_probe
from nondum.sdk.errors import ConfigRefused
from nondum.wheelhouse.format.confinement import Level

HELD = {
    "capabilities": 0,
    "no_new_privileges": True,
    "filters": True,
    "processes": 2,
    "interfaces": ["lo"],
    "sees_state": False,
    "sees_library": True,
    "writes_system": False,
    "makes_namespaces": False,
    "signals_host": False,
    "user": 0,
}
"""What a process sees in a sandbox that holds."""


@pytest.fixture
def no_bwrap(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))


def test_this_machine_has_sandboxes() -> None:
    (found,) = confinement_probe.findings()
    assert (found.level, found.is_available) == (Level.SANDBOXED, True)
    assert found.has_users == (os.geteuid() == 0)
    assert bool(found.reason) != found.has_users, "why workers share a user"


ROOT_OF_A_CONTAINER = """
import json
from nondum.host.workers import confinement_probe
from nondum.host.sandbox.inside import kernel
kernel.unshare(kernel.CLONE_NEWUSER)
open("/proc/self/setgroups", "w").write("deny")
open("/proc/self/uid_map", "w").write("0 0 1")
open("/proc/self/gid_map", "w").write("0 0 1")
print(json.dumps([finding.to_dict() for finding in confinement_probe.findings()]))
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root could have users for workers")
def test_root_that_has_no_more_users_has_sandboxes_without_them() -> None:
    """As in a container whose user namespace is small."""
    told = subprocess.run(
        [sys.executable, "-c", ROOT_OF_A_CONTAINER], capture_output=True, text=True, check=True
    )
    (found,) = map(Finding.from_dict, json.loads(told.stdout))
    assert (found.is_available, found.has_users) == (True, False)
    assert os.strerror(errno.EPERM) in found.reason


def test_without_bubblewrap_the_kernel_has_to_do(no_bwrap: None, golden: Golden) -> None:
    box, kernel = confinement_probe.findings()
    assert not box.is_available
    golden.check("there is no bubblewrap", f"{box.reason} → {box.fix}")
    assert kernel == Finding(Level.RESTRICTED, is_available=True)


def test_bubblewrap_that_fails_is_told_in_its_words(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    broken = tmp_path / "bwrap"
    complaint = "No permissions to create new namespace"
    broken.write_text(f"#!/bin/sh\necho 'bwrap: {complaint}' >&2\nexit 1")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    box = confinement_probe.findings()[0]
    assert not box.is_available
    assert complaint in box.reason
    assert "unprivileged_userns_clone" in box.fix


@pytest.mark.parametrize(
    ("hole", "hole_name"),
    [
        ({"capabilities": 1 << 21}, "holds capabilities"),
        ({"no_new_privileges": False}, "may gain privileges"),
        ({"filters": False}, "has all system calls"),
        ({"sees_state": True}, "reads the host's files"),
        ({"sees_library": False}, "lacks its own library"),
        ({"writes_system": True}, "writes to the system"),
        ({"makes_namespaces": True}, "makes namespaces"),
        ({"processes": 80}, "sees other processes"),
        ({"interfaces": ["lo", "eth0"]}, "has a network"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_sandbox_with_a_hole_is_none(
    hole: dict[str, object], hole_name: str, golden: Golden
) -> None:
    assert visibility.judged(Level.SANDBOXED, HELD).is_available
    finding = visibility.judged(Level.SANDBOXED, {**HELD, **hole})
    assert not finding.is_available
    golden.check(hole_name, finding.reason)
    assert finding.fix


def test_sandbox_says_why_its_workers_share_a_user() -> None:
    sandboxed = visibility.judged(Level.SANDBOXED, HELD)
    assert not sandboxed.has_users
    assert "only root" in visibility.sharing(sandboxed, "only root can give each its own").reason
    assert visibility.sharing(visibility.MISSING, "of anything") == visibility.MISSING
    own = visibility.judged(Level.SANDBOXED, {**HELD, "user": FIRST_USER})
    assert own.has_users
    assert ConfinementState(Level.SANDBOXED, (own,)).has_users
    assert not ConfinementState(Level.RESTRICTED, (own,)).has_users


def test_what_is_not_told_counts_as_a_hole() -> None:
    for key in set(HELD) - {"signals_host", "user"}:
        told = {name: value for name, value in HELD.items() if name != key}
        assert not visibility.judged(Level.SANDBOXED, told).is_available, key


def test_findings_are_kept_until_something_changes(tmp_path: Path) -> None:
    file = tmp_path / "confinement.json"
    found = confinement_probe.findings(file)
    kept = json.loads(file.read_text())
    kept["findings"][0]["reason"] = "as it was kept"
    file.write_text(json.dumps(kept))
    assert confinement_probe.findings(file) == (replace(found[0], reason="as it was kept"),)
    file.write_text(json.dumps({**kept, "of": ["another boot"]}))
    assert confinement_probe.findings(file) == found
    file.write_text("{")
    assert confinement_probe.findings(file) == found


@pytest.mark.parametrize(
    ("number", "level"), [(3, Level.SANDBOXED), (2, Level.SANDBOXED), (1, Level.RESTRICTED)]
)
def test_findings_that_an_earlier_version_kept_are_read(number: int, level: Level) -> None:
    row = {"level": number, "name": "as it was", "available": False, "reason": "", "fix": ""}
    assert Finding.from_dict(row) == Finding(level, is_available=False)


def test_best_level_is_taken(no_bwrap: None) -> None:
    confinement_state = confinement_choice.confinement_state("auto", Level.RESTRICTED)
    assert confinement_state.level == Level.RESTRICTED
    assert [row["level"] for row in confinement_state.to_dict()["missing"]] == ["sandboxed"]
    assert not list(confinement_state.warnings())


def test_level_that_is_asked_for_is_taken() -> None:
    assert (
        confinement_choice.confinement_state(Level.RESTRICTED, Level.RESTRICTED).level
        == Level.RESTRICTED
    )
    confinement_state = confinement_choice.confinement_state(Level.NONE, Level.RESTRICTED)
    assert confinement_state.level == Level.NONE
    (warning,) = confinement_state.warnings()
    assert warning.startswith("plugins are not confined")


def test_level_that_is_not_there_is_refused(no_bwrap: None) -> None:
    with pytest.raises(ConfigRefused) as caught:
        confinement_choice.confinement_state(Level.SANDBOXED, Level.NONE)
    (problem,) = caught.value.problems
    assert problem.code == "CONFINEMENT_UNAVAILABLE"
    assert (problem.need, problem.have) == ("level sandboxed", "level none")
    assert problem.fix and "apt install bubblewrap" in problem.fix


def test_level_that_is_wanted_is_had_or_refused_whatever_the_minimum() -> None:
    box = Finding(Level.SANDBOXED, is_available=False, reason="no bwrap", fix="install it")
    (problem,) = confinement_level.refusals((box,), Level.SANDBOXED, Level.NONE)
    assert "no bwrap" in str(problem)
    assert not list(confinement_level.refusals((box,), Level.NONE, Level.NONE))
    (problem,) = confinement_level.refusals((box,), "auto", Level.RESTRICTED)
    assert "minimum_confinement" in problem.where


def test_host_does_not_start_below_its_minimum(
    no_bwrap: None, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.setattr(landlock, "version", lambda: 0)
    with pytest.raises(ConfigRefused) as caught:
        confinement_choice.confinement_state("auto", Level.RESTRICTED)
    (problem,) = caught.value.problems
    assert problem.where == '[workers] minimum_confinement = "restricted"'
    golden.check("there is no Landlock, which is the least", problem.message)
    confinement_state = confinement_choice.confinement_state("auto", Level.NONE)
    assert confinement_state.level == Level.NONE
    golden.check("there is no Landlock", next(confinement_state.warnings()))


def test_confinement_state_tells_only_the_levels_above_it(golden: Golden) -> None:
    findings = (
        Finding(Level.SANDBOXED, is_available=False, reason="no bwrap"),
        Finding(Level.RESTRICTED, is_available=True),
    )
    told = ConfinementState(Level.RESTRICTED, findings).to_dict()
    golden.check("workers are restricted", told.pop("mechanism"))
    assert told == {"level": "restricted", "users": False, "missing": [findings[0].to_dict()]}
