"""Streams between hosts: one connection a stream, granted and claimed, never more than fits."""

from nondum.transport.bridge.exporter import Exporter
from nondum.transport.bridge.fidelity import Fidelity
from nondum.transport.bridge.incoming import Incoming, Place
from nondum.transport.bridge.outgoing import Outgoing
from nondum.transport.bridge.packets import Coding, Frame

__all__ = ["Coding", "Exporter", "Fidelity", "Frame", "Incoming", "Outgoing", "Place"]
