"""Certificates that a drive carries from a fleet's owner to its hosts.

    <drive>/nondum-peers/certificate           one host's
    <drive>/nondum-peers/<any>.certificate     many hosts': each takes its own

A drive may bring a host what lets it in elsewhere (see `PeerTrustStore.offer`). Which hosts a host
lets in, a person says: `nondum peers trust-fleet <drive>/nondum-peers/fleet.pub`.
"""

from __future__ import annotations

import itertools
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from nondum.host.jobs.look import CERTIFICATES
from nondum.transport.peers.certificate import MAX_BYTES

MOST_FILES = 1000


def certificates_on(drive: Path) -> Iterator[bytes]:
    """What may be certificates, unread as yet. Blocks while the drive does: never on the loop."""
    folder = drive / CERTIFICATES
    try:
        if folder.is_symlink():
            return
        with os.scandir(folder) as entries:
            names = sorted(entry.name for entry in itertools.islice(entries, MOST_FILES))
    except OSError:
        return
    for name in names:
        is_one = name == "certificate" or name.endswith(".certificate")
        if is_one and (data := _read(folder / name)):
            yield data


def _read(path: Path) -> bytes:
    """A plain file's bytes, if they are few; nothing for whatever else a drive may hold."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return b""
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return b""
        data = os.read(descriptor, MAX_BYTES + 1)
    except OSError:
        return b""
    finally:
        os.close(descriptor)
    return data if len(data) <= MAX_BYTES else b""
