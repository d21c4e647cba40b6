"""A goal on a drive: pursued while the drive is in, if its signer may give goals to this host."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests.daemon.neighbours import BEACON, UNCONFINED
from tests.kit.golden import Golden
from tests.kit.payloads import Part, seal
from tests.kit.running_host import READY_S, Row, RunningHost, running
from tests.kit.shared import Shared
from tests.kit.signing import Key, sign_payload, trust_of

from nondum.wheelhouse.build import goal_payload
from nondum.wheelhouse.format import goals
from nondum.wheelhouse.trust import trust_text

pytestmark = pytest.mark.daemon

ALICE = Key("alice")
SHINE = BEACON.replace("lasting=True,", 'lasting=True, phrase="shine",')


@contextmanager
def trusting(work: Path, permissions: Sequence[str]) -> Iterator[RunningHost]:
    """A host that trusts Alice with all ids, and with some permissions."""
    trust = work / "trust.toml"
    roles = {"maker": (["org.example"], [ALICE])}
    text = trust_text.to_text(trust_of(roots=[Key("root")], roles=roles, permissions=permissions))
    trust.write_text(text)
    more = f"{UNCONFINED}[feedback]\nsafe_s = 0.2\n"  # long enough to be shown
    with running(work, trust=trust, more=more) as host:
        yield host


@pytest.fixture(scope="module")
def one_trusting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[list[RunningHost]]]:
    """The host that takes goals from Alice."""

    @contextmanager
    def start() -> Iterator[list[RunningHost]]:
        with trusting(tmp_path_factory.mktemp("host"), ["goals"]) as host:
            yield [host]

    with Shared(start) as shared:
        yield shared


@pytest.fixture
def host(one_trusting: Shared[list[RunningHost]]) -> Iterator[RunningHost]:
    with one_trusting.lent() as (host,):
        until_shown(host, "ready")
        yield host


def delivery_name(host: RunningHost) -> str:
    """Another one for each test: goals that are over stay known by their payload."""
    return f"delivery-{host.release}"


def delivery_id(host: RunningHost) -> str:
    return f"org.example.{delivery_name(host)}"


def wanted(host: RunningHost, number: int = 1) -> str:
    """The id of a goal of the delivery."""
    return f"{delivery_id(host)}/{number}"


def beacon(host: RunningHost) -> None:
    """Plug in what can shine, signed, and wait for it."""
    source = SHINE.replace("LAMP", "light").replace("LOST", "stop")
    source = source.replace("LOG", str(host.work / "beacon.log"))
    drive = host.drive("beacon", Part("beacon", source))
    sign_payload(drive / "nondum/org.example.beacon", ALICE)
    host.plug(drive)
    host.until_step("beacon", "active")


def delivery(host: RunningHost, *goals: str, signer: Key | None = ALICE) -> Path:
    """A drive with goals only."""
    drive = host.work / "drives/delivery"
    folder = goal_payload.write(drive, delivery_id(host), goals, release=1)
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


def test_a_goal_is_pursued_while_its_drive_is_in(host: RunningHost, golden: Golden) -> None:
    beacon(host)
    name = host.plug(delivery(host, "shine"))
    assert host.until_goal(wanted(host), "holds")["text"] == "shine"
    host.until_runs("shine")
    host.pull(name)
    golden.check("a goal file is pulled", until_over(host, wanted(host))["reason"])
    host.until("nothing runs", lambda v: not v["plan"]["steps"], timeout_s=READY_S)


def test_a_drive_that_comes_back_gives_its_goal_again(host: RunningHost) -> None:
    beacon(host)
    drive = delivery(host, "shine")
    for _ in range(2):
        name = host.plug(drive)
        host.until_goal(wanted(host), "holds")
        host.pull(name)
        until_over(host, wanted(host))


def test_words_wait_for_the_payload_that_knows_them(host: RunningHost) -> None:
    host.plug(delivery(host, "shine"))
    host.until_step(delivery_name(host), "active")
    shown = until_shown(host, "needs-help", "PHRASE_UNKNOWN")
    assert shown["payload"] == delivery_id(host)
    beacon(host)
    host.until_goal(wanted(host), "holds")


def test_words_that_wait_are_forgotten_with_their_drive(host: RunningHost) -> None:
    name = host.plug(delivery(host, "shine"))
    until_shown(host, "needs-help", "PHRASE_UNKNOWN")
    host.pull(name)
    host.until_gone(delivery_name(host))
    beacon(host)
    until_shown(host, "ready")
    assert not host.goals()


def test_each_line_is_a_goal(host: RunningHost) -> None:
    beacon(host)
    host.plug(delivery(host, "blink", "shine"))
    host.until_goal(wanted(host, 2), "holds")
    host.until_goal(wanted(host), "reached")


def test_a_role_that_may_not_give_goals_is_refused_with_its_payload(tmp_path: Path) -> None:
    with trusting(tmp_path, ["network"]) as host:
        host.plug(delivery(host, "shine"))
        shown = until_shown(host, "refused", "PERMISSION_DENIED")
        assert "'goals'" in shown["sentence"]
        assert not host.goals()


def test_a_goal_without_a_signature_is_refused_unread(host: RunningHost) -> None:
    host.plug(delivery(host, "shine", signer=None))
    until_shown(host, "refused", "SIG_MISSING")
    assert not host.goals()


def test_a_goal_that_was_changed_after_it_was_signed_is_refused(host: RunningHost) -> None:
    drive = delivery(host, "shine")
    (drive / "nondum" / delivery_id(host) / goals.NAME).write_text("smash\n")
    host.plug(drive)
    until_shown(host, "refused", "HASH_MISMATCH")


def test_a_goal_file_that_is_none_is_refused_though_it_is_signed(host: RunningHost) -> None:
    drive = delivery(host, "shine")
    folder = drive / "nondum" / delivery_id(host)
    (folder / goals.NAME).write_text("\n# nothing\n")
    (folder / "CONTENTS.sig").unlink()
    seal(folder, payload_id=delivery_id(host))
    sign_payload(folder, ALICE)
    host.plug(drive)
    until_shown(host, "refused", "GOAL_FILE")


def test_a_goal_beside_the_payloads_is_told_of_and_never_wanted(host: RunningHost) -> None:
    beacon(host)
    drive = host.work / "drives/loose"
    (drive / "nondum").mkdir(parents=True)
    (drive / "nondum" / goals.NAME).write_text("shine\n")
    host.plug(drive)
    until_shown(host, "refused", "GOAL_UNSIGNED")
    host.until_told("GOAL_UNSIGNED")
    assert not host.goals()


def test_a_daemon_that_starts_again_gives_the_goal_once(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        host.plug(delivery(host, "shine"))
        host.until_goal(wanted(host), "holds")
        host.kill()
        host.start()
        host.until_goal(wanted(host), "holds")
        assert [row["id"] for row in host.goals()] == [wanted(host)]


def test_a_goal_is_not_taken_up_after_its_drive_was_pulled(tmp_path: Path) -> None:
    with trusting(tmp_path, ["goals"]) as host:
        beacon(host)
        name = host.plug(delivery(host, "shine"))
        host.until_goal(wanted(host), "holds")
        host.kill()
        host.pull(name)
        host.start()
        host.until_step("beacon", "active")
        host.until_gone(delivery_name(host))
        until_shown(host, "ready")
        assert not host.goals()
