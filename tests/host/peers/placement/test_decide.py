"""Which payloads are to run elsewhere, and who is asked first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.peers.placement.decide import (
    ELSEWHERE,
    OTHERS_MAY_FIT,
    Candidate,
    Parcel,
    movable_source,
    parcels,
    ranked,
)
from nondum.sdk.errors import Problem
from nondum.transport.peers import PeerKey

SLOT = DriveRecord("a", "slot", Path("/slots/a"))
LIGHT = "org.example.light"
HERE = {"machine": "i686", "python": "3.11.2", "memory_mb": 4000, "gpu_memory_mb": None}


def problem(code: str, need: str = "") -> Problem:
    return Problem(code, "is lacking", need=need)


def payload(step: Step = Step.REFUSED, *codes: str) -> PayloadRecord:
    return PayloadRecord(
        key="k1",
        digest="k1" * 32,
        payload_id=LIGHT,
        version="1.0",
        release=1,
        fleet="",
        step=step,
        sources={"a": SLOT.root / "nondum" / LIGHT},
        phases={},
        problems=tuple(map(problem, codes)),
    )


def host(*payloads: PayloadRecord, drive: DriveRecord = SLOT) -> HostState:
    return HostState("rover", drives={"a": drive}, payloads={p.key: p for p in payloads})


def parcel(*codes: str, pinned_to: str = "") -> Parcel:
    found = parcels(host(payload(Step.REFUSED, *codes)), {LIGHT: pinned_to} if pinned_to else {})
    return found["k1"]


def peer(name: str, **compute: Any) -> Candidate:
    return Candidate(PeerKey(name), name, 1, {"place": True, **compute})


def order(one: Parcel, *peers: Candidate) -> list[str]:
    return [candidate.host for candidate in ranked(peers, one, HERE)]


# What is to run elsewhere


@pytest.mark.parametrize("code", sorted(OTHERS_MAY_FIT))
def test_what_another_machine_may_have_is_looked_for(code: str) -> None:
    assert parcels(host(payload(Step.REFUSED, code)), {}).keys() == {"k1"}


@pytest.mark.parametrize("code", ["SIG_MISSING", "HASH_MISMATCH", "ROLLBACK"])
def test_what_is_wrong_or_not_trusted_is_not_handed_on(code: str) -> None:
    refused = payload(Step.REFUSED, "NO_MEMORY", code)
    assert not parcels(host(refused), {})
    assert not parcels(host(refused), {LIGHT: "mule"})


@pytest.mark.parametrize("step", [s for s in Step if s is not Step.REFUSED])
def test_what_was_not_refused_stays(step: Step) -> None:
    assert not parcels(host(payload(step)), {})


@pytest.mark.parametrize(
    "step", [s for s in Step if s not in (Step.REFUSED, Step.REMOVING, Step.GONE)]
)
def test_what_a_person_wants_elsewhere_goes_there(step: Step) -> None:
    (found,) = parcels(host(payload(step)), {LIGHT: "mule"}).values()
    assert found.pinned_to == "mule"


def test_what_went_away_comes_back_with_the_pin() -> None:
    gone = payload(Step.REFUSED, ELSEWHERE)
    assert parcels(host(gone), {LIGHT: "mule"})
    assert not parcels(host(gone), {})


@pytest.mark.parametrize("kind", ["placed", "installed"])
def test_what_was_placed_or_installed_here_stays(kind: str) -> None:
    state = host(payload(Step.REFUSED, "NO_MEMORY"), drive=replace(SLOT, kind=kind))
    assert not parcels(state, {LIGHT: "mule"})


def test_what_is_not_plugged_in_cannot_be_handed_over() -> None:
    state = replace(host(payload(Step.REFUSED, "NO_MEMORY")), drives={})
    assert movable_source(state.payloads["k1"], state) is None
    assert not parcels(state, {})


def test_people_are_told_what_is_needed() -> None:
    refused = replace(
        payload(), problems=(problem("NO_MEMORY", "9 MB"), problem("DISK_FULL", "9 MB"))
    )
    (found,) = parcels(host(refused), {}).values()
    assert found.why == "needs 9 MB"


# Who is asked


def test_host_that_takes_nothing_is_not_asked() -> None:
    closed = Candidate(PeerKey("mule"), "mule", 1, {"memory_mb": 99_000})
    assert order(parcel("NO_MEMORY"), closed, peer("tower")) == ["tower"]


def test_host_with_more_memory_is_asked_first() -> None:
    small, large = peer("mule", memory_mb=8_000), peer("tower", memory_mb=64_000)
    assert order(parcel("NO_MEMORY"), small, large) == ["tower", "mule"]


def test_host_with_another_kind_of_gpu_is_asked_first_when_that_is_lacking() -> None:
    roomy = peer("mule", memory_mb=64_000, gpu_kinds=["opencl"])
    cuda, odd = peer("tower", gpu_kinds=["cuda"]), peer("odd", gpu_kinds=7)
    here = {**HERE, "gpu_kinds": ["opencl"]}
    first, *others = ranked((roomy, odd, cuda), parcel("NO_GPU_KIND"), here)
    assert first.host == "tower"
    assert [candidate.host for candidate in others] == ["mule", "odd"]


def test_host_with_a_gpu_is_asked_first_when_one_is_lacking() -> None:
    roomy, gpu = peer("mule", memory_mb=64_000), peer("tower", gpu_memory_mb=8_000)
    assert order(parcel("NO_GPU_MEMORY"), roomy, gpu) == ["tower", "mule"]
    assert order(parcel("NO_MEMORY"), roomy, gpu) == ["mule", "tower"]


def test_other_machine_is_asked_first_when_wheels_do_not_fit() -> None:
    same = peer("mule", machine="i686", python="3.11.2", memory_mb=64_000)
    other = peer("tower", machine="aarch64", python="3.11.2", memory_mb=1_000)
    assert order(parcel("WHEEL_INCOMPATIBLE"), same, other) == ["tower", "mule"]


def test_pin_leaves_one_host() -> None:
    one = parcel(ELSEWHERE, pinned_to="mule")
    assert order(one, peer("tower"), peer("mule")) == ["mule"]
    assert order(one, peer("tower")) == []


words = st.sampled_from(
    ["place", "memory_mb", "gpu_memory_mb", "gpu_kinds", "machine", "python", "disk_mb"]
)
values = st.one_of(st.none(), st.booleans(), st.floats(), st.integers(), st.text(max_size=3))


@given(st.lists(st.dictionaries(words, values)), st.sets(st.sampled_from(sorted(OTHERS_MAY_FIT))))
def test_whatever_peers_say_some_order_comes_of_it(
    said: list[dict[str, Any]], codes: set[str]
) -> None:
    peers = [
        Candidate(PeerKey(str(number)), f"host-{number}", 1, compute)
        for number, compute in enumerate(said)
    ]
    asked = order(parcel(*(codes or {"NO_MEMORY"})), *peers)
    assert sorted(asked) == sorted(p.host for p in peers if p.compute.get("place") is True)
    assert asked == order(parcel(*(codes or {"NO_MEMORY"})), *reversed(peers))
