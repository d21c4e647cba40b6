"""Members that would land elsewhere than they seem to, or be something other than files."""

from __future__ import annotations

import stat

from tests.wheelhouse.hostile.case import INIT, HostileWheel, built, planted, raw, with_file
from tests.wheelhouse.hostile_wheels import Lie, WheelBuilder

CODE = "WHEEL_PATH"


def _at(name: str, path: str) -> HostileWheel:
    return built(name, CODE, with_file(path))


def _kind(name: str, mode: int, data: bytes = b"", path: str = "evil/odd") -> HostileWheel:
    return built(name, CODE, WheelBuilder(extra=(raw(path, data, Lie(mode=mode)),)))


WHEELS: tuple[HostileWheel, ...] = (
    planted("parent-folder", CODE, "../evil.py"),
    planted("parent-folder-deep", CODE, "evil/../../x.py"),
    planted("absolute", CODE, "/etc/cron.d/evil"),
    planted("home", CODE, "evil/../../../../../root/.profile"),
    _at("parent-folder-by-backslash", "..\\..\\evil.py"),
    _at("backslash", "evil\\b.py"),
    _at("drive-letter", "C:evil.py"),
    _at("stream-of-another-file", "evil/b.py:hidden"),
    _at("line-feed", "evil/a\nb.py"),
    _at("escape-sequence", "evil/\x1b[2Jb.py"),
    _at("delete-character", "evil/a\x7fb.py"),
    _at("text-turned-round", "evil/\u202eyp.b"),
    _at("invisible-character", "evil/a\u200bb.py"),
    built(
        "zero-byte",
        CODE,
        WheelBuilder(extra=(raw("evil/b.py\0.txt"),), record=b"evil/__init__.py,,\n"),
    ),
    _at("doubled-slash", "evil//b.py"),
    _at("dot-part", "evil/./b.py"),
    _at("long-part", f"evil/{'a' * 300}.py"),
    _at("long-path", "/".join(["evil", *["a" * 200] * 6]) + ".py"),
    _at("device-name", "evil/con.py"),
    _at("device-name-folder", "evil/AUX/b.py"),
    _at("device-name-with-number", "evil/com1.py"),
    _at("dot-at-the-end", "evil/b.py."),
    _at("space-at-the-end", "evil/b.py "),
    _at("case-pair", "EVIL/__init__.py"),
    built(
        "one-letter-written-twice",
        CODE,
        WheelBuilder(files={"evil/\u00e9.py": b"x", "evil/e\u0301.py": b"x"}),
    ),
    _at("file-and-folder", f"{INIT}/b.py"),
    _at("library-scheme-escapes", "evil-1.0.data/purelib/../x.py"),
    _at("one-place-of-two-schemes", f"evil-1.0.data/purelib/{INIT}"),
    _kind("symlink", stat.S_IFLNK | 0o777, b"/etc/passwd"),
    _kind("symlink-to-folder", stat.S_IFLNK | 0o777, b"/", path="evil/root"),
    _kind("fifo", stat.S_IFIFO | 0o666),
    _kind("socket", stat.S_IFSOCK | 0o666),
    _kind("block-device", stat.S_IFBLK | 0o666),
    _kind("character-device", stat.S_IFCHR | 0o666),
    _kind("folder-that-is-a-file", stat.S_IFDIR | 0o755),
    built(
        "folder-with-bytes",
        CODE,
        WheelBuilder(extra=(raw("evil/sub/", b"x", Lie(mode=stat.S_IFDIR | 0o755)),)),
    ),
)
