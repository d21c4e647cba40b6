"""What a host does for a peer, and what it refuses, whatever the peer asks for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.daemon.guest import Guest, guest
from tests.daemon.neighbours import OpenHost, beacon, open_host, until_peer
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S
from tests.kit.shared import Shared

from nondum.transport.peers import CallFailed

pytestmark = pytest.mark.daemon

LAMP = "mule__beacon__lamp"


@pytest.fixture(scope="module")
def one_mule(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[OpenHost]]:
    with Shared(lambda: open_host(tmp_path_factory.mktemp("mule"), "mule")) as shared:
        yield shared


@pytest.fixture
def mule(one_mule: Shared[OpenHost]) -> Iterator[OpenHost]:
    """A host, and where it listens."""
    with one_mule.lent() as mule:
        yield mule


def shine(**more: Any) -> dict[str, Any]:
    arguments = {"u": LAMP, "h": "guest"}
    return {
        "component": "beacon",
        "behaviour": "shine",
        "arguments": arguments,
        "values": [],
    } | more


def refused(one: Guest, method: str, **args: Any) -> str:
    with pytest.raises(CallFailed) as caught:
        one.ask("mule", method, **args)
    return caught.value.code


def many_users(part: Part, users: int) -> Part:
    """The same lamp, for `users` users at once."""
    source = part.source.replace("users=1", f"users={users}").replace("(not (idle ?u))", "")
    return replace(part, source=source.replace("(idle ?u)", ""))


def test_behaviour_is_carried_out_for_a_peer(mule: OpenHost, tmp_path: Path) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one:
        assert one.ask("mule", "behave", **shine(behaviour="blink")) == {
            "outcome": "SUCCEEDED",
            "reason": "",
        }


def test_unit_serves_as_many_as_its_author_says(mule: OpenHost, tmp_path: Path) -> None:
    host, address = mule
    host.bring("light", many_users(beacon(tmp_path / "log"), 2))
    with guest("guest", ("mule", address)) as one, guest("other", ("mule", address)) as other:
        one.begin("mule", **shine())
        other.begin("mule", **shine())
        assert refused(one, "behave", **shine()) == "UNIT_TAKEN"


def test_unit_that_serves_one_refuses_a_second_user(mule: OpenHost, tmp_path: Path) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one, guest("other", ("mule", address)) as other:
        one.begin("mule", **shine())
        assert refused(other, "behave", **shine()) == "UNIT_TAKEN"
        assert f"idle {LAMP}" not in host.facts()


def test_what_is_held_for_a_lost_peer_makes_way_when_it_comes_back(
    mule: OpenHost, tmp_path: Path
) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log", when_lost="hold"))
    with guest("guest", ("mule", address)) as one:
        one.begin("mule", **shine())
    host.until_told("the host guest is gone")
    with guest("other", ("mule", address)) as other:
        assert refused(other, "behave", **shine()) == "UNIT_TAKEN"
    with guest("guest", ("mule", address)) as one:
        one.begin("mule", **shine())
        assert (tmp_path / "log").read_text().split() == ["on", "off", "on"]


def test_host_that_asks_again_has_lost_what_it_asked_for_before(
    mule: OpenHost, tmp_path: Path
) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one:
        one.begin("mule", **shine())
        one.begin("mule", **shine())
        assert (tmp_path / "log").read_text().split() == ["on", "off", "on"]


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        (shine(component="missing"), "NOT_OFFERED"),
        (shine(behaviour="burn"), "NOT_OFFERED"),
        (shine(arguments={"u": "mule__other__lamp", "h": "guest"}), "NOT_OFFERED"),
        (shine(arguments={"u": LAMP}), "CALL_MALFORMED"),
        (shine(arguments={"u": LAMP, "h": 3}), "CALL_MALFORMED"),
        (shine(values=[["p", ["o"]]]), "CALL_MALFORMED"),
        (shine(values=[["p", ["o"], ["no such type", {}]]]), "MESSAGE_TYPE"),
        ({}, "CALL_MALFORMED"),
    ],
)
def test_peer_that_asks_for_what_there_is_not_is_told_so(
    asked: dict[str, Any], code: str, mule: OpenHost, tmp_path: Path
) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one:
        assert refused(one, "behave", **asked) == code
        assert not (tmp_path / "log").exists()


def test_actuator_of_a_host_moves_for_no_peer(mule: OpenHost, tmp_path: Path) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log", type="pointer"))
    with guest("guest", ("mule", address)) as one:
        assert refused(one, "behave", **shine()) == "NOT_OFFERED"
        assert not (tmp_path / "log").exists()


def test_unknown_calls_and_streams_are_refused(mule: OpenHost) -> None:
    _, address = mule
    with guest("guest", ("mule", address)) as one:
        assert refused(one, "reboot") == "METHOD_UNKNOWN"
        assert refused(one, "stream.open", stream="mule__eye__image", bridge="x") == "NOT_OFFERED"
        assert refused(one, "goal.give", words=3) == "CALL_MALFORMED"


def test_what_a_peer_makes_up_is_told_and_changes_nothing_else(
    mule: OpenHost, tmp_path: Path
) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one:
        until_peer(host, "guest")
        one.publish(
            {
                "component/lamp": {"ready": True},
                f"taken/idle {LAMP}": {"by": "guest"},
                "fact/lamp/idle": {"predicate": "idle", "arguments": [LAMP], "value": None},
                "fact/lamp/lit": {"predicate": "lit", "arguments": ["mule"], "value": None},
            }
        )
        host.until(
            "what cannot be understood is told",
            lambda _: any("PEER_ENTRY" in str(row["problems"]) for row in host.ask("peers")),
            timeout_s=READY_S,
        )
        host.until_goal(host.want("(lit mule)"), "holds")


def test_devices_of_a_peer_are_shown_with_who_has_them(mule: OpenHost) -> None:
    host, address = mule
    with guest("guest", ("mule", address)) as one:
        one.publish({"device/usb1": {"component": "eye"}})
        host.until(
            "the device is shown",
            lambda _: (
                [(r["device"], r["component"]) for r in host.ask("devices")]
                == [("usb1", "eye@guest")]
            ),
            timeout_s=READY_S,
        )


def test_host_halts_what_runs_for_a_peer(mule: OpenHost, tmp_path: Path) -> None:
    host, address = mule
    host.bring("light", beacon(tmp_path / "log"))
    with guest("guest", ("mule", address)) as one:
        one.begin("mule", **shine())
        host.ask("halt", now=True)
        host.until("it is off", lambda _: f"idle {LAMP}" in host.facts(), timeout_s=READY_S)
        assert (tmp_path / "log").read_text().split() == ["on", "off"]
