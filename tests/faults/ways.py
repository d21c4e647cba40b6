"""Payloads that come to each step of their life, and what makes each event happen there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.kit.host import LAMP
from tests.kit.payloads import Part, make_payload, seal, sha256

from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    PayloadCleared,
    PayloadFailed,
    PayloadRefused,
    PayloadWithdrawn,
    RetryAsked,
)
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.releases import PayloadResumed, PayloadSuperseded, RollbackAsked
from nondum.host.core.events.trust import PayloadDistrusted
from nondum.host.core.events.workers import WorkerExited, WorkerFailed, WorkerReady
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.step import Step
from nondum.sdk.description import PluginDescription

LAMP_ID = "org.example.lamp"
NOTHING = PluginDescription(name="test-lamp", version="1.0")

GO = "go"
"""The file, beside the drives, that a slow plugin waits for."""
SLOW = """
@hookimpl
def start(ctx):
    import os, time
    while not os.path.exists({go!r}):
        time.sleep(0.05)
"""
"""It does not become ready before the file is there."""

Write = Callable[[Path], None]


def sound(drive: Path) -> None:
    make_payload(drive, Part("lamp", LAMP), payload_id=LAMP_ID)


def newer(drive: Path) -> None:
    """The next release of it."""
    part = Part("lamp", LAMP, version="2.0")
    make_payload(drive, part, payload_id=LAMP_ID, version="2.0", release=2)


def slow(drive: Path) -> None:
    """One that starts once it may (`let_start`): others come to STORED meanwhile."""
    lamp = Part("lamp", LAMP + SLOW.format(go=str(drive.parent.parent / GO)))
    make_payload(drive, lamp, payload_id=LAMP_ID)


def let_start(root: Path) -> None:
    """Have slow plugins become ready."""
    (root / GO).touch()


def unfit(drive: Path) -> None:
    """Refused from its metadata, while it is copied."""
    lamp = Part("lamp", LAMP)
    make_payload(drive, lamp, payload_id=LAMP_ID, requires='python = ">=3.99"')


def hooked(drive: Path) -> None:
    """Refused when its wheels are checked."""
    lamp = Part("lamp", LAMP, files={"hook.pth": "import os\n"})
    make_payload(drive, lamp, payload_id=LAMP_ID)


def unstageable(drive: Path) -> None:
    """Refused when it is staged: there is a file where the folder of payloads should be."""
    sound(drive)
    state = drive.parent.parent / "state"
    state.mkdir()
    (state / "payloads").touch()


def damaged(drive: Path) -> None:
    """Refused when it is unpacked: a file of a wheel is not what its RECORD says."""
    folder = make_payload(drive, Part("lamp", LAMP), payload_id=LAMP_ID)
    wheel = next((folder / "wheels").glob("test_lamp-*.whl"))
    before = sha256(wheel)
    data = bytearray(wheel.read_bytes())
    data[50] ^= 0xFF  # inside the first member's compressed bytes
    wheel.write_bytes(data)
    lock = folder / "pylock.lamp.toml"
    lock.write_text(lock.read_text().replace(before, sha256(wheel)))
    seal(folder, payload_id=LAMP_ID)


def broken(drive: Path) -> None:
    """Quarantined: its plugin cannot be imported."""
    lamp = Part("lamp", "import no_such_module", description=NOTHING)
    make_payload(drive, lamp, payload_id=LAMP_ID)


ENDS: Mapping[Write, Step] = {
    sound: Step.ACTIVE,
    newer: Step.ACTIVE,
    slow: Step.ACTIVE,
    unfit: Step.REFUSED,
    hooked: Step.REFUSED,
    unstageable: Step.REFUSED,
    damaged: Step.REFUSED,
    broken: Step.QUARANTINED,
}
"""Where each of them comes to by itself, at the latest when it is asked for again."""


@dataclass(frozen=True)
class Way:
    """How a daemon is brought to a transition."""

    drives: Mapping[str, Write] = field(default_factory=lambda: {"a": sound})
    """Slot → the payload on its drive."""
    script: tuple[str, ...] = ("plug a",)
    nudge: tuple[tuple[str, str], ...] = ()

    def orders(self, root: Path, **more: Any) -> dict[str, Any]:
        """For a daemon of `root`, where everything is made ready."""
        for slot, write in self.drives.items():
            write(root / "drives" / slot)
        (root / "slots").mkdir()
        return {"root": str(root), "script": self.script, "nudge": self.nudge, **more}

    @property
    def goes_back(self) -> bool:
        """Whether a person goes back to an earlier release, and so means it."""
        return any(what == "rollback" for _, what in self.nudge)

    def out_of_place(self, steps: Mapping[str, Step]) -> list[str]:
        """What is not where it belongs at the end, of payloads (by version) that are plugged in."""
        if steps == {"1.0": Step.ACTIVE, "2.0": Step.SUPERSEDED} and self.goes_back:
            return []
        allowed = {ENDS[write] for write in self.drives.values()}
        newest = max(steps, default="")
        fine = all(
            step in (allowed if version == newest else {Step.SUPERSEDED, Step.REFUSED})
            for version, step in steps.items()
        )
        return [] if fine else [f"came to {steps}"]


BOTH = {"a": sound, "b": newer}

REFUSED_AT: Mapping[Step, Write] = {
    Step.RECEIVED: unfit,
    Step.COPIED: hooked,
    Step.VERIFIED: unstageable,
    Step.STAGED: damaged,
}

SPECIAL: Mapping[tuple[Step, type[Event]], Way] = {
    (Step.STORED, PayloadFailed): Way({"a": broken}),
    (Step.PROBED, PayloadFailed): Way(nudge=(("PROBED", "lost"),)),
    (Step.ACTIVE, PayloadFailed): Way(BOTH, ("plug a", "plug b"), nudge=(("SUPERSEDED", "lost"),)),
    (Step.STORED, PayloadSuperseded): Way({"a": slow, "b": newer}, nudge=(("STORED", "plug"),)),
    (Step.ACTIVE, PayloadSuperseded): Way(BOTH, ("plug a", "plug b")),
    (Step.SUPERSEDED, PayloadResumed): Way(BOTH, ("plug a", "plug b", "pull b")),
    (Step.SUPERSEDED, PayloadSentAway): Way(
        BOTH, ("plug a", "plug b"), nudge=(("SUPERSEDED", "send"),)
    ),
    (Step.SUPERSEDED, PayloadDistrusted): Way(
        BOTH, ("plug a", "plug b"), nudge=(("SUPERSEDED", "distrust"),)
    ),
    (Step.SUPERSEDED, PayloadWithdrawn): Way(BOTH, ("plug a", "plug b", "pull a")),
    (Step.REFUSED, RollbackAsked): Way(
        BOTH, ("plug b", "plug a"), nudge=(("REFUSED", "rollback"),)
    ),
    (Step.REMOVING, PayloadCleared): Way(nudge=(("ACTIVE", "pull"),)),
}

NUDGES: Mapping[type[Event], str] = {
    PayloadWithdrawn: "pull",
    PayloadSentAway: "send",
    PayloadDistrusted: "distrust",
    RetryAsked: "retry",
}


def way(step: Step, event: type[Event]) -> Way:
    """The way to a transition of a payload."""
    if (step, event) in SPECIAL:
        return SPECIAL[step, event]
    comes = {Step.REFUSED: unfit, Step.QUARANTINED: broken}.get(step, sound)
    if event is PayloadRefused:
        return Way({"a": REFUSED_AT[step]})
    if event in NUDGES:
        return Way({"a": comes}, nudge=((step.name, NUDGES[event]),))
    return Way()


COMPONENT_WAYS: Mapping[tuple[ComponentState, type[Event]], Way] = {
    (ComponentState.READY, WorkerExited): Way(nudge=(("ACTIVE", "exited"),)),
    (ComponentState.RESTARTING, WorkerReady): Way(
        nudge=(("ACTIVE", "exited"), ("RESTARTING-WorkerExited", "ready"))
    ),
    (ComponentState.READY, WorkerFailed): Way(nudge=(("ACTIVE", "lost"),)),
    (ComponentState.RESTARTING, WorkerFailed): Way(
        nudge=(("ACTIVE", "exited"), ("RESTARTING-WorkerExited", "lost"))
    ),
    (ComponentState.QUARANTINED, RetryAsked): Way(
        nudge=(("ACTIVE", "lost"), ("QUARANTINED-WorkerFailed", "retry"))
    ),
}
"""The same for the transitions of a component."""
