"""States of a host, and the events by which it comes to them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from nondum.host.core.effects import Effect
from nondum.host.core.events.drives import DriveInserted, DriveRead
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    PayloadActivated,
    PayloadCopied,
    PayloadFailed,
    PayloadFound,
    PayloadRefused,
    PayloadStaged,
    PayloadVerified,
    PayloadWithdrawn,
    WheelsStored,
)
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.device import DeviceClaim
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.sdk.description import Fragment, PluginDescription
from nondum.sdk.errors import Problem

AT = Moment(1.0, 2.0)
PROBLEM = Problem("TEST", "made up")
OLDER = Problem("ROLLBACK", "made up")


def drive(name: str = "a", kind: str = "slot") -> DriveInserted:
    return DriveInserted(name, Path("/drives") / name, kind)


def found(
    key: str = "k1", drive: str = "a", *, payload_id: str = "org.x", release: int = 1
) -> PayloadFound:
    folder = Path("/drives") / drive / "nondum" / payload_id
    return PayloadFound(key, drive, folder, f"digest-{key}", payload_id, "1.0", release)


def component(
    id: str = "eye", payload: str = "k1", need: str = "", words: str = "", called: str = ""
) -> ComponentRecord:
    """A component that is `called` something else than its id on this host, and says `words`."""
    claims = (DeviceClaim("port", {"ID_MODEL": need}, False),) if need else ()
    return ComponentRecord(
        id=called or id,
        payload=payload,
        payload_id="org.x",
        distribution=id,
        entry_point=id,
        version="1.0",
        state=ComponentState.READY,
        description=PluginDescription(name=id, version="1.0", fragments=saying(words)),
        venv=Path("/v"),
        site_packages=Path("/v/s"),
        scratch=Path("/s"),
        rank=0,
        devices=claims,
    )


def saying(word: str) -> tuple[Fragment, ...]:
    """Fragments that tell one plugin's words from another's."""
    text = f"(define (domain {word}) (:predicates ({word} ?u - unit)))"
    return (Fragment(f"{word}.pddl", text),) if word else ()


def way_to_active(
    key: str = "k1",
    drive: str = "a",
    id: str = "eye",
    need: str = "",
    payload_id: str = "org.x",
    words: str = "",
    called: str = "",
) -> list[Event]:
    mounts = (MountPose(f"spot__{id}__camera", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "payload"),)
    return [
        found(key, drive, payload_id=payload_id),
        PayloadCopied(key),
        PayloadVerified(key, (id,)),
        PayloadStaged(key),
        WheelsStored(key, 1),
        ComponentsProbed(key),
        PayloadActivated(key, (component(id, key, need, words, called),), mounts),
    ]


def after(*happened: Event, state: HostState | None = None) -> tuple[HostState, list[Effect]]:
    state = state or HostState("spot")
    done: list[Effect] = []
    for event in happened:
        outcome = advance(state, event, AT)
        state = outcome.state
        done.extend(outcome.effects)
    return state, done


def active(id: str = "eye", need: str = "") -> HostState:
    return after(drive(), *way_to_active(id=id, need=need), DriveRead("a", ("k1",)))[0]


def at_step(step: Step) -> HostState:
    """A payload `k1` on drive `a`, at a step."""
    way = way_to_active()
    order = list(Step)[: list(Step).index(Step.ACTIVE) + 1]
    match step:
        case Step.GONE:
            return after(drive())[0]
        case Step.REMOVING:
            return after(drive(), *way, PayloadWithdrawn("k1", "test"))[0]
        case Step.SUPERSEDED:
            return after(drive("b"), *upgrade(), state=after(drive(), *way)[0])[0]
        case Step.REFUSED:
            return after(drive(), way[0], PayloadRefused("k1", (OLDER,)))[0]
        case Step.QUARANTINED:
            return after(drive(), *way[:5], PayloadFailed("k1", (PROBLEM,)))[0]
        case _:
            return after(drive(), *way[: order.index(step) + 1])[0]


def upgrade(key: str = "k2", drive: str = "b", release: int = 2, id: str = "eye") -> list[Event]:
    """What happens to a newer release of `k1` until it is active."""
    newer = found(key, drive, release=release)
    return [newer, *way_to_active(key, drive, id)[1:]]


def with_newer(state: HostState) -> HostState:
    """With a newer release of `k1` that is just being brought up."""
    old = state.payloads["k1"]
    newer = replace(old, key="k2", digest="newer", release=2, step=Step.STORED, components=())
    return replace(state, payloads={**state.payloads, newer.key: newer})
