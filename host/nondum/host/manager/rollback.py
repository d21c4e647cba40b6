"""Going back to the release before: what an operator orders, and how it ends."""

from __future__ import annotations

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.bus import Bus
from nondum.host.core.events.releases import RollbackAsked
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.core.unknown import unknown
from nondum.host.lifecycle import releases
from nondum.host.manager.watch import Watch
from nondum.sdk.errors import InstallFailed, Problem


def target_of(state: HostState, payload_id: str) -> tuple[PayloadRecord, PayloadRecord]:
    """The active release of a payload, and the one before it.

    Raises `InstallFailed` (PAYLOAD_UNKNOWN, ROLLBACK_BUSY, ROLLBACK_NOTHING).
    """
    mine = [p for p in state.payloads.values() if p.payload_id == payload_id]
    if not mine:
        known = {payload.payload_id for payload in state.payloads.values()}
        raise InstallFailed(unknown("payload", payload_id, known))
    active = next((payload for payload in mine if payload.step is Step.ACTIVE), None)
    if active is None or any(payload.step in releases.STARTING for payload in mine):
        raise InstallFailed(_busy(payload_id))
    target = releases.can_go_back_to(state, active)
    if target is None:
        raise InstallFailed(_nothing(active))
    return active, target


async def go_back(payload_id: str, catalogue: Catalogue, bus: Bus) -> PayloadRecord:
    """Go back to the release before and wait until it is active.

    Raises `InstallFailed`: the reason why not, and then the newer one stays.
    """
    active, target = target_of(catalogue.state, payload_id)
    asked = RollbackAsked(target.key, target.release, active.release)
    with Watch(catalogue, bus) as watch:
        bus.emit(asked)
        await watch.until(lambda state: _is_wanted(state, target) or None)
        return await watch.until(lambda state: _settled(state, target))


def _is_wanted(state: HostState, target: PayloadRecord) -> bool:
    back = state.rollbacks.get(target.payload_id)
    return back is not None and back.digest == target.digest


def _settled(state: HostState, target: PayloadRecord) -> PayloadRecord | None:
    payload = state.payloads.get(target.key)
    if payload is not None and payload.step in (Step.REFUSED, Step.QUARANTINED):
        raise InstallFailed(*payload.problems)
    if payload is not None and payload.step is Step.ACTIVE:
        return payload
    if not _is_wanted(state, target):
        text, fix = "its drive was pulled, or a newer release came", "plug it in and ask again"
        raise InstallFailed(Problem("ROLLBACK_ENDED", text, where=target.payload_id, fix=fix))
    return None


def _busy(payload_id: str) -> Problem:
    fix = "wait until `nondum status` shows it active, and ask again"
    return Problem("ROLLBACK_BUSY", "it is just being brought up", where=payload_id, fix=fix)


def _nothing(active: PayloadRecord) -> Problem:
    return Problem(
        "ROLLBACK_NOTHING",
        "there is no earlier release to go back to",
        where=active.payload_id,
        need=f"one before release {active.release}, plugged in or installed",
        have="none",
        fix="plug the earlier one in beside it (it is refused as ROLLBACK), and ask again",
    )
