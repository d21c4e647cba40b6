"""The lamp itself. This one exists in the log only: put your hardware here."""

from __future__ import annotations

import logging

from nondum.sdk import BehaviourFailed


class Lamp:
    """A lamp that can be switched."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self.is_lit = False

    def switch_on(self) -> None:
        """Light it."""
        self.is_lit = True
        self._log.info("lamp on")

    def switch_off(self) -> None:
        """Put it out."""
        self.is_lit = False
        self._log.info("lamp off")

    def check(self) -> None:
        """Raise `BehaviourFailed` when it does not shine though it should."""
        if not self.is_lit:
            raise BehaviourFailed("the lamp went out")
