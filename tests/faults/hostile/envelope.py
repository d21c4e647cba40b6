"""Contents lists that are none, or not for this host."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tests.faults.hostile.case import Bench, HostileDrive, spoilt, tampered
from tests.faults.hostile.payload_files import LEFT_OUT, PayloadFiles

HEADER, ENTRY, ENCODING = "CONTENTS_HEADER", "CONTENTS_ENTRY", "CONTENTS_ENCODING"
SCHEMA = "SCHEMA_VERSION"
HASH = "0" * 64


def header(name: str, key: str, value: str, code: str = HEADER) -> HostileDrive:
    return spoilt(name, code, lambda made: replace(made, header={key: value}))


def rewritten(name: str, code: str, change: Callable[[bytes], bytes]) -> HostileDrive:
    return spoilt(name, code, lambda made: replace(made, rewrite=change))


def entries(name: str, code: str, change: Callable[[list[str]], list[str]]) -> HostileDrive:
    return spoilt(name, code, lambda made: replace(made, relist=change))


def added(name: str, code: str, line: str) -> HostileDrive:
    """With one more entry, in its place."""
    by_path = {"key": lambda text: text.rpartition("  ")[2]}
    return entries(name, code, lambda lines: sorted([*lines, line], **by_path))  # type: ignore[call-overload]  # a sorting key


def first(change: Callable[[str], str]) -> Callable[[list[str]], list[str]]:
    """Changes the first entry."""
    return lambda lines: [change(lines[0]), *lines[1:]]


def sparse(size: int) -> Callable[[Bench], None]:
    def tamper(bench: Bench) -> None:
        with (bench.folder / "CONTENTS").open("r+b") as file:
            file.truncate(size)

    return tamper


def unlink(bench: Bench) -> None:
    (bench.folder / "CONTENTS").unlink()


def crlf(data: bytes) -> bytes:
    return data.replace(b"\n", b"\r\n")


def after_header(line: bytes) -> Callable[[bytes], bytes]:
    return lambda data: data.replace(b"\n\n", b"\n" + line + b"\n\n", 1)


def release_last(data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = next(n for n, line in enumerate(lines) if line.startswith(b"release: "))
    line = lines.pop(at)
    end = lines.index(b"")
    return b"\n".join([*lines[:end], line, *lines[end:]])


def many_files(made: PayloadFiles) -> PayloadFiles:
    return replace(made, files={**made.files, **{f"notes/{n}.txt": b"" for n in range(512)}})


DRIVES: tuple[HostileDrive, ...] = (
    tampered("no-list", "CONTENTS_MISSING", unlink),
    tampered("endless-list", "TOO_LARGE", sparse(2**30)),
    tampered("list-a-byte-too-long", "TOO_LARGE", sparse(256 * 1024 + 1)),
    rewritten("empty-list", SCHEMA, lambda data: b""),
    rewritten("only-line-ends", SCHEMA, lambda data: b"\n" * 1000),
    rewritten("format-of-tomorrow", SCHEMA, lambda data: data.replace(b"payload 1", b"payload 2")),
    rewritten("format-of-another", SCHEMA, lambda data: b"SHA256SUMS\n" + data),
    rewritten("windows-line-ends", SCHEMA, crlf),
    rewritten("byte-order-mark", ENCODING, lambda data: b"\xef\xbb\xbf" + data),
    rewritten("utf-16", ENCODING, lambda data: data.decode().encode("utf-16")),
    rewritten("random-bytes", ENCODING, lambda data: bytes(range(256)) * 64),
    rewritten("nul-in-header", HEADER, lambda data: data.replace(b"version: 1.0", b"version: \0")),
    rewritten("no-last-line-end", ENTRY, lambda data: data[:-1]),
    rewritten("cut-in-an-entry", ENTRY, lambda data: data[:-40]),
    rewritten("cut-in-the-header", HEADER, lambda data: data[:60].rpartition(b"\n")[0] + b"\n\n"),
    entries("blank-line-between", ENTRY, lambda lines: [lines[0], "", *lines[1:]]),
    rewritten("unknown-header", HEADER, after_header(b"run: install.sh")),
    rewritten("header-twice", HEADER, after_header(b"release: 9")),
    rewritten("headers-in-another-order", HEADER, release_last),
    rewritten("header-without-colon", HEADER, after_header(b"release 9")),
    *(
        header(f"no-{key}", key, LEFT_OUT)
        for key in ("id", "version", "release", "fleet", "minimum-nondum", "built")
    ),
    header("id-in-capitals", "id", "Org.Hostile.X"),
    header("id-without-dots", "id", "hostile"),
    header("id-that-climbs", "id", "../../etc"),
    header("id-too-long", "id", "org." + "x" * 200),
    header("id-with-a-lookalike", "id", "оrg.example.lamp", ENCODING),
    header("id-with-blanks", "id", "org.example lamp"),
    header("version-in-words", "version", "latest"),
    header("version-empty", "version", ""),
    header("version-of-many-digits", "version", "9" * 5000),
    header("release-negative", "release", "-1"),
    header("release-huge", "release", str(2**62)),
    header("release-of-many-digits", "release", "9" * 5000),
    header("release-hexadecimal", "release", "0x10"),
    header("release-with-zeros", "release", "007"),
    header("release-a-fraction", "release", "1.5"),
    header("fleet-in-capitals", "fleet", "ALL"),
    header("built-in-words", "built", "yesterday"),
    header("nondum-of-tomorrow", "minimum-nondum", "99.0", "NONDUM_VERSION"),
    header("nondum-in-words", "minimum-nondum", "newest"),
    header("nondum-of-many-digits", "minimum-nondum", "9" * 5000),
    spoilt("too-many-files", "TOO_MANY_FILES", many_files),
    entries("not-sorted", ENTRY, lambda lines: lines[::-1]),
    entries("file-twice", "PATH_UNSAFE", lambda lines: [lines[0], *lines]),
    entries("hash-in-capitals", ENTRY, first(lambda line: line[:64].upper() + line[64:])),
    entries("hash-too-short", ENTRY, first(lambda line: line[1:])),
    entries("hash-of-another-kind", ENTRY, first(lambda line: line[:40] + line[64:])),
    entries("one-blank", ENTRY, first(lambda line: line.replace("  ", " "))),
    entries("tabs", ENTRY, first(lambda line: line.replace("  ", "\t"))),
    added("size-negative", ENTRY, f"{HASH}  -1  zz"),
    added("size-with-zeros", ENTRY, f"{HASH}  007  zz"),
    added("size-of-many-digits", ENTRY, f"{HASH}  {'9' * 4000}  zz"),
    added("size-of-nine-gigabytes", "TOO_LARGE", f"{HASH}  {9 * 2**30}  zz"),
    added("lists-itself", ENTRY, f"{HASH}  1  CONTENTS"),
    added("lists-its-signature", ENTRY, f"{HASH}  1  CONTENTS.sig"),
)
