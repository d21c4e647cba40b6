"""Daemons that live one after the other in one folder, each of which is killed at another commit.

The one that comes next recovers from that and goes on to where it is killed itself. So each step of
a chain judges the recovery from the one before, and the last is judged by `model.check`. Fewer
than `ATTEMPTS` daemons die in a row of one payload: the next would leave it alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.faults.ways import (
    Way,
    Write,
    broken,
    damaged,
    hooked,
    newer,
    slow,
    sound,
    unfit,
    unstageable,
)

Nudge = tuple[str, str]


@dataclass(frozen=True)
class Kill:
    """The life of one daemon: what happens in it, and the commit at which it is killed."""

    at: str
    """`AFTER STEP Event`, or `BEFORE`."""
    script: tuple[str, ...] = ()
    nudge: tuple[Nudge, ...] = ()

    @property
    def row(self) -> tuple[str, str, str]:
        """When, the step (of a payload or a component) and the event."""
        when, step, event = self.at.split()
        return when, step, event

    def orders(self, root: Path) -> dict[str, Any]:
        """For a daemon of that root."""
        return {
            "root": str(root),
            "script": self.script,
            "nudge": self.nudge,
            "kill": self.row,
        }


@dataclass(frozen=True)
class Chain:
    """Daemons that are killed one after the other."""

    kills: Sequence[Kill]
    drives: Mapping[str, Write]
    """Slot → the payload on its drive."""
    left_in: str = "a"
    """The slots that have drives at the end: these payloads are judged."""
    goes_back: bool = False

    def prepare(self, root: Path) -> None:
        """Make the drives."""
        for slot, write in self.drives.items():
            write(root / "drives" / slot)
        (root / "slots").mkdir()

    @property
    def end(self) -> Way:
        """What it comes to is judged as the end of this."""
        nudge = (("", "rollback"),) if self.goes_back else ()
        return Way({slot: self.drives[slot] for slot in self.left_in}, nudge=nudge)


ONE, TWO = {"a": sound}, {"a": sound, "b": newer}
PLUG = ("plug a",)

CHAINS: Mapping[str, Chain] = {
    "copied": Chain(
        [
            Kill("AFTER GONE PayloadFound", PLUG),
            Kill("AFTER RECEIVED PayloadCopied"),
            Kill("AFTER COPIED PayloadVerified"),
            Kill("AFTER VERIFIED PayloadStaged"),
        ],
        ONE,
    ),
    "brought to life": Chain(
        [
            Kill("AFTER STAGED WheelsStored", PLUG),
            Kill("BEFORE STORED ComponentsProbed"),
            Kill("AFTER STORED ComponentsProbed"),
        ],
        ONE,
    ),
    "alive": Chain(
        [
            Kill("AFTER PROBED PayloadActivated", PLUG),
            Kill("AFTER PROBED PayloadFailed", nudge=(("PROBED", "lost"),)),
            Kill("AFTER ACTIVE PayloadSentAway", ("retry",), (("ACTIVE", "send"),)),
            Kill("AFTER REMOVING PayloadCleared", ("retry",), (("ACTIVE", "pull"),)),
        ],
        ONE,
    ),
    "ended early": Chain(
        [
            Kill("AFTER VERIFIED PayloadWithdrawn", PLUG, (("VERIFIED", "pull"),)),
            Kill("AFTER RECEIVED PayloadSentAway", PLUG, (("RECEIVED", "send"),)),
            Kill("AFTER COPIED PayloadDistrusted", ("retry",), (("COPIED", "distrust"),)),
            Kill("AFTER STAGED PayloadSentAway", ("retry",), (("STAGED", "send"),)),
        ],
        ONE,
    ),
    "ended late": Chain(
        [
            Kill("BEFORE STAGED WheelsStored", PLUG),
            Kill("AFTER PROBED PayloadWithdrawn", nudge=(("PROBED", "pull"),)),
            Kill("AFTER STORED PayloadDistrusted", PLUG, (("STORED", "distrust"),)),
            Kill("AFTER REFUSED RetryAsked", ("retry",)),
        ],
        ONE,
    ),
    "refused": Chain(
        [
            Kill("AFTER RECEIVED PayloadRefused", PLUG),
            Kill("AFTER REFUSED PayloadWithdrawn", ("pull a",)),
            Kill("AFTER COPIED PayloadRefused", ("plug b",)),
            Kill("AFTER STAGED PayloadRefused", ("pull b", "plug c")),
        ],
        {"a": unfit, "b": hooked, "c": damaged},
        left_in="c",
    ),
    "refused, since it cannot be staged": Chain(
        [Kill("AFTER VERIFIED PayloadRefused", PLUG)], {"a": unstageable}
    ),
    "quarantined": Chain(
        [
            Kill("AFTER STORED PayloadFailed", PLUG),
            Kill("BEFORE QUARANTINED RetryAsked", ("retry",)),
            Kill("AFTER QUARANTINED RetryAsked", ("retry",)),
            Kill("AFTER QUARANTINED PayloadDistrusted", ("distrust",)),
        ],
        {"a": broken},
    ),
    "superseded": Chain(
        [
            Kill("AFTER ACTIVE PayloadSuperseded", ("plug a", "plug b")),
            Kill("BEFORE SUPERSEDED PayloadResumed", ("pull b",)),
            Kill("AFTER SUPERSEDED PayloadResumed"),
            Kill("AFTER SUPERSEDED PayloadDistrusted", ("plug b",), (("SUPERSEDED", "distrust"),)),
        ],
        TWO,
        left_in="ab",
    ),
    "superseded before it was ready": Chain(
        [Kill("AFTER STORED PayloadSuperseded", PLUG, (("STORED", "plug"),))],
        {"a": slow, "b": newer},
        left_in="ab",
    ),
    "lost beside a newer one, and rolled back": Chain(
        [
            Kill("AFTER ACTIVE PayloadFailed", ("plug a", "plug b"), (("SUPERSEDED", "lost"),)),
            Kill(
                "AFTER REFUSED RollbackAsked",
                ("pull a b", "plug b", "plug a"),
                (("REFUSED", "rollback"),),
            ),
        ],
        TWO,
        left_in="ab",
        goes_back=True,
    ),
    "worker that ends": Chain(
        [
            Kill("AFTER READY WorkerExited", PLUG, (("ACTIVE", "exited"),)),
            Kill(
                "AFTER RESTARTING WorkerReady",
                nudge=(("ACTIVE", "exited"), ("RESTARTING-WorkerExited", "ready")),
            ),
            Kill("AFTER READY WorkerFailed", nudge=(("ACTIVE", "lost"),)),
        ],
        ONE,
    ),
    "worker that is given up": Chain(
        [
            Kill("BEFORE PROBED PayloadActivated", PLUG),
            Kill(
                "AFTER RESTARTING WorkerFailed",
                nudge=(("ACTIVE", "exited"), ("RESTARTING-WorkerExited", "lost")),
            ),
            Kill(
                "AFTER QUARANTINED RetryAsked",
                nudge=(("ACTIVE", "lost"), ("QUARANTINED-WorkerFailed", "retry")),
            ),
        ],
        ONE,
    ),
}
