"""How messages get to workers, and frames from worker to worker."""

from nondum.transport.link.token_bucket import TokenBucket
from nondum.transport.link.worker_link import WorkerLink, agreed_version, link_sockets
from nondum.transport.streams.broker import StreamBroker, Wire

__all__ = [
    "StreamBroker",
    "TokenBucket",
    "Wire",
    "WorkerLink",
    "agreed_version",
    "link_sockets",
]
