"""A goal on a drive: wanted while it is plugged in, if whoever signed it may want things here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from demo.robot import configuration
from tests.daemon.neighbours import BEACON, UNCONFINED
from tests.kit.payloads import Part, seal
from tests.kit.running_host import READY_S, Row, RunningHost, goal
from tests.kit.signing import Key, sign_payload, trust_of

from nondum.wheelhouse import goal_payload, goals
from nondum.wheelhouse.trust import trust_text

pytestmark = pytest.mark.daemon

ALICE = Key("alice")
GOAL = "org.example.errand/1"
SHINE = BEACON.replace("lasting=True,", 'lasting=True, phrase="shine",')


@contextmanager
def trusting(work: Path, permissions: Sequence[str]) -> Iterator[RunningHost]:
    """A host that trusts Alice with all ids, and with some permissions."""
    trust = work / "trust.toml"
    roles = {"maker": (["org.example"], [ALICE])}
    text = trust_text.to_text(trust_of(roots=[Key("root")], roles=roles, permissions=permissions))
    trust.write_text(text)
    host = RunningHost(work)
    more = f"{UNCONFINED}[feedback]\nsafe_s = 0.2\n"  # long enough to be shown
    (work / "host.toml").write_text(configuration(host, trust) + more, encoding="utf-8")
    try:
        host.start()
        yield host
    finally:
        host.stop()


def beacon(host: RunningHost) -> None:
    """Plug in what can shine, signed, and wait for it."""
    source = SHINE.replace("LAMP", "light").replace("LOST", "stop")
    source = source.replace("LOG", str(host.work / "beacon.log"))
    drive = host.drive("beacon", Part("beacon", source))
    sign_payload(drive / "nondum/org.example.beacon", ALICE)
    host.plug(drive)
    host.until_step("beacon", "active")


def errand(host: RunningHost, *wanted: str, signer: Key | None = ALICE) -> Path:
    """A drive with goals only."""
    drive = host.work / "drives/errand"
    folder = goal_payload.write(drive, "org.example.errand", wanted, release=1)
    if signer is not None:
        sign_payload(folder, signer)
    return drive


def until_shown(host: RunningHost, state: str, code: str = "") -> dict[str, Any]:
    def found(view: Any) -> dict[str, Any] | None:
        shown: dict[str, Any] = view["feedback"]
        return shown if (shown["state"], shown["code"]) == (state, code) else None

    return host.until(f"shown: {state} {code}", found, timeout_s=READY_S)


def until_over(host: RunningHost, id: str) -> Row:
    return host.until_goal(id, "halted")


def test_a_goal_is_pursued_while_its_drive_is_in(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        name = host.plug(errand(host, "shine"))
        assert host.until_goal(GOAL, "active")["text"] == "shine"
        host.until_runs("shine")
        host.pull(name)
        assert until_over(host, GOAL)["reason"] == "the payload that wants it is withdrawn"
        host.until("nothing runs", lambda v: not v["plan"]["steps"], timeout_s=READY_S)


def test_a_drive_that_comes_back_gives_its_goal_again(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        drive = errand(host, "shine")
        for _ in range(2):
            name = host.plug(drive)
            host.until_goal(GOAL, "active")
            host.pull(name)
            until_over(host, GOAL)


def test_words_wait_for_the_payload_that_knows_them(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        host.plug(errand(host, "shine"))
        host.until_step("errand", "active")
        shown = until_shown(host, "needs-help", "PHRASE_UNKNOWN")
        assert shown["payload"] == "org.example.errand"
        beacon(host)
        host.until_goal(GOAL, "active")


def test_words_that_wait_are_forgotten_with_their_drive(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        name = host.plug(errand(host, "shine"))
        until_shown(host, "needs-help", "PHRASE_UNKNOWN")
        host.pull(name)
        host.until_gone("errand")
        beacon(host)
        until_shown(host, "ready")
        assert goal(host.view, GOAL) is None


def test_each_line_is_a_goal(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        host.plug(errand(host, "blink", "shine"))
        host.until_goal("org.example.errand/2", "active")
        host.until_goal(GOAL, "reached")


def test_a_role_that_may_not_give_goals_is_refused_with_its_payload(tmp_path: Path) -> None:
    with trusting(tmp_path, ["network"]) as host:
        host.plug(errand(host, "shine"))
        shown = until_shown(host, "refused", "PERMISSION_DENIED")
        assert "'goals'" in shown["sentence"]
        assert not host.view["goals"]


def test_a_goal_that_nobody_signed_is_refused_unread(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        host.plug(errand(host, "shine", signer=None))
        until_shown(host, "refused", "SIG_MISSING")
        assert not host.view["goals"]


def test_a_goal_that_was_changed_after_it_was_signed_is_refused(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        drive = errand(host, "shine")
        (drive / "nondum/org.example.errand" / goals.NAME).write_text("smash\n")
        host.plug(drive)
        until_shown(host, "refused", "HASH_MISMATCH")


def test_a_goal_file_that_is_none_is_refused_though_it_is_signed(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        drive = errand(host, "shine")
        folder = drive / "nondum/org.example.errand"
        (folder / goals.NAME).write_text("\n# nothing\n")
        (folder / "CONTENTS.sig").unlink()
        seal(folder, payload_id="org.example.errand")
        sign_payload(folder, ALICE)
        host.plug(drive)
        until_shown(host, "refused", "GOAL_FILE")


def test_a_goal_beside_the_payloads_is_told_of_and_never_wanted(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        drive = tmp_path / "drives/loose"
        (drive / "nondum").mkdir(parents=True)
        (drive / "nondum" / goals.NAME).write_text("shine\n")
        host.plug(drive)
        until_shown(host, "refused", "GOAL_UNSIGNED")
        host.until_told("GOAL_UNSIGNED")
        assert not host.view["goals"]


def test_a_daemon_that_starts_again_gives_the_goal_once(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        host.plug(errand(host, "shine"))
        host.until_goal(GOAL, "active")
        host.kill()
        host.start()
        host.until_goal(GOAL, "active")
        assert [row["id"] for row in host.view["goals"]] == [GOAL]


def test_a_goal_whose_drive_was_pulled_meanwhile_is_not_taken_up(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        name = host.plug(errand(host, "shine"))
        host.until_goal(GOAL, "active")
        host.kill()
        host.pull(name)
        host.start()
        host.until_step("beacon", "active")
        host.until_gone("errand")
        until_shown(host, "ready")
        assert not host.view["goals"]
