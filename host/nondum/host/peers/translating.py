"""Words that a host's own phrases do not have, translated by components of its peers: a small robot
has the language model of the compute node beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from nondum.host.core.printable import printable
from nondum.host.mind.component_plugins import Answers, Translations
from nondum.host.mind.mind import Mind
from nondum.host.mind.translation import LONGEST_WORDS, gathered
from nondum.host.peers.remote_calls import Reaches
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall

METHOD = "goal.translate"
MOST_ANSWERS = 16
"""Answers of one peer that are looked at."""


class Translating:
    """Has peers translate, and translates for them."""

    def __init__(
        self,
        mind: Callable[[], Mind],
        reach: Reaches,
        peers: Callable[[], Sequence[str]],
        *,
        deadline_s: float,
    ) -> None:
        self._mind, self._reach, self._peers = mind, reach, peers
        self._deadline_s = deadline_s
        self._served: set[str] = set()
        """Peers for which components of this host are at it."""

    def ask(self, words: str, vocabulary: Mapping[str, Any]) -> Answers:
        """Ask every peer; its components are called `component@peer` in the answers."""
        return {peer: self._asked(peer, words, vocabulary) for peer in self._peers()}

    async def _asked(self, peer: str, words: str, vocabulary: Mapping[str, Any]) -> Translations:
        body = {"words": words, "vocabulary": dict(vocabulary)}
        try:
            told = await self._reach.call(peer, METHOD, body, deadline_s=self._deadline_s)
        except NondumError as error:
            if error.code == "METHOD_UNKNOWN":  # it runs a version that does not translate
                return {}
            raise
        match told.get("answers"):
            case dict(answers) if len(answers) <= MOST_ANSWERS and _are_answers(answers):
                return {f"{printable(name)}@{peer}": answer for name, answer in answers.items()}
        raise CallFailed(Problem("CALL_MALFORMED", f"{peer} has given no answer", where=METHOD))

    async def serve(self, incoming: IncomingCall) -> Body:
        """Translate what a peer's person said, by the vocabulary of that host: `answers`, which it
        checks. One sentence of a peer at a time. Raises `CallFailed`."""
        match incoming.args:
            case {"words": str(words), "vocabulary": dict(vocabulary)}:
                is_right = 0 < len(words) <= LONGEST_WORDS
            case _:
                is_right = False
        if not is_right:
            raise CallFailed(Problem("CALL_MALFORMED", "words are translated by a vocabulary"))
        caller = incoming.caller.name
        if caller in self._served:
            raise CallFailed(Problem("PEER_BUSY", "it translates another sentence for this host"))
        self._served.add(caller)
        try:
            asked = self._mind().plugins.translations(words, vocabulary)
            answers, problems = await gathered(asked, self._deadline_s)
        finally:
            self._served.discard(caller)
        if problems and not answers:
            raise CallFailed(*problems)
        return {"answers": answers}


def _are_answers(answers: Mapping[Any, Any]) -> bool:
    return all(isinstance(key, str) and isinstance(one, dict) for key, one in answers.items())
