"""What goes wrong with catalogues, as leaves of the one tree in `nondum.sdk.errors`.

NondumError
└── EntryRefused          an entry, or all of them, that no peer could be told
"""

from __future__ import annotations

from nondum.sdk.errors import NondumError


class EntryRefused(NondumError):
    """An entry of the catalogue, or all of them together, that no peer could be told."""
