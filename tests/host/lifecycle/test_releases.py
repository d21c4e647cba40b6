"""Which release of a payload is active, whatever is plugged, pulled, broken or asked for."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from tests.host.lifecycle.states import (
    AT,
    PROBLEM,
    active,
    after,
    component,
    drive,
    found,
    upgrade,
    way_to_active,
)
from tests.host.sources.devices.sightings import appeared

from nondum.host.core import effects
from nondum.host.core.effects import Effect
from nondum.host.core.events.drives import DriveRead, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Event
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    PayloadActivated,
    PayloadCleared,
    PayloadCopied,
    PayloadFailed,
    PayloadFound,
    PayloadStaged,
    PayloadVerified,
    RetryAsked,
    WheelsStored,
)
from nondum.host.core.events.releases import BesideRefused, RollbackAsked, TrialFailed
from nondum.host.core.events.workers import WorkerExited, WorkerFailed
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import releases
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.crash_attribution import ATTEMPTS
from nondum.host.lifecycle.recovery import recover
from nondum.sdk.description import Behaviour, Fragment, Phrase, PluginDescription, Unit

RELEASES = (1, 2, 3)
TAKEN_IN = (Step.SUPERSEDED, Step.STORED, Step.PROBED, Step.ACTIVE)


def upgraded(*, need: str = "") -> HostState:
    """Release 2 (`k2`, drive `b`) is active, release 1 (`k1`, drive `a`) waits."""
    newer = upgrade()
    entered = PayloadActivated("k2", (component("eye", "k2", need),))
    return after(drive("b"), *newer[:-1], entered, state=active(need=need))[0]


def steps(state: HostState) -> dict[str, Step]:
    return {key: payload.step for key, payload in state.payloads.items()}


def codes(state: HostState, key: str) -> list[str]:
    return [problem.code for problem in state.payloads[key].problems]


# Taking over


def test_newer_release_is_brought_up_beside_the_one_in_force() -> None:
    state, done = after(drive("b"), *upgrade()[:5], state=active())
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.STORED}
    assert effects.ProbeComponents("k2", beside="k1") in done
    assert state.components["eye"].payload == "k1"
    state, done = after(ComponentsProbed("k2"), state=state)
    assert done == [effects.ActivatePayload("k2", beside="k1")]


def test_it_takes_over_in_one_revision() -> None:
    before, _ = after(drive("b"), *upgrade()[:-1], state=active())
    outcome = advance(before, upgrade()[-1], AT)
    assert outcome.state.revision == before.revision + 1
    assert steps(outcome.state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE}
    assert outcome.state.components["eye"].payload == "k2"
    assert outcome.state.payloads["k2"].was == 1
    assert not outcome.state.former
    assert [event.name for event in outcome.events] == [
        "PayloadActivated",
        "PayloadSuperseded",
        "Recomposed",
    ]
    assert effects.RestPayload("k1", ("eye",)) in outcome.effects


def test_ranks_mounts_and_devices_are_kept() -> None:
    port = appeared("usb1", "/dev/x", ID_MODEL="PTU")
    rival = way_to_active("k9", "c", "arm", "PTU", payload_id="org.y")
    said = MountSet("spot__eye__camera", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    before, _ = after(port, drive("c"), *rival, said, state=active(need="PTU"))
    assert before.components["eye"].devices[0].device == "usb1"
    new = component("eye", "k2", "PTU")
    entered = PayloadActivated("k2", (new,))
    state, done = after(drive("b"), *upgrade()[:-1], entered, state=before)
    assert state.components["eye"].rank == before.components["eye"].rank
    assert state.components["eye"].devices[0].device == "usb1"
    assert state.components["arm"].devices[0].device is None
    assert effects.AttachDevice("eye", "port", state.devices["usb1"].nodes) in done
    assert state.mounts["spot__eye__camera"].origin == "person"


def test_device_goes_to_a_component_that_has_another_name_now() -> None:
    port = appeared("usb1", "/dev/x", ID_MODEL="PTU")
    rival = way_to_active("k9", "c", "arm", "PTU", payload_id="org.y")
    before, _ = after(port, drive("c"), *rival, state=active(need="PTU"))
    entered = PayloadActivated("k2", (component("gaze", "k2", "PTU"),))
    newer = upgrade(id="gaze")
    state, _ = after(drive("b"), *newer[:-1], entered, state=before)
    assert state.components["gaze"].devices[0].device == "usb1"
    assert set(state.components) == {"gaze", "arm"}


# Failing


@pytest.mark.parametrize(
    "event",
    [
        PayloadFailed("k2", (PROBLEM,)),
        TrialFailed("k2", "eye", (PROBLEM,)),
    ],
    ids=lambda event: event.name,
)
def test_release_that_fails_while_it_is_watched_leaves_the_old_one_alone(event: Event) -> None:
    before, _ = after(drive("b"), *upgrade()[:6], state=active())
    state, done = after(event, state=before)
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.QUARANTINED}
    assert state.components == before.components
    assert state.revision == before.revision
    assert done == [effects.SuspendPayload("k2", ("eye",))]


def test_worker_of_the_one_in_force_may_restart_meanwhile() -> None:
    before, _ = after(drive("b"), *upgrade()[:6], state=active())
    state, _ = after(WorkerExited("eye", "signal 9", "k1"), state=before)
    assert state.components["eye"].state is ComponentState.RESTARTING
    assert steps(state)["k2"] is Step.PROBED


def test_release_that_fails_as_it_takes_over_gives_way() -> None:
    failed = TrialFailed("k2", "eye", (PROBLEM,))
    state, _ = after(failed, state=upgraded())
    assert steps(state) == {"k1": Step.STORED, "k2": Step.QUARANTINED}


def test_old_worker_that_ends_as_it_is_replaced_is_no_news() -> None:
    state = upgraded()
    for event in (
        WorkerExited("eye", "signal 9", "k1"),
        WorkerFailed("eye", (PROBLEM,), "k1"),
    ):
        assert after(event, state=state) == (state, [])


def test_release_that_breaks_later_gives_way_to_the_one_before() -> None:
    state, done = after(WorkerFailed("eye", (PROBLEM,), "k2"), state=upgraded())
    assert steps(state) == {"k1": Step.STORED, "k2": Step.QUARANTINED}
    assert done == [effects.SuspendPayload("k2", ("eye",)), effects.ProbeComponents("k1")]


def test_release_that_cannot_run_beside_the_other_one_takes_its_place_first() -> None:
    before, _ = after(drive("b"), *upgrade()[:5], state=active())
    state, done = after(BesideRefused("k2", "no memory"), state=before)
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.STORED}
    assert set(done) == {
        effects.RestPayload("k1", ("eye",)),
        effects.ProbeComponents("k2", after="k1"),
    }
    state, done = after(PayloadFailed("k2", (PROBLEM,)), state=state)
    assert steps(state) == {"k1": Step.STORED, "k2": Step.QUARANTINED}
    assert effects.ProbeComponents("k1") in done


# What it says to planning


def says(predicate: str, *, phrase: str = "known") -> PluginDescription:
    """An eye whose action makes `predicate` true, and that declares `known`."""
    domain = f"""(define (domain eye)
        (:predicates (known ?h - host))
        (:action look :parameters (?u - camera ?h - host)
                      :precondition (ready ?u) :effect ({predicate} ?h)))"""
    return PluginDescription(
        name="eye",
        version="1.0",
        behaviours=(Behaviour("look", "(look ?u - camera ?h - host)"),),
        fragments=(Fragment("domain.pddl", domain),),
        units=(Unit("eye", "camera"),),
        phrases=(Phrase("look around", f"({phrase} self)"),),
    )


def saying(key: str, description: PluginDescription) -> list[Event]:
    """The way of a release of the eye whose index says that."""
    way = way_to_active() if key == "k1" else upgrade(key)
    entered = replace(component("eye", key), description=description)
    way[2] = PayloadVerified(key, ("eye",), {"eye": description})
    way[-1] = PayloadActivated(key, (entered,))
    return way


@pytest.mark.parametrize(
    ("description", "code"),
    [(says("knwon"), "PDDL_UNKNOWN"), (says("known", phrase="knwon"), "PHRASE_INVALID")],
    ids=["fragment", "phrase"],
)
def test_release_that_cannot_be_planned_with_is_refused_where_the_old_one_could(
    description: PluginDescription, code: str
) -> None:
    before, _ = after(drive("a"), *saying("k1", says("known")))
    state, done = after(drive("b"), *saying("k2", description)[:3], state=before)
    assert codes(state, "k2") == [code]
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.REFUSED}
    assert state.components == before.components
    assert done[-1] == effects.ClearPayload("k2")


def test_release_is_not_blamed_for_what_was_wrong_before() -> None:
    before, _ = after(drive("a"), *saying("k1", says("knwon")))
    state, _ = after(drive("b"), *saying("k2", says("knwon")), state=before)
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE}


def test_first_release_is_taken_though_it_cannot_be_planned_with() -> None:
    """It may do something all the same; there is none that it would replace."""
    state, _ = after(drive("a"), *saying("k1", says("knwon")))
    assert steps(state) == {"k1": Step.ACTIVE}


def test_release_that_keeps_another_payload_out_of_planning_is_refused() -> None:
    """It says a word otherwise than the other one, and comes before it."""
    heard = "(define (domain more) (:predicates (heard {})))"
    other = PluginDescription("audio", "1", fragments=(Fragment("m", heard.format("?h - host")),))
    way = way_to_active("k9", "c", "audio", payload_id="org.y")
    entered = replace(component("audio", "k9"), description=other)
    way[-1] = PayloadActivated("k9", (entered,))
    before, _ = after(drive("a"), *saying("k1", says("known")), drive("c"), *way)
    more = Fragment("more.pddl", heard.format("?h - host ?of - host"))
    unlike = replace(says("known"), fragments=(*says("known").fragments, more))
    state, _ = after(drive("b"), *saying("k2", unlike)[:3], state=before)
    assert codes(state, "k2") == ["PDDL_ARITY"]
    assert steps(state)["k1"] is Step.ACTIVE


def test_release_that_came_first_gives_way_to_an_older_one_that_can_be_planned_with() -> None:
    """Both are plugged in at once, so the newer one is brought up before any is active."""
    older, newer = saying("k1", says("known")), saying("k2", says("knwon"))
    both = drive("a"), drive("b"), older[0], newer[0], *newer[1:5], *older[1:5]
    waiting, _ = after(*both)
    assert steps(waiting) == {"k1": Step.SUPERSEDED, "k2": Step.STORED}
    state, _ = after(*newer[5:], state=waiting)
    assert codes(state, "k2") == ["PDDL_UNKNOWN"]
    assert steps(state) == {"k1": Step.STORED, "k2": Step.QUARANTINED}


# Pulling


def test_pulled_release_gives_way_to_the_one_that_waits() -> None:
    state, done = after(DriveRemoved("b"), state=upgraded())
    assert steps(state) == {"k1": Step.STORED, "k2": Step.REMOVING}
    assert effects.ProbeComponents("k1") in done


def test_old_drive_may_be_pulled_during_the_bring_up() -> None:
    before, _ = after(drive("b"), *upgrade()[:5], state=active())
    state, _ = after(DriveRemoved("a"), *upgrade()[5:], state=before)
    assert steps(state) == {"k1": Step.REMOVING, "k2": Step.ACTIVE}


def test_release_that_comes_during_a_bring_up_waits_for_its_turn() -> None:
    before, _ = after(drive("b"), *upgrade()[:5], state=active())
    third = upgrade("k3", "c", 3)
    state, done = after(drive("c"), *third[:5], state=before)
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.STORED, "k3": Step.SUPERSEDED}
    assert not any(isinstance(e, effects.ProbeComponents) and e.payload == "k3" for e in done)
    state, done = after(*upgrade()[5:], state=state)
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE, "k3": Step.STORED}
    assert effects.ProbeComponents("k3", beside="k2") in done


def test_same_release_with_other_content_never_waits_beside() -> None:
    """Both are plugged in before one of them was active."""
    both = drive("a"), drive("b"), found("k1", "a"), found("k2", "b")
    state, _ = after(*both, *way_to_active()[1:])
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.REFUSED}
    assert codes(state, "k2") == ["RELEASE_CONFLICT"]


# For which fleet: that is the signer's word in each release


FLEETS = pytest.mark.parametrize(("one", "other"), [("", "survey"), ("survey", ""), ("a", "b")])


def for_fleet(fleet: str, key: str, drive: str, release: int) -> PayloadFound:
    return replace(found(key, drive, release=release), fleet=fleet)


@FLEETS
def test_older_release_does_not_come_in_by_naming_another_fleet(one: str, other: str) -> None:
    entered = drive("a"), for_fleet(one, "k9", "a", 9), *way_to_active("k9")[1:]
    gone = DriveRemoved("a"), PayloadCleared("k9")
    state, _ = after(*entered, *gone, drive("b"), for_fleet(other, "k3", "b", 3))
    assert codes(state, "k3") == ["ROLLBACK"]
    assert state.highwater["org.x"].release == 9


@FLEETS
def test_releases_of_one_payload_for_several_fleets_take_over_from_each_other(
    one: str, other: str
) -> None:
    entered = drive("a"), for_fleet(one, "k1", "a", 1), *way_to_active()[1:]
    newer = drive("b"), for_fleet(other, "k2", "b", 2), *upgrade()[1:]
    state, done = after(*entered, *newer)
    assert effects.ProbeComponents("k2", beside="k1") in done
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE}
    back, _ = after(RollbackAsked("k1", 1, 2), *way_to_active()[5:], state=state)
    assert steps(back) == {"k1": Step.ACTIVE, "k2": Step.SUPERSEDED}
    assert back.highwater["org.x"].release == 2


@FLEETS
def test_one_release_for_two_fleets_has_one_content(one: str, other: str) -> None:
    both = drive("a"), drive("b"), for_fleet(one, "k1", "a", 1), for_fleet(other, "k2", "b", 1)
    state, _ = after(*both)
    assert codes(state, "k2") == ["RELEASE_CONFLICT"]


# Going back


def test_person_goes_back_and_the_newer_one_waits() -> None:
    state, done = after(RollbackAsked("k1", 1, 2), state=upgraded())
    assert steps(state) == {"k1": Step.STORED, "k2": Step.ACTIVE}
    assert done == [effects.ProbeComponents("k1", beside="k2")]
    back, _ = after(*way_to_active()[5:], state=state)
    assert steps(back) == {"k1": Step.ACTIVE, "k2": Step.SUPERSEDED}
    assert back.payloads["k1"].was == 2
    assert back.highwater["org.x"].release == 2, "one is as protected as before"


def gone_back() -> HostState:
    asked = RollbackAsked("k1", 1, 2)
    return after(asked, *way_to_active()[5:], state=upgraded())[0]


def test_going_back_outlives_the_daemon() -> None:
    state, _ = after(*way_to_active()[5:], state=recover(gone_back(), AT).state)
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.SUPERSEDED}


def test_still_newer_release_counts_again() -> None:
    third = upgrade("k3", "c", 3)
    state, _ = after(drive("c"), *third, state=gone_back())
    assert steps(state)["k3"] is Step.ACTIVE


def test_retry_goes_forward_again() -> None:
    state, done = after(RetryAsked("k2"), state=gone_back())
    assert done == [effects.ProbeComponents("k2", beside="k1")]
    assert not state.rollbacks


def test_newer_release_that_is_plugged_in_again_counts_again() -> None:
    pulled, _ = after(DriveRemoved("b"), PayloadCleared("k2"), state=gone_back())
    state, _ = after(drive("b"), *upgrade(), state=pulled)
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE}


def test_refused_older_release_is_let_pass_once() -> None:
    refused, _ = after(DriveRemoved("a"), PayloadCleared("k1"), state=upgraded())
    refused, _ = after(drive("a"), found(), DriveRead("a", ("k1",)), state=refused)
    assert codes(refused, "k1") == ["ROLLBACK"]
    target = releases.can_go_back_to(refused, refused.payloads["k2"])
    assert target is not None
    assert target.key == "k1"
    asked = RollbackAsked("k1", 1, 2)
    state, done = after(asked, PayloadCleared("k1"), state=refused)
    assert "a" in [one.drive for one in done if isinstance(one, effects.ReadDrive)]
    state, _ = after(*way_to_active(), state=state)
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.SUPERSEDED}
    again, _ = after(DriveRemoved("a"), PayloadCleared("k1"), state=state)
    again, _ = after(drive("a"), found(), state=again)
    assert codes(again, "k1") == ["ROLLBACK"], "it was let pass once"


def test_what_is_refused_for_more_than_its_age_is_not_let_pass() -> None:
    state = upgraded()
    worse = replace(
        state.payloads["k1"],
        step=Step.REFUSED,
        problems=(PROBLEM, replace(PROBLEM, code=releases.OVERRULED)),
    )
    state = replace(state, payloads={**state.payloads, "k1": worse})
    assert releases.can_go_back_to(state, state.payloads["k2"]) is None
    assert after(RollbackAsked("k1", 1, 2), state=state) == (state, [])


# Crashing


def test_after_a_crash_the_one_in_force_comes_first() -> None:
    before, _ = after(drive("b"), *upgrade()[:6], state=active())
    outcome = recover(before, AT)
    assert steps(outcome.state) == {"k1": Step.STORED, "k2": Step.SUPERSEDED}
    assert outcome.effects == (effects.ProbeComponents("k1"),)
    state, done = after(*way_to_active()[5:], state=outcome.state)
    assert effects.ProbeComponents("k2", beside="k1") in done
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.STORED}


# Whatever happens


def key(release: int) -> str:
    return f"k{release}"


def name(release: int) -> str:
    return f"d{release}"


class Releases(RuleBasedStateMachine):
    """One payload in three releases on three drives. What the host wants done is done in any order
    across payloads, in the order given for each; each release may turn out not to work."""

    @initialize(broken=st.sets(st.sampled_from(RELEASES)), alone=st.booleans())
    def begin(self, broken: set[int], alone: bool) -> None:
        self.state = HostState("spot")
        self.broken, self.alone = broken, alone
        self.todo: list[Effect] = []
        self.plugged: set[int] = set()
        self.crashes = 0

    def happen(self, event: Event) -> None:
        outcome = advance(self.state, event, AT)
        self.state = outcome.state
        self.todo.extend(outcome.effects)

    # What people do

    @rule(release=st.sampled_from(RELEASES))
    def plug(self, release: int) -> None:
        if release not in self.plugged:
            self.plugged.add(release)
            self.happen(drive(name(release)))

    @rule(release=st.sampled_from(RELEASES))
    def pull(self, release: int) -> None:
        if release in self.plugged:
            self.plugged.remove(release)
            self.todo = [e for e in self.todo if getattr(e, "drive", "") != name(release)]
            self.happen(DriveRemoved(name(release)))

    @rule(release=st.sampled_from(RELEASES))
    def retry(self, release: int) -> None:
        self.happen(RetryAsked(key(release)))

    @rule()
    def roll_back(self) -> None:
        for payload in tuple(self.state.payloads.values()):
            if payload.step is Step.ACTIVE:
                target = releases.can_go_back_to(self.state, payload)
                if target is not None:
                    asked = RollbackAsked(target.key, target.release, payload.release)
                    self.happen(asked)

    # What happens by itself

    @rule(release=st.sampled_from(RELEASES))
    def break_down(self, release: int) -> None:
        """Supervision gives a worker up."""
        payload = self.state.payloads.get(key(release))
        if payload is not None and payload.step in (Step.PROBED, Step.ACTIVE):
            is_tried = payload.step is Step.PROBED
            fell = TrialFailed(payload.key, "eye", (PROBLEM,))
            gone = WorkerFailed("eye", (PROBLEM,), payload.key)
            self.happen(fell if is_tried else gone)

    @rule(release=st.sampled_from(RELEASES))
    def mend(self, release: int) -> None:
        self.broken.discard(release)

    @precondition(lambda self: self.crashes < ATTEMPTS - 1)
    @rule()
    def crash(self) -> None:
        self.crashes += 1
        outcome = recover(self.state, AT)
        self.state, self.todo = outcome.state, list(outcome.effects)
        for release in sorted(self.plugged):
            self.happen(drive(name(release)))
        self.happen(DrivesScanned("slot", tuple(map(name, sorted(self.plugged)))))

    @precondition(lambda self: self.todo)
    @rule(which=st.integers(0, 20))
    def work(self, which: int) -> None:
        """Carry out some effect that is the next one in its lane."""
        effect = self.todo[which % len(self.todo)]
        payload = getattr(effect, "payload", None)
        first = next(e for e in self.todo if getattr(e, "payload", None) == payload)
        self.carry_out(first if payload else effect)

    def carry_out(self, effect: Effect) -> None:
        self.todo.remove(effect)
        match effect:
            case effects.ReadDrive(drive=where):
                release = int(where[1:])
                self.happen(found(key(release), where, release=release))
                self.happen(DriveRead(where, (key(release),)))
            case effects.CopyPayload(payload=payload):
                self.happen(PayloadCopied(payload))
            case effects.VerifyPayload(payload=payload):
                self.happen(PayloadVerified(payload, ("eye",)))
            case effects.StagePayload(payload=payload):
                self.happen(PayloadStaged(payload))
            case effects.StoreWheels(payload=payload):
                self.happen(WheelsStored(payload, 1))
            case effects.ProbeComponents(payload=payload, beside=beside):
                self.probe(payload, is_beside=bool(beside))
            case effects.ActivatePayload(payload=payload):
                entered = component("eye", payload)
                self.happen(PayloadActivated(payload, (entered,)))
            case effects.ClearPayload(payload=payload):
                self.happen(PayloadCleared(payload))

    def probe(self, payload: str, *, is_beside: bool) -> None:
        if is_beside and self.alone:
            self.happen(BesideRefused(payload, "test"))
        elif int(payload[1:]) in self.broken:
            self.happen(PayloadFailed(payload, (PROBLEM,)))
        else:
            self.happen(ComponentsProbed(payload))

    # What holds

    @invariant()
    def one_at_most_is_active(self) -> None:
        if not hasattr(self, "state"):
            return
        active_keys = [p.key for p in self.state.payloads.values() if p.step is Step.ACTIVE]
        starting = [p for p in self.state.payloads.values() if p.step in releases.STARTING]
        assert len(active_keys) <= 1
        assert len(starting) <= 1
        assert [c.payload for c in self.state.components.values()] == active_keys

    def teardown(self) -> None:
        """In the end the highest that is here and works is active, and nothing else is left."""
        if not hasattr(self, "state"):
            return
        while self.todo:
            self.carry_out(self.todo[0])
        present = self.state.payloads
        assert {p.key for p in present.values()} == {key(release) for release in self.plugged}
        works = [p for p in present.values() if p.step in TAKEN_IN]
        assert all(p.step in (Step.ACTIVE, Step.SUPERSEDED) for p in works)
        if works:
            best = max(works, key=self.precedence)
            assert best.step is Step.ACTIVE
        else:
            assert not self.state.components
        for release in sorted(self.plugged):
            self.pull(release)
        while self.todo:
            self.carry_out(self.todo[0])
        assert not self.state.payloads
        assert not self.state.components
        assert not self.state.rollbacks
        assert not self.state.drives

    def precedence(self, payload: PayloadRecord) -> tuple[int, bool]:
        return releases.precedence(self.state, payload)


# 25 in the full run, 250 in a campaign: an example is forty steps.
Releases.TestCase.settings = settings(
    max_examples=settings().max_examples // 4, stateful_step_count=40
)
TestReleases = Releases.TestCase
