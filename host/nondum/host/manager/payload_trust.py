"""Payload trust: the active trust file, which says whose payloads this host runs, and its changes.

What is slow, and all mathematics, is done by child processes: see `chain`. A change is told once it
is on disk; every payload that is here is then judged again.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nondum.host.core.effects import JudgePayloads
from nondum.host.core.events.event import Event
from nondum.host.core.events.trust import (
    PayloadDistrusted,
    PayloadDoubted,
    TrustChanged,
    TrustFileRefused,
    TrustRead,
)
from nondum.host.jobs.children import Children
from nondum.host.manager.state_folders import Folders
from nondum.host.trust import anchors, chain
from nondum.host.trust.rules import Rules, parsed
from nondum.host.trust.vouched import UNVOUCHED, Vouched
from nondum.sdk.errors import NondumError, Problem, TrustRefused
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.trust.judging import clock_floor
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Trust

PERSON = "a person"
"""What has brought a trust file that no drive has."""

MOST_TOLD = 8
"""Problems of one drive's trust files that are told."""

log = logging.getLogger(__name__)


@frozen
class TrustOptions:
    """Where a host's trust begins, and what becomes of payloads that lose it."""

    anchor: Path | None = None
    """The first trust file; None: `trust.toml` in the state folder."""
    stop: bool = True
    """End what runs and is not trusted any more; otherwise it is told only."""


class PayloadTrust:
    """`await open()` it before drives are read."""

    def __init__(
        self,
        host: str,
        folders: Folders,
        children: Children,
        options: TrustOptions,
        *,
        allow_unsigned: bool,
    ) -> None:
        self._host, self._folders, self._children = host, folders, children
        self._anchor = options.anchor or folders.root / "trust.toml"
        self._stop, self._allow_unsigned = options.stop, allow_unsigned
        self._text: str | None = None
        self._origin = ""
        self._known: list[str] = []
        self._problems: tuple[Problem, ...] = ()
        self._changing = asyncio.Lock()
        self._vouched: dict[str, Vouched] = {}

    @property
    def trust(self) -> Trust | None:
        """The active trust file; None: no key is trusted."""
        return parsed(self._text) if self._text is not None else None

    @property
    def arguments(self) -> dict[str, Any]:
        """What payloads are judged by now, for child processes."""
        rules = Rules(self._host, self._allow_unsigned, self._text)
        return {**rules.to_arguments(), "known_trust": self._known, "demand_trust": self._stop}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What every status says."""
        unsigned = (UnsignedAllowed.warning,) if self._allow_unsigned else ()
        is_closed = self._text is None and not self._allow_unsigned
        closed = "no payload is accepted: this host trusts no key yet; see `nondum keys trust`"
        return (*unsigned, *map(str, self._problems), *((closed,) if is_closed else ()))

    async def open(self) -> tuple[Event, ...]:
        """Read and verify what is on disk. What is wrong with it is told by `warnings`."""
        try:
            self._begin(await self._loaded())
        except NondumError as error:
            self._problems = error.problems
        trust = self.trust
        return (TrustRead(trust.owner, trust.version, self._origin),) if trust is not None else ()

    async def reload(self) -> tuple[Event, ...]:
        """Read it again, since a person has changed the first file.

        Raises `TrustRefused`, `InstallFailed`: then the current trust stays.
        """
        async with self._changing:
            told, before = await self._loaded(), self._text
            if told["text"] is None:
                raise TrustRefused(*(_problems(told) or (anchors.missing(self._anchor),)))
            self._begin(told)
            return self._changed(PERSON) if self._text != before else ()

    async def offer(
        self, source: str, files: Sequence[SignedFile], flaws: Sequence[Problem] = ()
    ) -> tuple[Event, ...]:
        """Take the files that follow the active one, as `source` brought them, and return what
        became of them; never raises. A host without a trust file takes none from a drive."""
        problems = tuple(flaws)
        async with self._changing:
            new = tuple(file for file in files if file.digest not in self._known)
            taken: tuple[Event, ...] = ()
            if new and self._text is None:
                problems += (_no_anchor(),)
            elif new:
                try:
                    told = await self._children.run("trust_extend", self._extension(new))
                except NondumError as error:
                    problems += error.problems
                else:
                    problems += _problems(told)
                    if told["taken"]:
                        self._take({**told, "problems": ()})
                        taken = self._changed(source)
        return (*taken, TrustFileRefused(source, problems[:MOST_TOLD])) if problems else taken

    async def give(self, file: SignedFile) -> tuple[Event, ...]:
        """Take the file that follows the active one, from a person.

        Raises `TrustRefused` with why it is not taken.
        """
        events = await self.offer(PERSON, (file,))
        for event in events:
            if isinstance(event, TrustFileRefused):
                raise TrustRefused(*event.problems)
        return events

    async def judged(self, effect: JudgePayloads) -> tuple[Event, ...]:
        """Judge again what is here, by the active trust; what cannot be judged is not trusted."""
        try:
            found = await self._judged(effect.payloads)
        except NondumError:  # one of them causes it
            found = {}
            for key in effect.payloads:
                try:
                    found |= await self._judged((key,))
                except NondumError as error:
                    found[key] = error.problems
        if self._stop:
            return tuple(PayloadDistrusted(key, wrong) for key, wrong in found.items() if wrong)
        return tuple(PayloadDoubted(key, wrong) for key, wrong in found.items())

    def note(self, payload: str, said: Mapping[str, Any]) -> None:
        """Keep who vouches for a payload, for those who ask."""
        self._vouched[payload] = Vouched(tuple(said["signers"]), said["built"])

    def vouched(self, payload: str) -> Vouched:
        """Who vouches for a payload, by its key."""
        return self._vouched.get(payload, UNVOUCHED)

    def row(self) -> dict[str, Any]:
        """What people's tools are shown."""
        trust = self.trust
        return {
            "version": trust.version if trust is not None else 0,
            "file": self._text or "",
            "anchor": str(self._anchor),
            "first": self._origin,
            "clock_floor": f"{clock_floor(trust):%Y-%m-%dT%H:%M:%SZ}",
            "allow_unsigned": self._allow_unsigned,
            "on_revoke": "stop" if self._stop else "flag",
            "warnings": list(self.warnings),
        }

    def summary(self) -> dict[str, Any] | None:
        """The active trust file, in a few words; None: there is none."""
        trust = self.trust
        if trust is None:
            return None
        return {"owner": trust.owner, "version": trust.version, "first": self._origin}

    async def _judged(self, payloads: Sequence[str]) -> dict[str, tuple[Problem, ...]]:
        """What is wrong with each, but for those of which nothing is kept. Raises `NondumError`."""
        folders = [str(self._folders.payload(key)) for key in payloads]
        arguments = {**self.arguments, "folders": folders}
        told = await self._children.run("trust_judge_kept", arguments)
        for key, said in told.items():
            self.note(key, said)
        return {key: _problems(said) for key, said in told.items()}

    async def _loaded(self) -> dict[str, Any]:
        told: dict[str, Any] = await self._children.run("trust_load", self._places())
        return told

    def _begin(self, told: Mapping[str, Any]) -> None:
        self._take(told)
        self._origin = told["origin"]

    def _take(self, told: Mapping[str, Any]) -> None:
        self._text, self._known = told["text"], list(told["known"])
        self._problems = _problems(told)

    def _changed(self, source: str) -> tuple[Event, ...]:
        trust = self.trust
        assert trust is not None, "it was taken just now"
        log.info("the trust file of %s is now version %d", trust.owner, trust.version)
        return (TrustChanged(trust.owner, trust.version, source),)

    def _places(self) -> dict[str, Any]:
        return {"folder": str(self._folders.trust), "anchor": str(self._anchor)}

    def _extension(self, files: tuple[SignedFile, ...]) -> dict[str, Any]:
        current = {"trust": self._text, "known": self._known}
        return {**self._places(), **current, "offered": chain.packed(files)}


def _problems(told: Mapping[str, Any]) -> tuple[Problem, ...]:
    return tuple(Problem(**problem) for problem in told["problems"])


def _no_anchor() -> Problem:
    return Problem(
        "TRUST_UNANCHORED",
        "there is a trust file on it, and this host trusts no key yet that could vouch for it",
        need="a first trust file, put here by a person",
        have="none",
        fix="compare the fingerprints of its roots with its owner's, then `nondum keys trust FILE`",
    )
