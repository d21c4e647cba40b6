"""Hostile wheels are refused, each for the right reason; ordinary ones pass."""

from __future__ import annotations

import stat
import sys
import time
import zlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.payloads import installed_wheel, make_wheel, sdk_wheel
from tests.wheelhouse.hostile_wheels import (
    INFO,
    NAME,
    WHEEL,
    Lie,
    WheelBuilder,
    ZipBuilder,
    ZipMember,
    digest,
    record_of,
)

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse import archive, wheel

INIT = "evil/__init__.py"
SOURCE = b"X = 1\n"
RECORD = f"{INFO}/RECORD"


def raw(name: str, data: bytes = b"x", **lie: object) -> ZipMember:
    return ZipMember(name, data, Lie(**lie))  # type: ignore[arg-type]  # each test names its lie


def with_file(path: str, data: bytes = b"x") -> WheelBuilder:
    return WheelBuilder(files={INIT: SOURCE, path: data})


HOSTILE = {
    "prefix": ("WHEEL_STRUCTURE", WheelBuilder(prefix=b"#!/bin/sh\n")),
    "suffix": ("WHEEL_STRUCTURE", WheelBuilder(suffix=b"trailing")),
    "second-archive": (
        "WHEEL_STRUCTURE",
        WheelBuilder(suffix=ZipBuilder().add("b", b"x").bytes()),
    ),
    "name-twice": ("WHEEL_STRUCTURE", WheelBuilder(extra=(raw(INIT, b"Y = 2\n"),))),
    "other-local-name": ("WHEEL_STRUCTURE", WheelBuilder(lies={INIT: Lie(local_name="evil/b.py")})),
    "other-local-size": ("WHEEL_STRUCTURE", WheelBuilder(lies={INIT: Lie(local_size=1)})),
    "unlisted-member": (
        "WHEEL_STRUCTURE",
        WheelBuilder(extra=(raw("hidden.py", is_unlisted=True),)),
    ),
    "encrypted": ("WHEEL_STRUCTURE", WheelBuilder(lies={INIT: Lie(flags=1)})),
    "bzip2": ("WHEEL_STRUCTURE", WheelBuilder(lies={INIT: Lie(method=12)})),
    "no-dist-info": ("WHEEL_STRUCTURE", WheelBuilder(without=(f"{INFO}/WHEEL",))),
    "foreign-dist-info": ("WHEEL_STRUCTURE", WheelBuilder(info="other-1.0.dist-info")),
    "other-version-inside": ("WHEEL_STRUCTURE", WheelBuilder(info="evil-2.0.dist-info")),
    "two-dist-infos": ("WHEEL_STRUCTURE", with_file("other-1.0.dist-info/WHEEL", WHEEL)),
    "zeros-by-the-megabyte": ("WHEEL_BOMB", with_file("evil/zeros.bin", bytes(3 * 1024**2))),
    "declared-too-big": ("WHEEL_BOMB", WheelBuilder(lies={INIT: Lie(size=3 * 1024**3)})),
    "parent-folder": ("WHEEL_PATH", with_file("../evil.py")),
    "parent-folder-deep": ("WHEEL_PATH", with_file("evil/../../x.py")),
    "absolute": ("WHEEL_PATH", with_file("/etc/cron.d/evil")),
    "backslash": ("WHEEL_PATH", with_file("evil\\b.py")),
    "drive-letter": ("WHEEL_PATH", with_file("C:evil.py")),
    "control-character": ("WHEEL_PATH", with_file("evil/a\nb.py")),
    "doubled-slash": ("WHEEL_PATH", with_file("evil//b.py")),
    "dot-part": ("WHEEL_PATH", with_file("evil/./b.py")),
    "long-part": ("WHEEL_PATH", with_file(f"evil/{'a' * 300}.py")),
    "case-pair": ("WHEEL_PATH", with_file("EVIL/__init__.py")),
    "symlink": (
        "WHEEL_PATH",
        WheelBuilder(extra=(raw("evil/link", b"/etc/passwd", mode=stat.S_IFLNK | 0o777),)),
    ),
    "fifo": ("WHEEL_PATH", WheelBuilder(extra=(raw("evil/pipe", b"", mode=stat.S_IFIFO | 0o666),))),
    "library-scheme-escapes": ("WHEEL_PATH", with_file("evil-1.0.data/purelib/../x.py")),
    "file-and-folder": ("WHEEL_PATH", with_file(f"{INIT}/b.py")),
    "one-place-of-two-schemes": ("WHEEL_PATH", with_file(f"evil-1.0.data/purelib/{INIT}")),
    "no-record": ("WHEEL_RECORD", WheelBuilder(without=(RECORD,))),
    "empty-record": ("WHEEL_RECORD", WheelBuilder(record=b"")),
    "record-not-csv": ("WHEEL_RECORD", WheelBuilder(record=b"a,b\n")),
    "record-not-text": ("WHEEL_RECORD", WheelBuilder(record=b"\xff\xfe")),
    "record-weak-digest": ("WHEEL_RECORD", WheelBuilder(record=f"{INIT},md5=abc,6\n".encode())),
    "record-lists-absent": (
        "WHEEL_RECORD",
        WheelBuilder(record=record_of({INIT: SOURCE, "evil/gone.py": b""}, RECORD)),
    ),
    "pth": ("WHEEL_STARTUP_HOOK", with_file("evil.pth", b"import os; os.system('id')\n")),
    "pth-in-purelib": ("WHEEL_STARTUP_HOOK", with_file("evil-1.0.data/purelib/evil.pth")),
    "sitecustomize": ("WHEEL_STARTUP_HOOK", with_file("sitecustomize.py")),
    "usercustomize-package": ("WHEEL_STARTUP_HOOK", with_file("usercustomize/__init__.py")),
    "sitecustomize-extension": (
        "WHEEL_STARTUP_HOOK",
        with_file("sitecustomize.cpython-311-x86_64-linux-gnu.so"),
    ),
    "shadows-stdlib-module": ("WHEEL_SHADOWS", with_file("json.py")),
    "shadows-stdlib-package": ("WHEEL_SHADOWS", with_file("asyncio/__init__.py")),
    "shadows-in-platlib": ("WHEEL_SHADOWS", with_file("evil-1.0.data/platlib/ssl.py")),
    "takes-nondum": ("WHEEL_SHADOWS", with_file("nondum/__init__.py")),
    "takes-the-sdk": ("WHEEL_SHADOWS", with_file("nondum/sdk/wire.py")),
    "replaces-python": ("WHEEL_DATA_SCHEME", with_file("evil-1.0.data/data/bin/python3")),
    "replaces-pip": ("WHEEL_DATA_SCHEME", with_file("evil-1.0.data/scripts/pip")),
    "replaces-activate": ("WHEEL_DATA_SCHEME", with_file("evil-1.0.data/scripts/activate")),
}


@pytest.mark.parametrize(("code", "builder"), HOSTILE.values(), ids=HOSTILE)
def test_hostile_wheel_is_refused(tmp_path: Path, code: str, builder: WheelBuilder) -> None:
    problems = wheel.check(builder.write(tmp_path))
    assert {p.code for p in problems} == {code}
    assert all(p.where == NAME and p.message for p in problems)


def test_plain_wheel_passes(tmp_path: Path) -> None:
    assert wheel.check(WheelBuilder().write(tmp_path)) == ()


def test_vendored_metadata_is_no_second_dist_info(tmp_path: Path) -> None:
    builder = with_file("evil/_vendor/other-1.0.dist-info/WHEEL", WHEEL)
    assert wheel.check(builder.write(tmp_path)) == ()


@pytest.mark.parametrize("name", ["pluggy", "msgpack", "packaging", "rich", "click"])
def test_real_wheel_passes(name: str) -> None:
    assert wheel.check(installed_wheel(name)) == ()


def test_sdk_may_bring_its_own_namespace() -> None:
    assert wheel.check(sdk_wheel()) == ()


def test_sdk_may_bring_no_more_than_its_own(tmp_path: Path) -> None:
    path = make_wheel(tmp_path, "nondum-sdk", "0.1.0", {"nondum/host/__init__.py": ""})
    assert [p.code for p in wheel.check(path)] == ["WHEEL_SHADOWS"]


def test_wrong_digest_is_found_by_reading(tmp_path: Path) -> None:
    record = record_of({INIT: SOURCE, f"{INFO}/METADATA": b"", f"{INFO}/WHEEL": WHEEL}, RECORD)
    problems = wheel.check(WheelBuilder(record=record).write(tmp_path))
    assert [(p.code, p.message) for p in problems] == [
        ("WHEEL_RECORD", f"member '{INFO}/METADATA': it is not what RECORD says")
    ]


def test_wrong_checksum_is_found_by_reading(tmp_path: Path) -> None:
    builder = WheelBuilder(lies={INIT: Lie(crc=1)})
    assert [p.code for p in wheel.check(builder.write(tmp_path))] == ["WHEEL_RECORD"]


def test_understated_size_is_found_by_reading(tmp_path: Path) -> None:
    builder = WheelBuilder(lies={INIT: Lie(size=2)})
    assert [p.code for p in wheel.check(builder.write(tmp_path))] == ["WHEEL_RECORD"]


def test_overlapping_members_are_a_bomb() -> None:
    bomb = ZipBuilder(overlaid=True).add("a", bytes(5000)).add("a2", bytes(5000))
    named = bomb.bytes().replace(b"a2", b"a\0")
    for data in (bomb.bytes(), named):
        assert archive.read(memoryview(data), NAME).problems


def test_too_many_members_are_a_bomb(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "MAX_MEMBERS", 3)
    crowd = ZipBuilder()
    for number in range(4):
        crowd = crowd.add(f"m{number}", b"")
    found = archive.read(memoryview(crowd.bytes()), NAME)
    assert [p.code for p in found.problems] == ["WHEEL_BOMB"]


def test_many_members_are_judged_quickly() -> None:
    crowd = ZipBuilder(tuple(ZipMember(f"m{number}", b"") for number in range(60_000)))
    data = memoryview(crowd.bytes())
    begun = time.perf_counter()
    assert {p.code for p in archive.read(data, NAME).problems} == {"WHEEL_BOMB"}
    assert time.perf_counter() - begun < 10


@pytest.mark.parametrize(
    "data", [b"", b"PK", b"not a zip file at all" * 9], ids=["empty", "2", "?"]
)
def test_no_zip_file_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / NAME).write_bytes(data)
    assert [p.code for p in wheel.check(tmp_path / NAME)] == ["WHEEL_STRUCTURE"]


@pytest.mark.parametrize("name", ["evil.whl", "evil-1.0.zip", "evil-x-py3-none-any.whl"])
def test_no_wheel_name_is_refused(tmp_path: Path, name: str) -> None:
    problems = wheel.check(WheelBuilder().write(tmp_path, name))
    assert [p.code for p in problems] == ["WHEEL_STRUCTURE"]


def test_everything_wrong_is_told_at_once(tmp_path: Path) -> None:
    files = {INIT: SOURCE, "json.py": b"", "evil.pth": b"", "evil-1.0.data/scripts/pip": b""}
    problems = wheel.check(WheelBuilder(files=files).write(tmp_path))
    assert {p.code for p in problems} == {
        "WHEEL_SHADOWS",
        "WHEEL_STARTUP_HOOK",
        "WHEEL_DATA_SCHEME",
    }


def test_harmless_hooks_and_scripts_are_left_out(tmp_path: Path) -> None:
    builder = WheelBuilder(
        files={INIT: SOURCE, "a1_coverage.pth": b"import x", "evil-1.0.data/scripts/tool": b"#!"}
    )
    with wheel.opened(builder.write(tmp_path)) as data:
        layout = wheel.lay_out(data, NAME)
    assert not layout.problems
    assert set(layout.left_out) == {"a1_coverage.pth", "evil-1.0.data/scripts/tool"}


def test_libraries_of_both_schemes_are_laid_out_together(tmp_path: Path) -> None:
    builder = WheelBuilder(
        files={
            INIT: SOURCE,
            "evil-1.0.data/platlib/evil/a.so": b"",
            "evil-1.0.data/purelib/b.py": b"",
        }
    )
    with wheel.opened(builder.write(tmp_path)) as data:
        targets = {file.target for file in wheel.lay_out(data, NAME).files}
    assert targets >= {INIT, "evil/a.so", "b.py"}


def test_requirements_are_read_from_metadata(tmp_path: Path) -> None:
    path = make_wheel(tmp_path, "plain", "1", {"plain.py": ""}, requires=["a>=1", "b; extra=='c'"])
    with wheel.opened(path) as data:
        found = wheel.requirements(data, wheel.lay_out(data, path.name))
    assert found == ("a>=1", "b; extra=='c'")


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_damaged_bytes_never_break_the_reader(data: st.DataObject) -> None:
    whole = bytearray(WheelBuilder().bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    view = memoryview(bytes(whole[: data.draw(st.integers(0, len(whole)))]))
    layout = wheel.lay_out(view, NAME)
    for file in layout.files:
        try:
            pieces = b"".join(archive.unpack(view, file.member))
        except (ValueError, zlib.error):
            continue
        assert len(pieces) == file.member.size


def test_every_startup_module_is_covered() -> None:
    assert not wheel.STARTUP_MODULES & sys.stdlib_module_names
    assert digest(b"") == "47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU"


def test_refusal_carries_all_problems(tmp_path: Path) -> None:
    problems = wheel.check(with_file("json.py").write(tmp_path))
    with pytest.raises(PayloadRefused) as refused:
        wheel.refuse_if_any(problems)
    assert refused.value.problems == problems
    wheel.refuse_if_any(())
