"""The states of a host that a person without a screen is shown, and what is told with them."""

from __future__ import annotations

from enum import Enum

from nondum.sdk.frozen import frozen


class State(Enum):
    """A state, by the name that programs know it by. What comes first is shown first."""

    REFUSED = "refused"
    """A payload or drive was refused: its code says why."""
    WORKING = "working"
    """Something is being done for a drive or payload: leave it in."""
    SAFE = "safe-to-remove"
    """Nothing is wanted of a drive any more, and it is unmounted."""
    HELP = "needs-help"
    """The host cannot go on by itself with something."""
    READY = "ready"
    """Nothing is to be done by anybody."""


PRIORITY = tuple(State)
"""The first state that anything asks for is shown."""


@frozen
class StateReason:
    """One reason for a state."""

    state: State
    about: str
    """What it is about, the same as long as it lasts: `drive sdb1-7`, `goal 3`."""
    sentence: str
    code: str = ""
    payload: str = ""
    """Id of the payload that it is about, if it is about one."""
    drive: str = ""
    """The drive that it is about, if it is about one."""

    def to_dict(self) -> dict[str, str]:
        """Plain data for people's tools and for hooks."""
        return {
            "state": self.state.value,
            "code": self.code,
            "payload": self.payload,
            "drive": self.drive,
            "sentence": self.sentence,
        }


NOTHING = StateReason(State.READY, "", "ready")
"""What is shown when nothing else is."""
