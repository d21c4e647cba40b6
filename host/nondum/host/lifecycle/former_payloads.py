"""What is remembered of payloads that were active and are gone, so that advice can name them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.host.catalogue.rows import as_json
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.payload import FormerPayload, PayloadRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.sdk.description import PluginDescription

PAYLOADS_LIMIT = 200
"""Payloads that are remembered, at most."""
SIZE_LIMIT = 4 * 1024**2
"""What they said of themselves is together no longer than this, as JSON."""


def remembering(
    former: Mapping[str, FormerPayload],
    payload: PayloadRecord,
    components: Iterable[ComponentRecord],
    wall_s: float,
) -> dict[str, FormerPayload]:
    """What is remembered once a payload has left with its components: beyond the limits those that
    left first are forgotten."""
    described = {component.id: component.description for component in components}
    new = _former(payload.payload_id, payload.version, described, wall_s)
    return _within_limits(former, [new])


def remembering_peer(
    former: Mapping[str, FormerPayload],
    host: str,
    components: Iterable[PeerComponent],
    wall_s: float,
) -> dict[str, FormerPayload]:
    """What is remembered once a peer, or some of what it offered, is gone."""
    payloads: dict[tuple[str, str], dict[str, PluginDescription]] = {}
    for component in components:
        known = payloads.setdefault((component.payload_id, component.version), {})
        known[component.id] = component.description
    new = (
        _former(payload_id, version, described, wall_s, host)
        for (payload_id, version), described in payloads.items()
    )
    return _within_limits(former, list(new))


def _former(
    payload_id: str,
    version: str,
    described: Mapping[str, PluginDescription],
    wall_s: float,
    host: str = "",
) -> FormerPayload:
    return FormerPayload(payload_id, version, described, wall_s, len(as_json(described)), host)


def _within_limits(
    former: Mapping[str, FormerPayload], new: list[FormerPayload]
) -> dict[str, FormerPayload]:
    """As many of the last as the limits allow; one that is too large displaces no others.

    The payload that left last comes last: clocks jump, and do not show the order.
    """
    gone = {one.key for one in new}
    ordered = [*(one for key, one in former.items() if key not in gone), *new]
    kept: list[FormerPayload] = []
    left = SIZE_LIMIT
    for payload in reversed(ordered):
        if payload.size <= left and len(kept) < PAYLOADS_LIMIT:
            kept.append(payload)
            left -= payload.size
    return {one.key: one for one in reversed(kept)}
