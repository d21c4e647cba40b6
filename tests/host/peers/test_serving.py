"""What peers may have of this host's components: what is offered, untaken, and asked in full."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tests.host.peers.watcher import component, merged_watcher, snapshot

from nondum.host.mind.composition import Composition
from nondum.host.peers.offered_entries import Policy
from nondum.host.peers.serving import FactValue, Serving
from nondum.host.workers.call import Call
from nondum.planning.execute.running import RunState
from nondum.sdk.wire import Body
from nondum.transport.peers import Admission, CallFailed, IncomingCall, PeerKey
from nondum.transport.peers.messages import Request

pytestmark = pytest.mark.anyio

ALL = Policy(frozenset({"watcher"}))
TURN = {
    "component": "watcher",
    "behaviour": "turn",
    "arguments": {"u": "mule__watcher__head", "h": "rover"},
    "values": [],
}
LOOK = {
    **TURN,
    "behaviour": "look",
    "arguments": {"u": "mule__watcher__eye", "o": "mule__watcher__image", "h": "rover"},
}


@dataclass
class Behaving:
    """Workers whose behaviours go on until they are halted."""

    calls: list[Call] = field(default_factory=list)
    begun: asyncio.Event = field(default_factory=asyncio.Event)
    told: list[Sequence[FactValue]] = field(default_factory=list)

    def behave(
        self, component: str, behaviour: str, arguments: Mapping[str, str], values: object
    ) -> Call:
        call = Call(len(self.calls), component, behaviour, arguments, lambda _: None)
        call.when_halted(lambda: call.end(RunState.HALTED))
        self.calls.append(call)
        self.begun.set()
        return call

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        self.told.append(values)


def serving(workers: Behaving, policy: Policy = ALL, own: Sequence[str] = ()) -> Serving:
    here = snapshot(component())
    return Serving(workers, lambda: here, lambda: None, lambda: policy, lambda: own, lambda: None)


def composed(workers: Behaving, own: Sequence[str] = ()) -> Serving:
    """Where it is known what behaviours take."""
    here = snapshot(component())
    composition = cast(Composition, SimpleNamespace(merged=merged_watcher()))
    return Serving(
        workers, lambda: here, lambda: composition, lambda: ALL, lambda: own, lambda: None
    )


async def test_what_is_in_use_here_is_not_taken() -> None:
    workers = Behaving()
    served = composed(workers, own=("idle mule__watcher__eye",))
    with pytest.raises(CallFailed, match="UNIT_TAKEN"):
        await served.behave(incoming(LOOK))
    assert workers.calls == []


async def test_what_a_peer_uses_is_told_and_not_taken_by_another() -> None:
    workers = Behaving()
    served = composed(workers)
    first = asyncio.create_task(served.behave(incoming(LOOK)))
    await workers.begun.wait()
    taken = {"idle mule__watcher__eye": "rover", "free mule__watcher__image": "rover"}
    assert served.taken == taken
    with pytest.raises(CallFailed, match="UNIT_TAKEN"):
        await served.behave(incoming(LOOK, "mule-2"))
    workers.calls[0].end(RunState.SUCCEEDED)
    await first
    assert served.taken == {}


def incoming(args: Body, caller: str = "rover") -> IncomingCall:
    admission = Admission(PeerKey(caller), caller, "pairing")
    return IncomingCall(admission, Request(1, 1, 60_000, "behave", args), lambda _, __: None)


async def refused(args: Body, policy: Policy = ALL) -> str:
    workers = Behaving()
    with pytest.raises(CallFailed) as failed:
        await serving(workers, policy).behave(incoming(args))
    assert workers.calls == []
    return failed.value.code


@pytest.mark.parametrize("args", [TURN, LOOK], ids=["turn", "look"])
async def test_what_is_offered_is_carried_out(args: Body) -> None:
    workers = Behaving()
    served = serving(workers)
    running = asyncio.create_task(served.behave(incoming(args)))
    await workers.begun.wait()
    assert [one.caller for one in served] == ["rover"]
    workers.calls[0].end(RunState.SUCCEEDED)
    assert await running == {"outcome": "SUCCEEDED", "reason": ""}
    assert list(served) == []


@pytest.mark.parametrize(
    "change",
    [
        {"component": 7},
        {"behaviour": None},
        {"arguments": []},
        {"arguments": {"u": 7, "h": "rover"}},
        {"values": {}},
        {"values": [7]},
        {"values": [["seen", ["a"]]]},
        {"values": [["seen", [7], None]]},
        {"arguments": {"u": "mule__watcher__head"}},
        {"arguments": {**TURN["arguments"], "more": "x"}},  # type: ignore[dict-item]  # a table
    ],
    ids=str,
)
async def test_call_that_is_not_asked_in_full_is_malformed(change: dict[str, Any]) -> None:
    assert await refused({**TURN, **change}) == "CALL_MALFORMED"


async def test_value_that_is_no_message_is_refused() -> None:
    code = await refused({**TURN, "values": [["seen", ["a"], {"type": "nothing"}]]})
    assert code.startswith("MESSAGE_")


@pytest.mark.parametrize(
    "change",
    [
        {"component": "missing"},
        {"behaviour": "fly"},
        {"arguments": {"u": "mule__other__head", "h": "rover"}},
    ],
    ids=["component", "behaviour", "unit"],
)
async def test_what_is_not_offered_is_refused(change: dict[str, Any]) -> None:
    assert await refused({**TURN, **change}) == "NOT_OFFERED"


async def test_actuator_is_withheld_unless_it_is_offered() -> None:
    assert await refused(TURN, Policy()) == "NOT_OFFERED"


async def test_unit_serves_as_many_as_it_says() -> None:
    workers = Behaving()
    served = serving(workers)
    first = asyncio.create_task(served.behave(incoming(TURN)))
    await workers.begun.wait()
    with pytest.raises(CallFailed, match="UNIT_TAKEN"):
        await served.behave(incoming(TURN, "mule-2"))
    workers.calls[0].end(RunState.SUCCEEDED)
    await first
    workers.begun.clear()
    second = asyncio.create_task(served.behave(incoming(TURN, "mule-2")))
    await workers.begun.wait()
    workers.calls[1].end(RunState.SUCCEEDED)
    await second


async def test_values_are_passed_on_to_what_runs_for_their_caller_only() -> None:
    workers = Behaving()
    served = serving(workers)
    running = asyncio.create_task(served.behave(incoming(TURN)))
    await workers.begun.wait()
    values = {"component": "watcher", "values": [["seen", ["a"], None]]}
    served.values("another", values)
    served.values("rover", {**values, "component": "lamp"})
    assert workers.told == []
    served.values("rover", values)
    assert workers.told == [(("seen", ("a",), None),)]
    workers.calls[0].end(RunState.SUCCEEDED)
    await running
