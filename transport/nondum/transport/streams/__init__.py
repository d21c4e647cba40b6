"""Streams between hosts: one connection a stream, granted and claimed, never more than fits."""

from nondum.transport.streams.exporter import Exporter
from nondum.transport.streams.fidelity import Fidelity
from nondum.transport.streams.incoming import Incoming, Place
from nondum.transport.streams.outgoing import Outgoing
from nondum.transport.streams.packets import Coding, Frame

__all__ = ["Coding", "Exporter", "Fidelity", "Frame", "Incoming", "Outgoing", "Place"]
