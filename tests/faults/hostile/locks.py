"""Locks that name what is no wheel, or lies elsewhere, or is another one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tests.faults.hostile.case import LOCK, HostileDrive, edited, spoilt
from tests.faults.hostile.changes import wheel_of
from tests.faults.hostile.payload_files import PayloadFiles, plain, sha256
from tests.kit.payloads import make_wheel

NOT_WHEEL, PATH, INVALID, HASHES = "LOCK_NOT_WHEEL", "LOCK_PATH", "LOCK_INVALID", "LOCK_HASH"
TOML = "LOCK_TOML"


def text(name: str, code: str, change: Callable[[str], str]) -> HostileDrive:
    return spoilt(name, code, lambda made: made.with_file(made.lock, change(made.text(made.lock))))


def whole(name: str, code: str, data: str | bytes) -> HostileDrive:
    return spoilt(name, code, lambda made: made.with_file(made.lock, data))


def package(name: str, code: str, lines: str) -> HostileDrive:
    """With one more package."""
    header = '\n[[packages]]\nname = "more"\nversion = "1"\n'
    return text(name, code, lambda good: good + header + lines + "\n")


def path(name: str, to: str) -> HostileDrive:
    """Its wheel lies elsewhere."""

    def spoil(made: PayloadFiles) -> PayloadFiles:
        wheel = wheel_of(made)
        return made.edited(made.lock, wheel, wheel.replace("wheels/", to))

    return spoilt(name, PATH, spoil)


def wheel_line(name: str, code: str, old: Callable[[PayloadFiles], str], new: str) -> HostileDrive:
    return spoilt(name, code, lambda made: made.edited(made.lock, old(made), new))


def digest_of(made: PayloadFiles) -> str:
    return sha256(made.files[wheel_of(made)])


def needing(requirement: str) -> Callable[[PayloadFiles], PayloadFiles]:
    """Its wheel needs what the lock has not."""

    def spoil(made: PayloadFiles) -> PayloadFiles:
        import tempfile
        from pathlib import Path

        part = plain(made.component)
        with tempfile.TemporaryDirectory() as folder:
            wheel = make_wheel(
                Path(folder),
                part.distribution,
                "1.0",
                {f"{part.module}.py": ""},
                requires=[requirement],
                entry_points={"nondum.plugins": {part.id: part.module}},
            )
            data = wheel.read_bytes()
        where, before = wheel_of(made), made.files[wheel_of(made)]
        swapped = made.with_file(where, data).edited(made.lock, sha256(before), sha256(data))
        return swapped.edited(made.lock, f"size = {len(before)}", f"size = {len(data)}")

    return spoil


def tagged(tag: str) -> Callable[[PayloadFiles], PayloadFiles]:
    """Its wheel says that it is for another machine."""

    def spoil(made: PayloadFiles) -> PayloadFiles:
        where, data = wheel_of(made), made.files[wheel_of(made)]
        other = where.replace("py3-none-any", tag)
        renamed = made.without(where).with_file(other, data)
        before, after = where.rpartition("/")[2], other.rpartition("/")[2]
        return renamed.edited(made.lock, before, after)

    return spoil


DRIVES: tuple[HostileDrive, ...] = (
    whole("lock-empty", INVALID, ""),
    whole("lock-cut", TOML, "lock-version = ["),
    whole("lock-binary", "NOT_UTF8", bytes(range(128, 256))),
    whole(
        "lock-of-no-packages",
        "LOCK_INCOMPLETE",
        'lock-version = "1.0"\ncreated-by = "t"\npackages = []\n',
    ),
    edited("lock-of-tomorrow", INVALID, LOCK, '"1.0"\ncreated', '"9.0"\ncreated'),
    package(
        "lock-source",
        NOT_WHEEL,
        '[packages.sdist]\nname="more-1.tar.gz"\npath="wheels/more-1.tar.gz"\nhashes={sha256="00"}',
    ),
    package(
        "lock-repository",
        NOT_WHEEL,
        '[packages.vcs]\ntype="git"\nurl="https://example.org/x"\ncommit-id="0"',
    ),
    package("lock-folder", NOT_WHEEL, '[packages.directory]\npath="../../x"\neditable=true'),
    package("lock-archive", NOT_WHEEL, '[packages.archive]\npath="x.zip"\nhashes={sha256="00"}'),
    package("lock-without-wheels", INVALID, ""),
    text(
        "lock-with-an-index",
        PATH,
        lambda good: good.replace(
            'version = "1.0"\n[[', 'version = "1.0"\nindex = "https://example.org/simple"\n[[', 1
        ),
    ),
    text(
        "lock-with-an-address",
        PATH,
        lambda good: good.replace('path = "', 'url = "https://example.org/', 1),
    ),
    path("lock-climbs", "../other/wheels/"),
    path("lock-absolute", "/usr/lib/"),
    replace(path("lock-backslash", "wheels\\\\"), also=frozenset({INVALID})),
    edited("lock-other-wheel", INVALID, LOCK, 'name = "test-ID"', 'name = "pip"'),
    edited("lock-other-version", INVALID, LOCK, 'version = "1.0"\n[[', 'version = "2.0"\n[['),
    wheel_line("lock-without-hash", HASHES, lambda m: f'sha256 = "{digest_of(m)}"', 'md5 = "0123"'),
    wheel_line("lock-short-hash", HASHES, digest_of, "00"),
    wheel_line("lock-other-hash", PATH, digest_of, "0" * 64),
    wheel_line("lock-without-size", HASHES, lambda m: f"size = {len(m.files[wheel_of(m)])}\n", ""),
    wheel_line(
        "lock-other-size", PATH, lambda m: f"size = {len(m.files[wheel_of(m)])}", "size = 1"
    ),
    spoilt("lock-lacks-a-dependency", "LOCK_INCOMPLETE", needing("requests>=2")),
    spoilt("wheel-for-riscv", "WHEEL_INCOMPATIBLE", tagged("cp311-cp311-linux_riscv64")),
    spoilt("wheel-for-windows", "WHEEL_INCOMPATIBLE", tagged("cp311-cp311-win_amd64")),
    spoilt("wheel-for-python-2", "WHEEL_INCOMPATIBLE", tagged("py2-none-any")),
    whole("lock-bomb-of-keys", "METADATA_LIMIT", "a" + ".a" * 120_000 + " = 1"),
    whole("lock-bomb-of-headers", "METADATA_LIMIT", "[a" + ".a" * 120_000 + "]"),
    whole("lock-bomb-of-brackets", TOML, "a = " + "[" * 500_000),
    whole("lock-bomb-of-digits", INVALID, "a = " + "9" * 500_000),
    whole("lock-a-byte-too-long", "TOO_LARGE", "#" * (2**20 + 1)),
)
