"""Which hosts this host dials, and where, by hints. Hints prove nothing: the connection decides.

Of two hosts one need dial. The one with the smaller key does so at once, the other one when there
is no link a second later: perhaps only that direction works.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from nondum.transport.peers.events import PeerUp
from nondum.transport.peers.keys import PeerKey

PATIENCE_S = 1.0
"""How long the host with the bigger key waits to be dialled …"""
PATIENCE_FOR_EACH_S = 0.1
"""… and so much more for every other peer that it looks for: when all start at once, it takes."""
AT_ONCE = 8
"""Peers that are dialled at the same time: with more, all handshakes would be late."""
TURN_S = 2.0
"""How long one of them may keep others waiting; it is dialled on after that."""
ADDRESSES = 16
"""Addresses of one peer that are tried."""
WORKED = 4
"""Of those, addresses that have worked before and are tried whatever hints say."""
WISHES = 256
"""Peers that are looked for."""
REMEMBERED_S = 3600.0
"""How long a peer is looked for that is neither there nor hinted at any more."""
CALM_S = 1.0
"""Least time between two dials of a peer whose hints keep changing."""


class Dialler(Protocol):
    """What dials."""

    def dial(self, peer: PeerKey, addresses: Sequence[str]) -> None:
        """Be linked to a peer from now on; dialling again exchanges its addresses."""

    def hang_up(self, peer: PeerKey) -> None:
        """Dial a peer no more; a link that exists stays."""


@dataclass(slots=True)
class _Wish:
    """To be linked to one peer."""

    hinted: tuple[str, ...] = ()
    worked: tuple[str, ...] = ()
    epoch: int = 0
    is_linked: bool = False
    dialled_s: float = float("-inf")
    timer: asyncio.TimerHandle | None = field(default=None, repr=False)

    @property
    def addresses(self) -> tuple[str, ...]:
        """Those hinted at, and those that have worked."""
        kept = [one for one in self.worked if one not in self.hinted]
        return (*kept, *self.hinted)[:ADDRESSES]


class DialPolicy:
    """The wishes of one host."""

    def __init__(
        self,
        mine: PeerKey,
        dialler: Dialler,
        is_welcome: Callable[[PeerKey], bool],
    ) -> None:
        """`is_welcome` tells whether a key might be let in."""
        self._mine, self._dialler, self._is_welcome = mine, dialler, is_welcome
        self._wishes: dict[PeerKey, _Wish] = {}
        self._turns: dict[PeerKey, asyncio.TimerHandle] = {}
        """Peers that are being dialled."""
        self._queue: deque[PeerKey] = deque()
        self._loop = asyncio.get_running_loop()
        self._is_closed = False

    @property
    def looked_for(self) -> int:
        """Peers that are to be linked to, and are or are not yet."""
        return len(self._wishes)

    def hinted(self, key: PeerKey, addresses: Iterable[str], epoch: int = 0) -> None:
        """A hint about a peer came; perhaps the same again."""
        if self._is_closed or key == self._mine or not self._is_welcome(key):
            return
        wish = self._wish(key)
        if wish is None:
            return
        hinted = tuple(addresses)[:ADDRESSES]
        is_news = (set(hinted), epoch) != (set(wish.hinted), wish.epoch)
        wish.hinted, wish.epoch = hinted, epoch
        if is_news and not wish.is_linked:
            self._dial_in(key, self._courtesy_s(key))

    def gone(self, key: PeerKey) -> None:
        """No hint names a peer any more: it is dialled at its last addresses."""
        wish = self._wishes.get(key)
        if wish is None:
            return
        wish.hinted, wish.epoch = (), 0
        if not wish.is_linked:
            self._look_where_it_was(key, wish)

    def up(self, event: PeerUp) -> None:
        """There is a link."""
        if not self._is_welcome(event.key):
            return
        wish = self._wish(event.key)
        if wish is None:
            return
        wish.is_linked = True
        self._stop(wish)
        self.turn_over(event.key)
        if event.address in wish.addresses:  # this host has dialled it there
            others = tuple(one for one in wish.worked if one != event.address)
            wish.worked = (event.address, *others)[:WORKED]
        elif self._mine > event.key:
            self._dialler.hang_up(event.key)  # the peer dials, and will again

    def lost(self, key: PeerKey) -> None:
        """There is no link any more."""
        wish = self._wishes.get(key)
        if wish is None:
            return
        wish.is_linked = False
        if not self._is_welcome(key):
            self._drop(key)
        elif wish.hinted:
            self._dial_in(key, self._courtesy_s(key))
        else:
            self._look_where_it_was(key, wish)

    def trust_changed(self) -> None:
        """Look no more for those who would not be let in."""
        for key in [key for key in self._wishes if not self._is_welcome(key)]:
            self._drop(key)

    def again(self) -> None:
        """Dial all that there is no link to: who turned this host away might not any more."""
        for key, wish in self._wishes.items():
            if not wish.is_linked:
                self._dial_in(key, 0.0)

    def close(self) -> None:
        """Dial no peer any more, whatever the hints."""
        self._is_closed = True
        for wish in self._wishes.values():
            self._stop(wish)
        self._wishes.clear()
        self._queue.clear()
        for timer in self._turns.values():
            timer.cancel()
        self._turns.clear()

    def _courtesy_s(self, key: PeerKey) -> float:
        if self._mine < key:
            return 0.0
        unlinked = sum(not wish.is_linked for wish in self._wishes.values())
        return PATIENCE_S + PATIENCE_FOR_EACH_S * (unlinked - 1)

    def _wish(self, key: PeerKey) -> _Wish | None:
        """The wish for a peer; a new one where the limit allows it."""
        if key not in self._wishes and len(self._wishes) >= WISHES:
            never_met = (
                key for key, one in self._wishes.items() if not one.is_linked and not one.worked
            )
            oldest = next(never_met, None)
            if oldest is None:
                return None
            self._drop(oldest)
        return self._wishes.setdefault(key, _Wish())

    def _dial_in(self, key: PeerKey, wait_s: float) -> None:
        wish = self._wishes[key]
        self._stop(wish)
        at_s = max(self._loop.time() + wait_s, wish.dialled_s + CALM_S)
        if at_s <= self._loop.time():
            self._dial(key)
        else:
            wish.timer = self._loop.call_at(at_s, self._dial, key)

    def turn_over(self, key: PeerKey) -> None:
        """A peer was reached, or not at once: others have their turn."""
        if timer := self._turns.pop(key, None):
            timer.cancel()
        while self._queue and len(self._turns) < AT_ONCE:
            self._dial(self._queue.popleft())

    def _dial(self, key: PeerKey) -> None:
        wish = self._wishes.get(key)
        if wish is None:
            return
        wish.timer = None
        if wish.is_linked or not wish.addresses:
            return
        if len(self._turns) >= AT_ONCE and key not in self._turns:
            self._leave_queue(key)
            (self._queue.appendleft if wish.worked else self._queue.append)(key)
            return
        if timer := self._turns.pop(key, None):
            timer.cancel()
        self._turns[key] = self._loop.call_later(TURN_S, self.turn_over, key)
        wish.dialled_s = self._loop.time()
        self._dialler.dial(key, wish.addresses)

    def _look_where_it_was(self, key: PeerKey, wish: _Wish) -> None:
        if not wish.worked:
            self._drop(key)
            return
        self._dial(key)
        self._stop(wish)
        wish.timer = self._loop.call_later(REMEMBERED_S, self._drop, key)

    def _drop(self, key: PeerKey) -> None:
        self._stop(self._wishes.pop(key))
        self._dialler.hang_up(key)
        self._leave_queue(key)
        self.turn_over(key)

    def _leave_queue(self, key: PeerKey) -> None:
        with contextlib.suppress(ValueError):
            self._queue.remove(key)

    def _stop(self, wish: _Wish) -> None:
        if wish.timer is not None:
            wish.timer.cancel()
            wish.timer = None
