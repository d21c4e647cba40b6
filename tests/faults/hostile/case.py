"""One hostile drive: how it is made, and what it must come to."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from tests.faults.hostile.payload_files import PayloadFiles, Sign, plain, sound_payload, unsigned
from tests.kit.payloads import make_payload

from nondum.wheelhouse.format import contents

NO_PAYLOAD = "DRIVE_NOT_PAYLOAD"


@dataclass(frozen=True)
class Bench:
    """What a drive is made with."""

    drive: Path
    """An empty folder that is to become the drive."""
    number: int
    canary: Path
    """Whatever could run makes this file, which must never be there."""
    sign: Sign = unsigned

    @property
    def payload_id(self) -> str:
        """The id of the one payload on it."""
        return f"org.hostile.h{self.number}"

    @property
    def folder(self) -> Path:
        """Where that payload lies."""
        return self.drive / "nondum" / self.payload_id

    def payload_files(self) -> PayloadFiles:
        """The files of a sound payload, to be spoilt."""
        return sound_payload(self.payload_id)

    def sound(self) -> None:
        """A payload that works."""
        part = plain(self.payload_id.rpartition(".")[2], with_sdk=True)
        folder = make_payload(self.drive, part, payload_id=self.payload_id)
        signature = self.sign((folder / contents.NAME).read_bytes())
        if signature is not None:
            (folder / contents.SIGNATURE_NAME).write_bytes(signature)

    def python(self) -> bytes:
        """Python that makes the canary."""
        return f"import pathlib; pathlib.Path({str(self.canary)!r}).touch()\n".encode()

    def shell(self) -> bytes:
        """The same for a shell."""
        return f"#!/bin/sh\n: > '{self.canary}'\n".encode()


@dataclass(frozen=True)
class HostileDrive:
    """A drive that must be refused, or seen through."""

    name: str
    """What is wrong with it, in a word or two."""
    code: str
    """The one code that it is told with; empty: it is sound in spite of what lies around it."""
    make: Callable[[Bench], None]
    is_image: bool = False
    """It is made as a file `<drive>.img`, for a block device."""
    also: frozenset[str] = frozenset()
    """Further codes that may be told, since that is wrong with it, too."""
    beside: int = 0
    """How many sound payloads lie beside what is wrong, and must be let in."""

    def is_right(self, codes: Collection[str], active: int) -> bool:
        """Whether these codes, and no others, are what it is to be told with, and whether as many
        payloads were let in as should be."""
        told = set(codes)
        is_told = told - self.also == ({self.code} if self.code else set())
        return is_told and active == (self.beside if self.code else max(1, self.beside))


Spoil = Callable[[PayloadFiles], PayloadFiles]
Tamper = Callable[[Bench], None]


def spoilt(name: str, code: str, spoil: Spoil) -> HostileDrive:
    """A payload that was wrong already when it was sealed."""

    def make(bench: Bench) -> None:
        spoil(bench.payload_files()).write(bench.drive, bench.sign)

    return HostileDrive(name, code, make)


def tampered(name: str, code: str, tamper: Tamper) -> HostileDrive:
    """A sound drive that something was done to afterwards."""

    def make(bench: Bench) -> None:
        bench.payload_files().write(bench.drive, bench.sign)
        tamper(bench)

    return HostileDrive(name, code, make)


def edited(name: str, code: str, path: str, old: str, new: str) -> HostileDrive:
    """A payload with other words in one of its files; `LOCK` is its lock."""

    def spoil(made: PayloadFiles) -> PayloadFiles:
        where = made.lock if path == LOCK else path
        return made.edited(where, old.replace("ID", made.component), new)

    return spoilt(name, code, spoil)


LOCK = "pylock"
MANIFEST = "payload.toml"
INDEX = "index.json"
