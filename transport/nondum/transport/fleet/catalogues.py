"""Keeps catalogues alike: tells this host's to its peers, and reads theirs.

Changes are told at once, to all. What a peer missed shows in the next ping, which carries revision
and digest; then it reads what it lacks, as it does when it meets this host.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterator, Mapping
from typing import Any, Protocol

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import Body
from nondum.transport.fleet.chunk import Chunk, parse, read_state
from nondum.transport.fleet.fleet import OWN_METHODS, FleetEvent, Peer, PeerChanged
from nondum.transport.fleet.ledger import Ledger
from nondum.transport.fleet.replica import Replica
from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.peers.calls import Call
from nondum.transport.peers.events import Loss, PeerEvent, PeerLost, PeerUp
from nondum.transport.peers.failures import CallFailed, PeerUnreachable
from nondum.transport.peers.incoming_calls import Handler, IncomingCall, Lease
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.pulse import State
from nondum.transport.peers.trust import Admission

log = logging.getLogger(__name__)

READ = "fleet.read"
"""Call: epoch and revision that the caller knows (0 and 0 for none); chunks are the answer."""
CHANGED = "fleet.changed"
"""Notice: one chunk."""
STATE = "fleet.state"
"""Notice: revision and digest, where no pings carry them or they would come too late."""
CONFLATED_S = 0.02
"""Changes within so long are told as one."""
AT_ONCE = 4
"""Peers whose catalogues are read at the same time."""
READ_S = 10.0
"""How long one reading may take."""
TURN_S = 1.0
"""How long it may keep others waiting for their turn."""
CHANGES_PER_S, CHANGES = 100.0, 200.0
"""More than a host tells; of those that tell more, changes are read when there is time."""
FIRST_WAIT_S = 0.1
LONGEST_WAIT_S = 3.0
AWAY = 64
"""Peers that are away and whose catalogues are kept, so that only changes are read again."""


class Links(Protocol):
    """What carries messages to the peers."""

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Raises `PeerUnreachable`."""

    def notify_all(self, method: str, args: Body) -> None:
        """Tell every peer something; those that cannot take it now miss it."""

    def turn_away(self, peer: PeerKey, problem: Problem) -> None:
        """Cut a peer that breaks the rules. Raises `PeerUnreachable`."""

    def round_trip_s(self, peer: PeerKey) -> float | None:
        """The last ping's time there and back."""


class _Known:
    """A peer that is there."""

    def __init__(self, up: PeerUp, replica: Replica) -> None:
        self.up, self.replica = up, replica
        self.is_told = False
        """Whether its catalogue was told of since it came up."""
        self.reading: asyncio.Task[None] | None = None
        self.changes = TokenBucket(CHANGES_PER_S, CHANGES, 0.0)


class Catalogues:
    """This host's ledger, and a replica of every peer's."""

    def __init__(
        self,
        epoch: int,
        handler: Handler,
        on_event: Callable[[FleetEvent], None],
        links: Callable[[], Links],
    ) -> None:
        """`handler` serves all other methods; `links` is used from the first event on."""
        self._ledger = Ledger(epoch)
        self._handler, self._on_event, self._links = handler, on_event, links
        self._known: dict[PeerKey, _Known] = {}
        self._away: OrderedDict[PeerKey, Replica] = OrderedDict()
        self._turns = asyncio.Semaphore(AT_ONCE)
        self._loop = asyncio.get_running_loop()
        self._told = self._ledger.state
        """How far the peers were told, so that pings do not overtake what is being told."""
        self._told_s = float("-inf")
        self._telling: asyncio.TimerHandle | None = None

    @property
    def peers(self) -> Mapping[PeerKey, Peer]:
        """The peers that are linked, with their catalogues."""
        return {key: self._peer(known) for key, known in self._known.items()}

    def publish(self, changes: Mapping[str, Body | None]) -> None:
        """Change this host's catalogue. Raises as `Ledger.publish`."""
        if self._ledger.publish(changes) and self._telling is None:
            at_s = max(self._loop.time(), self._told_s + CONFLATED_S)
            self._telling = self._loop.call_at(at_s, self._tell)

    def state(self) -> State:
        """For pings."""
        return self._told

    def tell_state(self) -> None:
        """Tell it to all, where no pings do, or not soon enough."""
        told = {"revision": self._told.revision, "digest": self._told.digest}
        self._links().notify_all(STATE, told)

    def receive_state(self, peer: PeerKey, state: State) -> None:
        """Take in the state that a peer's ping told."""
        if known := self._known.get(peer):
            known.replica.hear(state)
            self._see_to(known)

    def on_event(self, event: PeerEvent) -> None:
        """Something happened between the hosts; it is passed on."""
        match event:
            case PeerUp():
                known = _Known(event, self._replica(event.key, event.epoch))
                self._known[event.key] = known
                self._on_event(event)
                self._see_to(known)
            case PeerLost():
                self._forget(event.key)
                self._on_event(event)
            case _:
                self._on_event(event)

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        """Answer calls of the fleet's own methods, and pass the others to the handler."""
        if incoming.method == READ:
            return self._answer(incoming)
        if incoming.method.startswith(OWN_METHODS):
            raise CallFailed(Problem("NO_METHOD", f"hosts do not serve {incoming.method}"))
        return self._handler.serve(incoming)

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None:
        """Take in notices of the fleet's own methods, and pass the others to the handler.

        Raises `ProtocolViolation`.
        """
        if method == CHANGED:
            if known := self._known.get(caller.key):
                self._told_of(known, parse(args))
        elif method == STATE:
            self.receive_state(caller.key, read_state(args))
        elif not method.startswith(OWN_METHODS):
            self._handler.notice(caller, method, args)

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        """Stop a call about catalogues; the handler decides about other calls."""
        if incoming.method.startswith(OWN_METHODS):
            return Lease.STOP
        return self._handler.orphaned(incoming, reason)

    def close(self) -> None:
        """Tell and read no more."""
        if self._telling is not None:
            self._telling.cancel()
        for key in list(self._known):
            self._forget(key)

    def _peer(self, known: _Known) -> Peer:
        up, replica = known.up, known.replica
        return Peer(
            key=up.key,
            name=up.name,
            epoch=up.epoch,
            address=up.address,
            admitted_by=up.admitted_by,
            revision=replica.revision if known.is_told else 0,
            entries=replica.entries if known.is_told else {},
            round_trip_s=self._links().round_trip_s(up.key),
        )

    def _replica(self, key: PeerKey, epoch: int) -> Replica:
        """The replica from before the peer was away, unless the peer has restarted since."""
        kept = self._away.pop(key, None)
        return kept if kept is not None and kept.epoch == epoch else Replica(epoch)

    def _forget(self, key: PeerKey) -> None:
        known = self._known.pop(key, None)
        if known is None:
            return
        if known.reading is not None:
            known.reading.cancel()
        if known.is_told:
            self._away[key] = known.replica
            while len(self._away) > AWAY:
                self._away.popitem(last=False)

    def _tell(self) -> None:
        """Tell all peers what changed since they were last told."""
        self._telling, self._told_s = None, self._loop.time()
        chunks = self._ledger.delta(self._told.revision) or ()
        self._told = self._ledger.state
        if len(chunks) == 1:
            self._links().notify_all(CHANGED, chunks[0].to_body())
        else:  # more than fits a message is read by each when it can
            self.tell_state()

    def _answer(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        epoch, since = incoming.args.get("epoch"), incoming.args.get("revision")
        if type(epoch) is not int or type(since) is not int:
            raise CallFailed(Problem("PACKET_FIELDS", "epoch and revision are whole numbers"))
        *first, last = self._ledger.read(epoch, since)
        return self._answer_in_parts(incoming, first, last) if first else last.to_body()

    async def _answer_in_parts(
        self, incoming: IncomingCall, first: list[Chunk], last: Chunk
    ) -> Body:
        for chunk in first:
            incoming.progress(chunk.to_body())
            await asyncio.sleep(0)
        return last.to_body()

    def _see_to(self, known: _Known) -> None:
        """Start to read a peer's catalogue where that is needed and not under way."""
        if known.reading is None and _is_wanting(known):
            known.reading = self._loop.create_task(self._read(known))

    async def _read(self, known: _Known) -> None:
        try:
            if not known.changes.take(1, self._loop.time()):
                await asyncio.sleep(FIRST_WAIT_S)
            for wait_s in _waits():
                await self._ask_in_turn(known)
                if not _is_wanting(known):
                    return
                await asyncio.sleep(wait_s)
        finally:
            known.reading = None

    async def _ask_in_turn(self, known: _Known) -> None:
        async with self._turns:
            asking = self._loop.create_task(self._ask(known))
            try:
                await asyncio.wait({asking}, timeout=TURN_S)
            except asyncio.CancelledError:
                asking.cancel()
                raise
        await asking

    async def _ask(self, known: _Known) -> None:
        key, replica = known.up.key, known.replica
        args = {"epoch": replica.epoch, "revision": replica.since}
        try:
            call = self._links().call(key, READ, args, deadline_s=READ_S)
            async for body in call:
                self._take(known, parse(body))
            self._take(known, parse(await call))
        except ProtocolViolation as violation:
            self._links().turn_away(key, violation.problems[0])
        except (CallFailed, PeerUnreachable) as error:
            log.info("the catalogue of %s could not be read: %s", known.up.name, error)
        else:
            if not known.is_told and not replica.must_ask:
                self._tell_whole(known)  # nothing has changed while it was away

    def _told_of(self, known: _Known, chunk: Chunk) -> None:
        if known.changes.take(1, self._loop.time()):
            self._take(known, chunk)
        else:
            known.replica.hear(chunk.state)
            self._see_to(known)

    def _take(self, known: _Known, chunk: Chunk) -> None:
        change = known.replica.take(chunk)
        if change is None:
            return
        if known.is_told:
            self._on_event(PeerChanged(known.up.key, change.changes, change.is_whole))
        else:
            self._tell_whole(known)

    def _tell_whole(self, known: _Known) -> None:
        known.is_told = True
        self._on_event(PeerChanged(known.up.key, known.replica.entries, is_whole=True))


def _is_wanting(known: _Known) -> bool:
    return known.replica.must_ask or not known.is_told


def _waits() -> Iterator[float]:
    wait_s = FIRST_WAIT_S
    while True:
        yield wait_s
        wait_s = min(2 * wait_s, LONGEST_WAIT_S)
