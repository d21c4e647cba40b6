"""Files that are not what was listed: changed, cut, swapped, or of another release."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tests.faults.hostile.case import Bench, HostileDrive, spoilt, tampered
from tests.faults.hostile.payload_files import PayloadFiles

MISMATCH, MISSING = "HASH_MISMATCH", "FILE_MISSING"

Change = Callable[[bytes], bytes]


def flipped(at: float) -> Change:
    def change(data: bytes) -> bytes:
        place = min(int(len(data) * at), len(data) - 1)
        return data[:place] + bytes([data[place] ^ 0x20]) + data[place + 1 :]

    return change


CHANGES: dict[str, Change] = {
    "first-byte": flipped(0.0),
    "middle-byte": flipped(0.5),
    "last-byte": flipped(1.0),
    "byte-more": lambda data: data + b"\n",
    "byte-less": lambda data: data[:-1],
    "emptied": lambda data: b"",
    "much-longer": lambda data: data + bytes(4 * 2**20),
}


def changed(file: str, name: str, change: Change) -> HostileDrive:
    def spoil(made: PayloadFiles) -> PayloadFiles:
        path = FILES[file](made)
        return replace(made, swapped={path: change(made.files[path])})

    return spoilt(f"{file}-{name}", MISMATCH, spoil)


FILES: dict[str, Callable[[PayloadFiles], str]] = {
    "manifest": lambda made: "payload.toml",
    "lock": lambda made: made.lock,
    "index": lambda made: "index.json",
    "wheel": lambda made: wheel_of(made),
}


def wheel_of(made: PayloadFiles) -> str:
    """Path of the payload's only wheel."""
    return next(path for path in made.files if path.endswith(".whl"))


def exchanged(made: PayloadFiles) -> PayloadFiles:
    """Each of two files is whole, and lies in the other's place."""
    one, other = "payload.toml", "index.json"
    return replace(made, swapped={one: made.files[other], other: made.files[one]})


def of_another_release(made: PayloadFiles) -> PayloadFiles:
    """The wheel and the lock of the next release, under the list of this one."""
    wheel = wheel_of(made)
    swapped = {wheel: made.files[wheel] + b"2", made.lock: made.files[made.lock] + b"\n"}
    return replace(made, swapped=swapped)


def sparse(bench: Bench) -> None:
    """A terabyte of nothing where a few bytes were listed."""
    with (bench.folder / "payload.toml").open("r+b") as file:
        file.truncate(2**40)


def unlisted(path: str) -> Callable[[PayloadFiles], PayloadFiles]:
    """A file that is on the drive and not in the list: it is not there for anybody."""
    return lambda made: replace(made.without(path), swapped={path: made.files[path]})


DRIVES: tuple[HostileDrive, ...] = (
    *(changed(file, name, change) for file in FILES for name, change in CHANGES.items()),
    spoilt("files-exchanged", MISMATCH, exchanged),
    spoilt("files-of-two-releases", MISMATCH, of_another_release),
    tampered("terabyte-of-nothing", MISMATCH, sparse),
    spoilt("manifest-unlisted", MISSING, unlisted("payload.toml")),
    spoilt("index-unlisted", MISSING, unlisted("index.json")),
    spoilt("lock-unlisted", MISSING, lambda made: unlisted(made.lock)(made)),
    spoilt("wheel-unlisted", "LOCK_PATH", lambda made: unlisted(wheel_of(made))(made)),
)
