"""What a worker's process gives up before the plugin's first line."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from tests.host.sandbox.inside.child import told

from nondum.host.sandbox.levels import refusals

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to give something up")
needs_filters = pytest.mark.skipif(not refusals.has_filters(), reason="knows no filters")
USER, GROUP = 61184, 61185
NOTHING: dict[str, Any] = {
    "user": None,
    "groups": [],
    "keeps_capabilities": True,
    "may_gain_privileges": True,
    "filter": None,
}


def restricted(**restrictions: Any) -> Mapping[str, str]:
    """The status of a process with these restrictions (proc_pid_status(5))."""
    program = "os.setgroups([4, 5])\nrestrict.restrict(given, None)\ntell(status())"
    found: Mapping[str, str] = told(program, {**NOTHING, **restrictions})
    return found


@needs_root
def test_nothing_is_given_up_unless_it_is_said() -> None:
    found = restricted()
    assert found["Uid"].split() == ["0"] * 4
    assert found["Groups"].split() == ["4", "5"]
    assert int(found["CapEff"], 16)
    assert (found["NoNewPrivs"], found["Seccomp"]) == ("0", told("tell(status())")["Seccomp"])


@needs_root
def test_user_and_all_groups_are_changed() -> None:
    found = restricted(user=USER, groups=[GROUP])
    assert found["Uid"].split() == [str(USER)] * 4
    assert found["Gid"].split() == [str(USER)] * 4
    assert found["Groups"].split() == [str(GROUP)]


@needs_root
def test_root_holds_no_capabilities() -> None:
    found = restricted(keeps_capabilities=False)
    assert not any(int(found[each], 16) for each in ("CapInh", "CapPrm", "CapEff", "CapBnd"))


@needs_root
def test_no_privileges_are_gained() -> None:
    assert restricted(may_gain_privileges=False)["NoNewPrivs"] == "1"


@needs_root
@needs_filters
def test_calls_are_filtered() -> None:
    program = refusals.filter_of(refusals.AT_LEAST, refusals.machine(), without=())
    assert restricted(filter=base64.b64encode(program).decode())["Seccomp"] == "2"


def test_ruleset_is_taken_on_and_let_go(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("of the host")
    told_of = told(
        "from nondum.host.sandbox.levels import landlock\n"
        "with landlock.ruleset(readable=(), writable=()) as ruleset:\n"
        "    mine = os.dup(ruleset)\n"
        "    restrict.restrict({**given['nothing'], 'may_gain_privileges': False}, mine)\n"
        "tell([failure(lambda: os.fstat(mine)), failure(lambda: open(given['file']))])",
        {"nothing": NOTHING, "file": str(tmp_path / "secret")},
    )
    assert told_of == ["EBADF", "EACCES"]
