"""What it is worth that a drive may be pulled: told only when nothing can be lost any more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.daemon.neighbours import BEACON, UNCONFINED
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, RunningHost, happened, payload, running

NAME, KEY = "beacon", "org.example.beacon"
FEEDBACK = "[feedback]\nsafe_s = 100000\n"


def beacon(work: Path) -> Part:
    source = BEACON.replace("LAMP", "light").replace("LOST", "stop")
    return Part(NAME, source.replace("LOG", str(work / "beacon.log")))


def shown(view: Any) -> str:
    state: str = view["feedback"]["state"]
    return state


def until_safe(host: RunningHost) -> None:
    host.until("safe to remove", lambda v: shown(v) == "safe-to-remove", timeout_s=READY_S)


def written(drive: Path) -> dict[Path, int]:
    """When each file and folder was last written to."""
    return {path: path.stat().st_mtime_ns for path in drive.rglob("*")}


def test_pull_after_it_is_safe_loses_nothing(tmp_path: Path) -> None:
    with running(tmp_path, more=UNCONFINED + FEEDBACK) as host:
        drive = host.drive(NAME, beacon(tmp_path))
        before = written(drive)
        name = host.plug(drive)
        until_safe(host)
        active = payload(host.view, NAME)
        assert active is not None
        assert active["state"] == "active"
        stored = host.ask("store")
        host.pull(name)
        host.until_gone(NAME)
        host.until("ready", lambda v: shown(v) == "ready", timeout_s=READY_S)
        assert written(drive) == before
        assert {row["sha256"] for row in host.ask("store")} == {row["sha256"] for row in stored}
        assert not any(row["problems"] for row in host.journal())
        host.plug(drive)  # and nothing of it has to be copied again
        until_safe(host)
        copied = [row["detail"] for row in host.journal() if row["event"] == "PayloadCopied"]
        assert [row["bytes_copied"] > 0 for row in copied] == [True, False]


def test_nothing_is_told_before_the_payload_is_active(tmp_path: Path) -> None:
    with running(tmp_path, more=UNCONFINED + FEEDBACK) as host:
        host.bring(NAME, beacon(tmp_path))
        until_safe(host)
        states = [(shown(v), (payload(v, NAME) or {}).get("state")) for v in host.views]
        safe = [state for told, state in states if told == "safe-to-remove"]
        assert set(safe) == {"active"}
        assert any(told == "working" for told, _ in states)


def test_pull_before_it_is_safe_is_never_told_as_safe(tmp_path: Path) -> None:
    with running(tmp_path, more=UNCONFINED + FEEDBACK) as host:
        name = host.plug(host.drive(NAME, beacon(tmp_path)))
        host.until("working", lambda v: shown(v) == "working", timeout_s=READY_S)
        host.pull(name)
        host.until_gone(NAME)
        host.until("ready", lambda v: shown(v) == "ready", timeout_s=READY_S)
        was_told = any(shown(view) == "safe-to-remove" for view in host.views)
        assert happened(host.journal(), ("PayloadActivated", KEY)) or not was_told
        assert host.ask("components") == []


def test_a_drive_that_has_nothing_for_the_host_is_refused_until_it_is_pulled(
    tmp_path: Path,
) -> None:
    with running(tmp_path, more=UNCONFINED + FEEDBACK) as host:
        (tmp_path / "drives/photos").mkdir(parents=True)
        name = host.plug(tmp_path / "drives/photos")
        host.until("refused", lambda v: shown(v) == "refused", timeout_s=READY_S)
        assert host.view["feedback"]["code"] == "DRIVE_NOT_PAYLOAD"
        host.pull(name)
        host.until("ready", lambda v: shown(v) == "ready", timeout_s=READY_S)
