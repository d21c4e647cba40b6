"""What people's tools may ask and have done about whose payloads run here."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.core.events.event import Emit, Event
from nondum.host.manager.payload_trust import PayloadTrust
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.trust import trust_file
from nondum.wheelhouse.trust.succession import SignedFile


@frozen
class TrustOrders:
    """Each method is a verb."""

    trust: PayloadTrust
    emit: Emit

    async def show(self, arguments: Arguments) -> dict[str, Any]:
        """The active trust file."""
        return self.trust.row()

    async def give(self, arguments: Arguments) -> dict[str, Any]:
        """Take the `file` (its text) that follows the active one, with its `signature`.

        Raises `TrustRefused`.
        """
        signature = arguments.optional_text("signature")
        data = arguments.text("file").encode()
        signed = signature.encode("ascii", "replace") if signature is not None else None
        return self._done(await self.trust.give(SignedFile(data, signed, trust_file.NAME)))

    async def reload(self, arguments: Arguments) -> dict[str, Any]:
        """Read the first file again, since it was changed. Raises `TrustRefused`."""
        return self._done(await self.trust.reload())

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"trust": self.show, "trust_give": self.give, "trust_reload": self.reload}

    def _done(self, events: tuple[Event, ...]) -> dict[str, Any]:
        for event in events:
            self.emit(event)
        return {**self.trust.row(), "changed": bool(events)}
