"""The one tree of nondum's errors, and the value that every refusal is told with.

    NondumError
    ├── PayloadRefused        a drive's contents list, manifest, lock, wheel or preflight
    ├── TrustRefused          a trust file, key or signature of one that cannot be believed
    ├── InstallFailed         staging, store or venv could not be carried through
    │   └── DriveGone         the drive went away while it was needed
    ├── WorkerFailed          did not start, lied, hung, crashed
    ├── ProtocolViolation     a message that the protocol does not allow
    ├── LinkClosed            the other end of a worker link is gone
    ├── MessageInvalid        a stream message with wrong fields, shape or units
    ├── FragmentRefused       PDDL that does not parse, type-check or merge
    │   └── TooManyBindings   there is more in it than can be looked at
    ├── GoalRefused           words or PDDL that name no goal here
    ├── PlannerFailed         a planner broke its contract
    ├── BehaviourFailed       a behaviour ended in FAILURE
    ├── ConfigRefused         the host's configuration or command line
    ├── HostUnreachable       no daemon answers
    │   └── PeerUnreachable   no link to another host, or it was lost while it was needed
    ├── PeerRefused           a key, certificate, pairing or setting of peers that cannot be trusted
    ├── CallFailed            another host answered a call with problems
    ├── EntryRefused          what cannot be shared with peers
    └── FrameUnknown          no transform between two frames

TooManyBindings is defined in `nondum.planning`, those of hosts among each other in
`nondum.transport`. Other exceptions of nondum are signals within one package, and never leave it.

A mistake in calling code stays `TypeError` or `ValueError`; these say that the world failed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import cast

from nondum.sdk import codes
from nondum.sdk.codec.values import OMIT_DEFAULT, to_plain
from nondum.sdk.frozen import frozen


@frozen
class Problem:
    """One thing that is wrong, in the same words wherever it is shown."""

    code: str
    """Stable identifier, for example `WHEEL_RECORD` or `PDDL_ARITY`."""
    message: str
    """What was found, and what was expected, in one sentence."""
    where: str = field(default="", metadata=OMIT_DEFAULT)
    """File, place in it, component or drive."""
    need: str = field(default="", metadata=OMIT_DEFAULT)
    """What is needed, where that can be measured."""
    have: str = field(default="", metadata=OMIT_DEFAULT)
    """What is there."""
    fix: str = field(default="", metadata=OMIT_DEFAULT)
    """What a person can do about it; what is known of the code, if nothing better is said."""

    def __post_init__(self) -> None:
        if not self.fix:
            object.__setattr__(self, "fix", codes.remedy(self.code))

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        there = f", there is {self.have}" if self.have else ""
        measured = f" (needs {self.need}{there})" if self.need else ""
        apart = "\n" if "\n" in self.message else " "
        remedy = f"{apart}→ {self.fix}" if self.fix else ""
        return f"{self.code} {place}{self.message}{measured}{remedy}"

    def to_dict(self) -> dict[str, str]:
        """The problem as plain data, empty fields left out.

        >>> Problem("GOAL_TOO_EARLY", "not yet").to_dict()
        {'code': 'GOAL_TOO_EARLY', 'message': 'not yet', 'fix': 'ask again in a second'}
        """
        return cast(dict[str, str], to_plain(self))


class NondumError(Exception):
    """Root of all errors that nondum raises about the world; carries every problem found."""

    def __init__(self, *problems: Problem) -> None:
        if not problems:
            raise ValueError("a NondumError names at least one problem")
        super().__init__(*problems)
        self.problems: tuple[Problem, ...] = problems

    @property
    def code(self) -> str:
        """The code of the first problem."""
        return self.problems[0].code

    def __str__(self) -> str:
        return "\n".join(str(problem) for problem in self.problems)


class PayloadRefused(NondumError):
    """A payload is not what it claims, or does not fit this host."""


class TrustRefused(NondumError):
    """A trust file, a key, or the signature of one, that cannot be believed."""


class InstallFailed(NondumError):
    """Staging, store or venv could not be carried through."""


class DriveGone(InstallFailed):
    """The drive went away while it was needed."""


class WorkerFailed(NondumError):
    """A worker did not start, lied, hung or crashed."""


class ProtocolViolation(NondumError):
    """A message that the protocol does not allow."""


class LinkClosed(NondumError):
    """The other end of a worker link is gone."""


class MessageInvalid(NondumError):
    """A stream message with wrong fields, shape or units."""


class FragmentRefused(NondumError):
    """PDDL that does not parse, type-check or merge."""


class GoalRefused(NondumError):
    """Words or PDDL that name no goal here."""


class PlannerFailed(NondumError):
    """A planner broke its contract."""


class BehaviourFailed(NondumError):
    """A behaviour ended in FAILURE. Authors raise it: `raise BehaviourFailed("no light")`."""

    def __init__(self, reason: str | Problem, *, code: str = "BEHAVIOUR_FAILED") -> None:
        super().__init__(reason if isinstance(reason, Problem) else Problem(code, reason))

    @property
    def reason(self) -> str:
        """The author's own words."""
        return self.problems[0].message


class ConfigRefused(NondumError):
    """The host's configuration or command line is wrong."""


class HostUnreachable(NondumError):
    """No daemon answers."""


class FrameUnknown(NondumError):
    """No transform between two frames is known."""


def problems_of(errors: Iterable[NondumError]) -> tuple[Problem, ...]:
    """All problems of several errors, in order."""
    return tuple(problem for error in errors for problem in error.problems)
