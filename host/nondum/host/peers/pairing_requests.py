"""Where a person pairs this host with another: one window at a time, and what is shown of it."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator, Callable, Iterable, Mapping, Sequence
from typing import Protocol

from nondum.host.core.row import Row
from nondum.host.peers.trust_store import PeerTrustStore
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, fingerprint
from nondum.transport.peers.pairing_channel import PairingHost
from nondum.transport.peers.pairing_state import (
    Agreed,
    Comparing,
    Failed,
    Idle,
    PairingState,
    Waiting,
)
from nondum.transport.peers.refusals import Refusal

LOOK_S = 0.25
"""Seconds between two looks for hosts that can be paired, while no pairing runs."""

log = logging.getLogger(__name__)


class Hint(Protocol):
    """What discovery says of another host; none of it is proved."""

    @property
    def key(self) -> PeerKey: ...

    @property
    def name(self) -> str: ...

    @property
    def addresses(self) -> Sequence[str]:
        """Where it may listen for peers, `tcp://HOST:PORT`: the port is another for pairing."""

    @property
    def pairing_port(self) -> int | None:
        """Where it can be asked, while it can be paired."""


@frozen
class Candidate:
    """A host whose person has a window open, too."""

    key: PeerKey
    name: str
    addresses: tuple[str, ...]


class PairingRequests:
    """Opens the pairing window, finds the other host, and adds the paired host to the trust
    store."""

    def __init__(
        self,
        trust_store: PeerTrustStore,
        *,
        announce: Callable[[int | None], None],
        candidates: Callable[[], Iterable[Hint]],
        known: Callable[[], Mapping[PeerKey, str]] = dict,
        address: str = "tcp://*:*",
        is_development: bool = False,
    ) -> None:
        """`announce` tells the network at which port this host can be asked, and when it cannot
        any more (None); `candidates` gives what is known of others now, `known` the names of hosts
        that are here. `address` is where to be asked, as ZeroMQ binds it."""
        self._address = address
        self._trust_store, self._announce, self._candidates = trust_store, announce, candidates
        self._known = known
        self._is_development = is_development
        self._window: _Window | None = None

    async def pair(self, wanted: str | None = None) -> AsyncGenerator[Row, None]:
        """Open the window, and tell how it stands whenever that changes, until it is closed.

        `wanted` is the name, fingerprint or key of the only host to be paired with. The window is
        closed when the caller stops iterating. Rows are those of `row`. Raises `PeerRefused`
        (PAIRING_OPEN, PAIRING_DEVELOPMENT, ADDRESS_UNUSABLE).
        """
        if self._window is not None:
            told = "somebody is pairing this host already"
            fix = "confirm there, or with `nondum peers pair --yes-code CODE`"
            raise PeerRefused(Problem("PAIRING_OPEN", told, fix=fix))
        window = self._window = _Window(
            self._trust_store, wanted, self._known, is_development=self._is_development
        )
        try:
            self._announce(window.host.open(self._address))
            last: Row = {}
            while True:
                window.look(self._candidates())
                row = window.row()
                if _lasting(row) != _lasting(last):
                    last = row
                    yield row
                if window.is_over:
                    return
                await window.changed()
        finally:
            self._window = None
            self._announce(None)
            await window.close()

    def row(self) -> Row | None:
        """How the window stands; None while there is none.

        `step` is waiting, comparing, confirmed (here, not yet there), agreed or failed; `code`,
        `name` and `fingerprint` are of the host that it is compared with; `candidates` those that
        could be, with `name` and `fingerprint`, while none is; `problem` what went wrong last.
        """
        return self._window.row() if self._window else None

    def confirm(self, code: str) -> None:
        """The person sees this code on both hosts. Raises `PeerRefused` (PAIRING_ORDER,
        PAIRING_CODE)."""
        self._open_window().host.confirm(code)

    async def ended(self) -> Row:
        """Wait for the end of the window, and tell how it stands then.

        Raises `PeerRefused` (PAIRING_ORDER).
        """
        window = self._open_window()
        while not window.is_over:
            await window.changed()
        return window.row()

    def refuse(self) -> None:
        """The person says no, and closes the window. Raises `PeerRefused` (PAIRING_ORDER)."""
        self._open_window().host.refuse()

    def _open_window(self) -> _Window:
        if self._window is None:
            told = "no pairing of this host is open"
            fix = "begin with `nondum peers pair` on both hosts"
            raise PeerRefused(Problem("PAIRING_ORDER", told, fix=fix))
        return self._window


class _Window:
    """One pairing window, from its opening until the paired host is stored."""

    def __init__(
        self,
        trust_store: PeerTrustStore,
        wanted: str | None,
        known: Callable[[], Mapping[PeerKey, str]],
        *,
        is_development: bool,
    ) -> None:
        self._trust_store, self._wanted, self._known = trust_store, wanted, known
        self._found: Mapping[PeerKey, Candidate] = {}
        self._asked: Candidate | None = None
        self._news = asyncio.Event()
        self._keeping: asyncio.Task[None] | None = None
        self._shown: PairingState = Idle()
        """The state of the host, except that a paired host is stored before it is shown."""
        identity = trust_store.identity(development=is_development)
        self.host = PairingHost(
            identity,
            self._on_change,
            is_wanted=self._is_wanted,
            holder=self._holder,
            on_refusal=_log_refusal,
        )

    @property
    def is_over(self) -> bool:
        """Whether all is done, also to the trust."""
        is_kept = self._keeping is not None and self._keeping.done()
        return is_kept or isinstance(self._shown, Failed)

    async def changed(self) -> None:
        """Wait until there may be something to tell, or to look at."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LOOK_S):
                await self._news.wait()

    def look(self, hints: Iterable[Hint]) -> None:
        """See who could be paired. Of two hosts the one with the lesser key asks, if there is just
        one that it could ask. Its new addresses are used when the attempt under way has failed."""
        self._found = _candidates(hint for hint in hints if self._is_wanted(hint.key, hint.name))
        is_free = isinstance(self.host.state, Waiting) and not self.host.is_trying
        if not is_free or len(self._found) != 1:
            return
        (candidate,) = self._found.values()
        if self._trust_store.key < candidate.key and candidate != self._asked:
            self._asked = candidate
            self.host.ask(candidate.key, candidate.addresses)

    def row(self) -> Row:
        """How it stands."""
        found: Row = {
            "step": "waiting",
            "code": "",
            "name": "",
            "fingerprint": "",
            "seconds_left": round(self.host.seconds_left),
            "candidates": [],
            "problem": None,
        }
        return found | self._state_row(self._shown)

    def _state_row(self, state: PairingState) -> Row:
        match state:
            case Waiting(tries_left, problem):
                told = problem.to_dict() if problem else None
                found = [
                    {"name": one.name, "fingerprint": fingerprint(one.key)}
                    for one in self._found.values()
                ]
                return {"tries_left": tries_left, "candidates": found, "problem": told}
            case Comparing(code, name, _, is_confirmed):
                step = "confirmed" if is_confirmed else "comparing"
                return {
                    "step": step,
                    "code": code,
                    "name": name,
                    "fingerprint": state.fingerprint,
                }
            case Agreed(key, name):
                return {"step": "agreed", "name": name, "fingerprint": fingerprint(key)}
            case Failed(problem):
                return {"step": "failed", "problem": problem.to_dict()}
            case _:
                return {}

    async def close(self) -> None:
        """Let go of it; who was agreed with is kept first."""
        await self.host.close()
        if self._keeping is not None:
            await asyncio.shield(self._keeping)

    def _on_change(self, state: PairingState) -> None:
        if isinstance(state, Agreed):
            self._keeping = asyncio.ensure_future(self._keep(state))
            self._keeping.add_done_callback(lambda _: self._tell())
        else:
            self._shown = state
            self._tell()

    async def _keep(self, agreed: Agreed) -> None:
        try:
            await self._trust_store.pair(agreed.key, agreed.name)
            self._shown = agreed
        except PeerRefused as refused:
            self._shown = Failed(refused.problems[0])

    def _tell(self) -> None:
        self._news.set()
        self._news = asyncio.Event()

    def _is_wanted(self, key: PeerKey, name: str) -> bool:
        if key == self._trust_store.key or key in self._trust_store.trust.revoked:
            return False
        wanted = self._wanted
        return wanted is None or wanted in (name, key) or wanted.upper() == fingerprint(key)

    def _holder(self, name: str) -> PeerKey | None:
        """Who has a name already, among those that are here or paired."""
        known = {**self._known(), **self._trust_store.trust.paired}
        return next((key for key, one in known.items() if one == name), None)


def _candidates(hints: Iterable[Hint]) -> dict[PeerKey, Candidate]:
    """Who can be asked, with all the places where that may be."""
    found: dict[PeerKey, Candidate] = {}
    for hint in hints:
        if hint.pairing_port is None:
            continue
        before = found[hint.key].addresses if hint.key in found else ()
        here = (f"{a.rpartition(':')[0]}:{hint.pairing_port}" for a in hint.addresses)
        addresses = tuple(dict.fromkeys((*before, *here)))
        found[hint.key] = Candidate(hint.key, hint.name, addresses)
    return found


def _lasting(row: Row) -> Row:
    """All of a row but what changes by itself."""
    return {key: value for key, value in row.items() if key != "seconds_left"}


def _log_refusal(refusal: Refusal) -> None:
    log.debug("turned away while pairing: %s %s", refusal.address, refusal.told)
