"""How messages get to workers, and frames from worker to worker."""

from nondum.transport.broker import StreamBroker, Wire
from nondum.transport.token_bucket import TokenBucket
from nondum.transport.worker_link import WorkerLink, agreed_version, link_sockets

__all__ = [
    "StreamBroker",
    "TokenBucket",
    "Wire",
    "WorkerLink",
    "agreed_version",
    "link_sockets",
]
