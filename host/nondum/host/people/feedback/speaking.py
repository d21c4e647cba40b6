"""What is said aloud of a state, by components that speak.

What people are told is spoken anyway, unless it is too long for that: of refusals, then, the short
form is said here. That a drive may be pulled is told nowhere else.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable

from nondum.host.core.feedback_state import State, StateReason


class Aloud:
    """Says the states that no announcement says; satisfies `Output`."""

    def __init__(
        self,
        say: Callable[[str], Awaitable[None]],
        told: Callable[[], Iterable[str]],
        longest: int,
    ) -> None:
        """`told` are the last sentences that people were told; those of up to `longest` characters
        are spoken without this."""
        self._say, self._told, self._longest = say, told, longest

    async def show(self, reason: StateReason) -> None:
        """Say it, where there is something to say."""
        aloud = (text for text in self._told() if len(text) <= self._longest)
        if (text := spoken(reason, aloud, self._longest)) is not None:
            await self._say(text)

    async def end(self) -> None:
        """What was said was said."""


def spoken(reason: StateReason, aloud: Iterable[str], longest: int) -> str | None:
    """What is to be said of a state, `aloud` being what is said already; None: nothing."""
    is_news = reason.state is State.SAFE or (
        reason.state in (State.REFUSED, State.HELP) and reason.code != ""
    )
    subject = reason.payload or reason.drive
    if not is_news or not subject:
        return None
    if any(subject in text and reason.code in text for text in aloud if reason.code):
        return None
    return shortened(reason.sentence, longest)


def shortened(text: str, longest: int) -> str:
    """A sentence, cut between two words where it is too long.

    >>> shortened("one two three", 8)
    'one two…'
    """
    if len(text) <= longest:
        return text
    return f"{text[:longest].rpartition(' ')[0] or text[: longest - 1]}…"
