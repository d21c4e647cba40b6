"""Paths in contents lists that lead elsewhere, or are two on one robot and one on another."""

from __future__ import annotations

from tests.faults.hostile.case import HostileDrive, spoilt
from tests.faults.hostile.envelope import ENCODING, ENTRY, HASH, added

UNSAFE = "PATH_UNSAFE"

PATHS: dict[str, str] = {
    "climbs": "../zz",
    "climbs-far": "../../../../../etc/cron.d/zz",
    "climbs-inside": "wheels/../payload.toml",
    "absolute": "/etc/ld.so.preload",
    "dot": "./zz",
    "two-slashes": "zz//a",
    "trailing-slash": "zz/",
    "backslashes": "..\\..\\zz",
    "drive-letter": "C:zz",
    "stream-of-ntfs": "zz:hidden",
    "wildcard": "wheels/*",
    "variable": "$HOME/zz",
    "backtick": "`id`",
    "quote": "zz'",
    "percent": "%2e%2e/zz",
    "too-long": "z" * 256,
    "too-deep": "/".join("z" * 200),
    "only-dots": "..",
}


DRIVES: tuple[HostileDrive, ...] = (
    *(added(f"path-{name}", UNSAFE, f"{HASH}  1  {path}") for name, path in PATHS.items()),
    added("path-with-blanks", ENTRY, f"{HASH}  1  zz zz"),
    added("path-empty", ENTRY, f"{HASH}  1  "),
    added("path-with-a-letter-of-another-alphabet", ENCODING, f"{HASH}  1  zzе"),
    added("path-that-turns-the-line", ENCODING, f"{HASH}  1  zz\u202egpj"),
    added("path-not-utf-8", ENCODING, f"{HASH}  1  zz\udcff"),
    added("path-with-escape", UNSAFE, f"{HASH}  1  zz\x1b[2J"),
    spoilt("same-but-for-case", UNSAFE, lambda made: made.with_file("Payload.toml", b"x")),
    spoilt(
        "same-wheel-but-for-case",
        UNSAFE,
        lambda made: made.with_file("wheels/A.whl", b"a").with_file("wheels/a.whl", b"b"),
    ),
    added("path-through-a-file", UNSAFE, f"{HASH}  1  payload.toml/inner"),
)
