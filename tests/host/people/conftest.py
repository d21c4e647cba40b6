"""A robot whose mind runs, for what people are told of it."""

from __future__ import annotations

from tests.host.mind.conftest import robot

__all__ = ["robot"]
