"""Discovery: hints where other hosts are, by multicast and by asking; they are never trusted."""

from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.discovery import Discovery
from nondum.transport.discovery.hint import Hint, Source
from nondum.transport.discovery.status import DiscoveryStatus, InterfaceRow, StaticRow

__all__ = [
    "Announcement",
    "Discovery",
    "DiscoveryStatus",
    "Hint",
    "InterfaceRow",
    "Source",
    "StaticRow",
]
