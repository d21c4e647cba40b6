"""Questions about one robot that people ask another one: the host that they name answers them."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence

from nondum.host.core.printable import printable
from nondum.host.peers.goals import ASK_S, MAX_WORDS
from nondum.host.peers.remote_calls import Reaches
from nondum.planning.words.addressee import addressed_to
from nondum.planning.words.asking import question_in
from nondum.sdk.errors import GoalRefused, NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall

METHOD = "question.ask"


class Asking:
    """Asks peers, and answers them."""

    def __init__(
        self,
        reach: Reaches,
        peers: Callable[[], Sequence[str]],
        answer: Callable[[str], Awaitable[str | None]],
    ) -> None:
        """`answer` answers a question about this host; None: it is none."""
        self._reach, self._peers, self._answer = reach, peers, answer

    async def ask(self, words: str) -> str | None:
        """What the peer says whose name words begin with; None: they are no question to a peer.

        Raises `GoalRefused` (METHOD_UNKNOWN where the peer is of a version that does not answer,
        or why it is not reached).
        """
        peer, rest = addressed_to(words, self._peers())
        if peer is None or question_in(rest) is None:
            return None
        try:
            told = await self._reach.call(peer, METHOD, {"words": rest}, deadline_s=ASK_S)
        except NondumError as error:
            is_older = error.code == "METHOD_UNKNOWN"
            raise GoalRefused(*((_older(peer),) if is_older else error.problems)) from error
        text = told.get("answer")
        if not isinstance(text, str):
            wrong = f"{peer} has given no answer"
            raise GoalRefused(Problem("CALL_MALFORMED", wrong, fix="ask it there"))
        return f"{peer}: {printable(text[:MAX_WORDS])}"

    async def serve(self, incoming: IncomingCall) -> Body:
        """Answer a question that a peer's person asks: `answer`. Raises `CallFailed`."""
        words = incoming.args.get("words")
        is_asked = isinstance(words, str) and len(words) <= MAX_WORDS
        answer = await self._answer(str(words)) if is_asked else None
        if answer is None:
            raise CallFailed(Problem("CALL_MALFORMED", "a question is asked in known words"))
        return {"answer": answer[:MAX_WORDS]}


def _older(peer: str) -> Problem:
    told = f"{peer} runs a version of nondum that does not answer questions from other hosts"
    return Problem(
        "METHOD_UNKNOWN", told, fix="ask it there, or run the same version of nondum on both hosts"
    )
