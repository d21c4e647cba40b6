"""What tests of links may ask for."""

from __future__ import annotations

import pytest
from tests.transport.peers import hosts


@pytest.fixture(params=hosts.KINDS)
def each_kind_of_sockets(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the test for sockets in the daemon's process, and for sockets in a separate process."""
    monkeypatch.setattr(hosts, "SOCKETS", hosts.KINDS[request.param])
