"""By what a host judges payloads, as plain data that child processes are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.signatures import Verifier
from nondum.wheelhouse.trust import succession, trust_file
from nondum.wheelhouse.trust.judging import Circumstances, Developing, Judging
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Trust


@frozen
class Rules:
    """What stands for a host when it is judged for it elsewhere."""

    host: str
    allow_unsigned: bool
    trust: str | None = None
    """Text of the active trust file; None: no key is trusted."""

    def to_arguments(self) -> dict[str, Any]:
        """The rules among a job's arguments."""
        return {"host": self.host, "allow_unsigned": self.allow_unsigned, "trust": self.trust}

    @classmethod
    def of(cls, arguments: Mapping[str, Any]) -> Rules:
        """The rules among a job's arguments."""
        allow_unsigned = arguments.get("allow_unsigned", False)
        return cls(arguments.get("host", ""), allow_unsigned, arguments.get("trust"))

    def following(self, known: Sequence[str], offered: Sequence[SignedFile]) -> Rules:
        """The rules as they will be once the files that follow the active one are taken."""
        if self.trust is None or not offered:
            return self
        accepted = succession.extend(parsed(self.trust), known, offered).accepted
        return replace(self, trust=accepted[-1].data.decode()) if accepted else self

    def verifier(self, *, with_time: bool = True) -> Verifier:
        """Who judges by them, now, or without asking what time it is."""
        at = Circumstances(self.host, datetime.now(UTC) if with_time else None)
        trust = parsed(self.trust) if self.trust is not None else None
        return Developing(trust, at) if self.allow_unsigned else Judging(trust, at)


@lru_cache(maxsize=4)
def parsed(text: str) -> Trust:
    """A trust file that was accepted before. Raises `TrustRefused`."""
    return trust_file.parse(text, trust_file.NAME)
