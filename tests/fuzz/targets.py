"""Everything of nondum that reads bytes from somebody else, as targets.

Each is read as the host reads it, text from its UTF-8 bytes; seeds are what the project's own
writers write.
"""

from __future__ import annotations

from tests.fuzz.readers import fragments, host, network, payload, trust

TARGETS = (
    *trust.TARGETS,
    *payload.TARGETS,
    *fragments.TARGETS,
    *network.TARGETS,
    *host.TARGETS,
)
