"""Mistakes of a plugin's author that are noticed while it runs: each told once, with the line."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.place import author_place

Carry: TypeAlias = Callable[..., Any]
"""Calls a function on the worker's loop: at once, or from another thread."""


def at_once(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """Call a function: this is the loop already."""
    return function(*arguments, **keywords)


class Faults:
    """Watches what an author's code sends and says, and tells of messages that are wrong."""

    def __init__(self, tell: Callable[[Problem], bool], log: logging.Logger) -> None:
        """`tell` passes a problem on and says whether it was the first time."""
        self._tell, self._log = tell, log

    def watch(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        carry: Carry = at_once,
        **keywords: Any,
    ) -> None:
        """Call a function on the loop, from the author's own thread.

        A wrong message is told, and raised again with the author's line in it.
        """
        try:
            carry(function, *arguments, **keywords)
        except MessageInvalid as error:
            place = author_place()
            problems = tuple(located(problem, place) for problem in error.problems)
            for problem in problems:
                carry(self.tell, problem)
            raise MessageInvalid(*problems) from None  # its frames are all the SDK's
        except TypeError as error:  # a message of another type
            carry(self.tell, Problem("MESSAGE_TYPE", str(error), where=author_place()))
            raise

    def tell(self, problem: Problem) -> None:
        """Tell the host and the log."""
        if self._tell(problem):
            self._log.error("%s", problem)


def located(problem: Problem, place: str) -> Problem:
    """A problem of a message, whose `where` is its field, with the author's place before that."""
    if not place:
        return problem
    message = f"{problem.where}: {problem.message}" if problem.where else problem.message
    return replace(problem, where=place, message=message)
