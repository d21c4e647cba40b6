"""What lies beside payloads: trust files and certificates that are none, and payloads that are well
and must not suffer for the others."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from tests.faults.hostile.case import NO_PAYLOAD, Bench, HostileDrive
from tests.faults.hostile.folders import bare, sound_beside
from tests.faults.hostile.objects import bound_socket
from tests.faults.hostile.signing import MAKER, MALFORMED, PURPOSE, ROOT, STRANGER, TOO_LARGE, trust
from tests.kit.signing import Key

from nondum.wheelhouse.trust import sshsig

SIGNATURE, UNSAFE = "TRUST_SIGNATURE", "PATH_UNSAFE"
TRUST, PEERS = "nondum-trust", "nondum-peers"

Write = Callable[[Path], None]
"""Puts something into a folder."""


def folder(name: str, write: Write) -> Callable[[Bench], None]:
    def make(bench: Bench) -> None:
        made = bench.drive / name
        made.mkdir(parents=True)
        write(made)

    return make


def trusting(name: str, code: str, write: Write) -> HostileDrive:
    """A payload that works, beside trust files that are not to be believed."""
    make = sound_beside(folder(TRUST, write))
    return HostileDrive(f"trust-{name}", code, make, beside=1)


def peering(name: str, write: Write) -> HostileDrive:
    """A payload that works, beside certificates for other hosts, or none: no effect here."""
    return HostileDrive(f"peers-{name}", "", sound_beside(folder(PEERS, write)))


def file(
    data: bytes, signed: Callable[[bytes], bytes] | None = None, name: str = "t.toml"
) -> Write:
    def write(made: Path) -> None:
        (made / name).write_bytes(data)
        if signed is not None:
            (made / f"{name}.sig").write_bytes(signed(data))

    return write


def by(key: Key, namespace: str = sshsig.TRUST) -> Callable[[bytes], bytes]:
    return lambda data: key.sign(data, namespace)


def version(number: int) -> bytes:
    """The host's own trust file, but for its version."""
    text = trust()
    assert "version = 1\n" in text
    return text.replace("version = 1\n", f"version = {number}\n").encode()


def in_number(made: Path) -> None:
    """Each as long as it may be."""
    for number in range(64):
        (made / f"{number:02}.toml").write_bytes(f"# {number}\n".encode().ljust(64 * 1024, b"#"))


def names_without_number(made: Path) -> None:
    for number in range(3000):
        (made / f"{number}.certificate").write_bytes(b"\0" * 1024)


def sparse(name: str) -> Write:
    def write(made: Path) -> None:
        with (made / name).open("wb") as out:
            out.truncate(2**40)

    return write


def sparse_signature(made: Path) -> None:
    file(version(2))(made)
    sparse("t.toml.sig")(made)


def at(name: str, put: Write) -> Write:
    return lambda made: put(made / name)


def linked(to: str, name: str) -> Callable[[Bench], None]:
    return lambda bench: (bench.drive / name).symlink_to(to)


def beside_a_changed_one(bench: Bench) -> None:
    """One payload is well, and another has a changed file."""
    other = Bench(bench.drive, (bench.number + 1) * 1000 + 1, bench.canary, bench.sign)
    bench.sound()
    other.payload_files().write(bench.drive, bench.sign)
    with (other.folder / "index.json").open("ab") as index:
        index.write(b" ")


def beside_sixty(bench: Bench) -> None:
    """As many payloads as a drive may have, and one of them is well."""
    bench.sound()
    for number in range(63):
        (bench.drive / f"nondum/org.hostile.empty{number}").mkdir()


def twice(bench: Bench) -> None:
    """Two folders with one and the same payload; one of them is not called as it is."""
    bench.sound()
    copied = bench.drive / "nondum/org.hostile.another"
    copied.mkdir()
    for path in bench.folder.rglob("*"):
        target = copied / path.relative_to(bench.folder)
        target.mkdir() if path.is_dir() else target.write_bytes(path.read_bytes())


def of_another_case(bench: Bench) -> None:
    """Folders that are one but for case, of which payloads have but one."""
    bench.sound()
    for path in ("Nondum", "NONDUM", f"nondum/{bench.payload_id.title()}"):
        (bench.drive / path).mkdir()
        (bench.drive / path / "CONTENTS").write_bytes(b"x")


DRIVES: tuple[HostileDrive, ...] = (
    HostileDrive("one-is-changed", "HASH_MISMATCH", beside_a_changed_one, beside=1),
    HostileDrive("one-of-sixty-four", "CONTENTS_MISSING", beside_sixty, beside=1),
    HostileDrive("payload-twice", "", twice),
    HostileDrive("folders-but-for-case", "", of_another_case),
    trusting("unsigned", SIGNATURE, file(version(2))),
    trusting("of-a-stranger", SIGNATURE, file(version(2), by(STRANGER))),
    trusting("of-a-maker", SIGNATURE, file(version(2), by(MAKER))),
    trusting("signed-as-a-payload", PURPOSE, file(version(2), by(ROOT, sshsig.PAYLOAD))),
    trusting("that-skips-versions", "TRUST_VERSION", file(version(9), by(ROOT))),
    trusting("of-the-same-version", "TRUST_CONFLICT", file(version(1) + b"# 2\n", by(ROOT))),
    trusting("of-noise", MALFORMED, file(bytes(range(256)), lambda data: data)),
    trusting("bomb", SIGNATURE, file(b"a" + b".a" * 30_000 + b" = 1", by(STRANGER))),
    trusting("of-a-terabyte", TOO_LARGE, sparse("t.toml")),
    trusting("with-a-signature-of-a-terabyte", TOO_LARGE, sparse_signature),
    trusting("in-number", SIGNATURE, in_number),
    trusting("a-link", UNSAFE, at("t.toml", lambda path: path.symlink_to("/etc/passwd"))),
    trusting("a-pipe", UNSAFE, at("t.toml", os.mkfifo)),
    trusting("a-socket", UNSAFE, at("t.toml", bound_socket)),
    trusting("a-folder", UNSAFE, at("t.toml", Path.mkdir)),
    trusting("of-the-longest-name", SIGNATURE, file(version(2), name="t" * 250 + ".toml")),
    HostileDrive("trust-litter", "", sound_beside(folder(TRUST, file(b"", name="._t.toml")))),
    HostileDrive(
        "trust-named-to-clear", "", sound_beside(folder(TRUST, file(b"", name="\x1b[2J.toml")))
    ),
    HostileDrive("trust-folder-a-link", "", sound_beside(linked("/etc", TRUST))),
    HostileDrive("peers-folder-a-link", "", sound_beside(linked("/etc", PEERS))),
    peering("of-noise", file(bytes(range(256)), name="certificate")),
    peering("of-a-terabyte", sparse("a.certificate")),
    peering("a-link", at("certificate", lambda path: path.symlink_to("/etc/passwd"))),
    peering("a-pipe", at("certificate", os.mkfifo)),
    peering("a-folder", at("certificate", Path.mkdir)),
    peering("in-number", names_without_number),
    bare("peers-alone-and-empty", NO_PAYLOAD, folder(PEERS, lambda made: None)),
)
