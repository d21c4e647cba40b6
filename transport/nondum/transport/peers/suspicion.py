"""When a silent peer is suspected, and when it is given up. Pure: values in, values out.

After SWIM (Das, Gupta, Motivala 2002): a peer that is late is first suspected, and asked directly
and through others; any answer refutes the suspicion. After Lifeguard (Dadgar, Phillips, Currey
2017): time in which this host's own loop stood still does not count against its peers.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

from nondum.sdk.frozen import frozen

V1_SILENCE_S, V1_BEATS, V1_LONGEST_S = 1.0, 3.3, 10.0
"""Version 1 of the protocol gives a link up after this silence, or this number of beats."""


@frozen
class Terms:
    """How patient a host is with its peers. Times are in seconds.

    A beat is the time between two pings of a peer, as its last ping said.
    """

    tick_s: float = 0.3
    """How often the host looks."""
    overdue_s: float = 0.45
    """How late a ping may be before the peer is suspected."""
    shortest_beat_s: float = 0.3
    longest_beat_s: float = 7.0
    """However seldom a peer says that it pings: a hostile one could name any number."""
    confirm_beats: float = 2.0
    longest_confirm_s: float = 1.5
    """With 100 hosts, a suspected peer's own next ping may still come: 3.6 s after its last."""
    longest_resume_s: float = 2.5
    helpers: int = 3
    """Peers that are asked about one that is late: none where all are reached by one way."""

    def suspect_s(self, beat_s: float) -> float:
        """Silence after which a peer is suspected.

        >>> round(Terms().suspect_s(0.3), 2), round(Terms().suspect_s(1.8), 2)
        (0.75, 2.25)
        """
        return self._bounded(beat_s) + self.overdue_s

    def confirm_s(self, beat_s: float) -> float:
        """How long a suspected peer has to answer.

        >>> Terms().confirm_s(0.3), Terms().confirm_s(1.8)
        (0.6, 1.5)
        """
        return min(self.confirm_beats * self._bounded(beat_s), self.longest_confirm_s)

    def limit_s(self, beat_s: float) -> float:
        """Silence after which a peer is given up that no other peer has heard either.

        >>> round(Terms().limit_s(0.3), 2), round(Terms().limit_s(1.8), 2)
        (1.35, 3.75)
        """
        return self.suspect_s(beat_s) + self.confirm_s(beat_s)

    def resume_s(self, beat_s: float) -> float:
        """How long a peer may be without a link: in a large fleet, dialling takes longer.

        >>> Terms().resume_s(0.3), Terms().resume_s(1.8)
        (0.5, 2.5)
        """
        return min(0.5 * self._bounded(beat_s) / 0.3, self.longest_resume_s)

    def doubt_s(self, beat_s: float) -> float:
        """How long this host may have been silent itself before it must ask whether its peer, of
        any version, has given it up.

        >>> round(Terms().doubt_s(0.3), 2)
        0.7
        """
        v1_s = max(V1_SILENCE_S, min(V1_BEATS * self._bounded(beat_s), V1_LONGEST_S))
        return min(self.limit_s(beat_s), v1_s) - self.tick_s

    def _bounded(self, beat_s: float) -> float:
        return min(max(beat_s, self.shortest_beat_s), self.longest_beat_s)


@frozen
class Awake:
    """How long this host's loop has run, as its own timer shows."""

    at_s: float
    """When it was last looked at, on the loop's clock."""
    longest_s: float
    """What counts of the time between two looks: if more has passed, the loop stood still."""
    seconds: float = 0.0

    def look(self, now_s: float) -> Awake:
        """Take in that the loop runs at this moment.

        >>> Awake(at_s=10.0, longest_s=0.45).look(10.3).look(15.0).seconds
        0.75
        """
        return replace(self, at_s=now_s, seconds=round(self.read(now_s), 6))

    def read(self, now_s: float) -> float:
        """Seconds until this moment."""
        return self.seconds + max(0.0, min(now_s - self.at_s, self.longest_s))


class Verdict(Enum):
    """What is to be done about a peer."""

    HEARD = "it is there"
    ASK = "it is late: ask it, and others about it"
    WAIT = "it was asked, and may still answer"
    DEAD = "it has not answered: give it up"


@frozen
class Watched:
    """What is known of a peer over one link. All times are `Awake.seconds` of this host."""

    heard_s: float
    suspected_s: float | None = None
    """Since when; None when it is not."""
    is_vouched: bool = False
    """Whether another peer has said that the suspected one answers."""

    @property
    def is_suspected(self) -> bool:
        """Whether it was asked and has not answered yet."""
        return self.suspected_s is not None

    def received(self, awake_s: float) -> Watched:
        """The peer itself sent something: any suspicion is refuted."""
        return Watched(awake_s)

    def vouched(self) -> Watched:
        """Another peer says that the suspected one answers: it gets as much time once more.

        No second word, of that peer or of others, gives it any more.
        """
        return replace(self, is_vouched=True) if self.is_suspected else self

    def look(self, awake_s: float, terms: Terms, beat_s: float) -> tuple[Watched, Verdict]:
        """Judge the peer at a moment."""
        is_due = awake_s >= self.due_s(terms, beat_s)
        if self.suspected_s is not None:
            return self, Verdict.DEAD if is_due else Verdict.WAIT
        if not is_due:
            return self, Verdict.HEARD
        return replace(self, suspected_s=awake_s), Verdict.ASK

    def due_s(self, terms: Terms, beat_s: float) -> float:
        """When `look` will give another verdict if nothing is heard."""
        if self.suspected_s is None:
            return self.heard_s + terms.suspect_s(beat_s)
        return self.suspected_s + terms.confirm_s(beat_s) * (2 if self.is_vouched else 1)
