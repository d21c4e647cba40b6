"""Hostile wheels are refused, each for the right reason; ordinary ones pass."""

from __future__ import annotations

import random
import shutil
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.golden import Golden
from tests.kit.payloads import installed_wheel, make_wheel, sdk_wheel
from tests.wheelhouse.hostile import WHEELS, HostileWheel
from tests.wheelhouse.hostile_wheels import (
    INFO,
    METADATA,
    NAME,
    WHEEL,
    End,
    Lie,
    WheelBuilder,
    ZipBuilder,
    ZipMember,
    digest,
    record_of,
)

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.wheels import archive, wheel

INIT = "evil/__init__.py"
SOURCE = b"X = 1\n"
RECORD = f"{INFO}/RECORD"


def with_file(path: str, data: bytes = b"x") -> WheelBuilder:
    return WheelBuilder(files={INIT: SOURCE, path: data})


@pytest.mark.parametrize("hostile", WHEELS, ids=lambda hostile: hostile.name)
def test_hostile_wheel_is_refused(tmp_path: Path, hostile: HostileWheel) -> None:
    path = tmp_path / hostile.filename
    path.write_bytes(hostile.build(tmp_path / "canary"))
    problems = wheel.check(path)
    assert {p.code for p in problems} == {hostile.code}
    assert all(p.where == hostile.filename and p.message for p in problems)
    assert not (tmp_path / "canary").exists()


WORDS = {
    "parent-folder": "leaves the wheel",
    "absolute": "leaves the wheel",
    "backslash": "has characters that paths may not have",
    "dot-part": "is not in its shortest form",
    "doubled-slash": "is not in its shortest form",
    "long-part": "has a part longer than 255 bytes",
    "dot-at-the-end": "has a name that some systems take for another",
    "too-big-together": "more than 8589934592",
}
"""What is told of some, whatever else would refuse them with the same code."""


@pytest.mark.parametrize(("name", "words"), WORDS.items(), ids=WORDS)
def test_hostile_wheel_is_told_in_the_right_words(tmp_path: Path, name: str, words: str) -> None:
    (hostile,) = (one for one in WHEELS if one.name == name)
    path = tmp_path / hostile.filename
    path.write_bytes(hostile.build(tmp_path / "canary"))
    assert any(problem.message.endswith(words) for problem in wheel.check(path))


def test_hostile_wheels_are_named_and_many() -> None:
    assert len(WHEELS) >= 60
    assert len({hostile.name for hostile in WHEELS}) == len(WHEELS)
    assert {hostile.code for hostile in WHEELS} == {
        "WHEEL_BOMB",
        "WHEEL_DATA_SCHEME",
        "WHEEL_MACHINE",
        "WHEEL_METADATA",
        "WHEEL_PATH",
        "WHEEL_RECORD",
        "WHEEL_SHADOWS",
        "WHEEL_STARTUP_HOOK",
        "WHEEL_STRUCTURE",
    }


@pytest.mark.parametrize("name", ["pluggy", "msgpack", "rich"])
def test_other_readers_see_the_same_in_real_wheels(name: str) -> None:
    path = installed_wheel(name)
    with wheel.opened(path) as data:
        ours = {m.path: m.size for m in archive.read(data, path.name).members}
    assert ours == by_zipfile(path) == by_unzip(path) == front_to_back(path)


LIES = st.builds(
    Lie,
    local_name=st.sampled_from([None, INIT, "evil/b.py"]),
    local_size=st.sampled_from([None, 0, 8, 0xFFFFFFFF]),
    local_crc=st.sampled_from([None, 0, 1]),
    local_flags=st.sampled_from([None, 0, 8, 0x800]),
    local_method=st.sampled_from([None, 0, 8]),
    local_extra=st.sampled_from([b"", bytes(4), struct.pack("<HHQQ", 1, 16, 6, 8), b"\1\0"]),
    size=st.sampled_from([None, 6, 7, 0xFFFFFFFF]),
    flags=st.sampled_from([0, 2, 8, 0x800]),
    method=st.sampled_from([None, 0, 8]),
    attributes=st.sampled_from([0, 0x10]),
    extra=st.sampled_from([b"", bytes(4), struct.pack("<HHQ", 1, 8, 6)]),
    after=st.sampled_from([b"", b"ab", struct.pack("<3L", zlib.crc32(SOURCE), 8, 6)]),
)
ENDS = st.builds(
    End,
    count=st.sampled_from([None, 3, 0xFFFF]),
    directory_offset=st.sampled_from([None, 0, 0xFFFFFFFF]),
    with_zip64=st.booleans(),
    zip64_count=st.sampled_from([None, 4]),
    between=st.sampled_from([b"", b"x"]),
)


@given(st.one_of(st.just(Lie()), LIES), st.one_of(st.just(End()), ENDS))
def test_other_readers_see_the_same_in_all_that_is_accepted(
    tmp_path_factory: pytest.TempPathFactory, lie: Lie, end: End
) -> None:
    folder = tmp_path_factory.mktemp("wheel")
    path = WheelBuilder(lies={INIT: lie}, end=end).write(folder)
    if wheel.check(path) == ():
        assert by_zipfile(path) == by_unzip(path) == front_to_back(path)
    shutil.rmtree(folder)


def by_zipfile(path: Path) -> dict[str, int]:
    with zipfile.ZipFile(path) as found:
        assert found.testzip() is None
        return {info.filename: info.file_size for info in found.infolist()}


def by_unzip(path: Path) -> dict[str, int]:
    listed = subprocess.run(["unzip", "-l", path], capture_output=True, text=True, check=True)
    rows = [line.split(maxsplit=3) for line in listed.stdout.splitlines()[3:-2]]
    return {row[3]: int(row[0]) for row in rows}


def front_to_back(path: Path) -> dict[str, int]:
    """What a reader sees that takes member after member and never looks at the directory."""
    data, at, seen = path.read_bytes(), 0, {}
    while data[at : at + 4] == b"PK\x03\x04":
        flags, method, _, _, _, packed, _, name, extra = struct.unpack_from(
            "<5H3L2H", data, at + 4
        )[1:]
        at += 30 + name + extra
        if packed == 0xFFFFFFFF:
            packed = struct.unpack_from("<Q", data, at - 8)[0]
        seen_name = data[at - name - extra : at - extra].decode()
        unpacked = data[at : at + packed]
        if method == 8:
            inflate = zlib.decompressobj(-zlib.MAX_WBITS)
            unpacked = inflate.decompress(data[at:])
            packed = len(data) - at - len(inflate.unused_data)
        at += packed
        if flags & 8:
            at += 16 if data[at : at + 4] == b"PK\x07\x08" else 12
        seen[seen_name] = len(unpacked)
    return seen


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


def test_wrong_digest_is_found_by_reading(tmp_path: Path, golden: Golden) -> None:
    wrong = METADATA.swapcase()
    record = record_of({INIT: SOURCE, f"{INFO}/METADATA": wrong, f"{INFO}/WHEEL": WHEEL}, RECORD)
    problems = wheel.check(WheelBuilder(record=record).write(tmp_path))
    (problem,) = problems
    assert problem.code == "WHEEL_RECORD"
    golden.check("a member is not what RECORD says", problem.message, member=f"{INFO}/METADATA")


def test_wrong_checksum_is_found_by_reading(tmp_path: Path) -> None:
    builder = WheelBuilder(lies={INIT: Lie(crc=1)})
    assert [p.code for p in wheel.check(builder.write(tmp_path))] == ["WHEEL_RECORD"]


def test_understated_size_is_found_by_reading(tmp_path: Path) -> None:
    builder = WheelBuilder(lies={INIT: Lie(size=2)})
    assert {p.code for p in wheel.check(builder.write(tmp_path))} == {"WHEEL_RECORD"}


@pytest.mark.parametrize("lie", [-1, 1])
def test_sizes_that_lie_are_found_by_unpacking(lie: int) -> None:
    """A forger makes the checksums fit."""
    data = memoryview(WheelBuilder().bytes())
    for member in archive.read(data, NAME).members:
        assert b"".join(archive.unpack(data, member))
        with pytest.raises(ValueError, match="size or checksum"):
            list(archive.unpack(data, replace(member, size=member.size + lie)))


def test_one_member_that_grows_too_much_is_a_bomb(golden: Golden) -> None:
    """However little it is of the whole."""
    noise = random.Random(1).randbytes(300_000)
    plain = ZipBuilder().add("noise", noise)
    assert not archive.read(memoryview(plain.bytes()), NAME).problems
    bomb = plain.add("zeros", bytes(17 * 1024**2))
    (problem,) = archive.read(memoryview(bomb.bytes()), NAME).problems
    golden.check("a member unpacks to much", problem.message)


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
    begun = time.process_time()
    assert {p.code for p in archive.read(data, NAME).problems} == {"WHEEL_BOMB"}
    assert time.process_time() - begun < 10


@pytest.mark.parametrize(
    "data",
    [b"", b"PK", b"xxPK\x05\x06xxxxxx", b"not a zip file at all" * 9],
    ids=["empty", "2", "12", "?"],
)
def test_no_zip_file_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / NAME).write_bytes(data)
    assert [p.code for p in wheel.check(tmp_path / NAME)] == ["WHEEL_STRUCTURE"]


@pytest.mark.parametrize("name", ["evil.whl", "evil-1.0.zip", "evil-x-py3-none-any.whl"])
def test_no_wheel_name_is_refused(tmp_path: Path, name: str) -> None:
    problems = wheel.check(WheelBuilder().write(tmp_path, name))
    assert [p.code for p in problems] == ["WHEEL_STRUCTURE"]


def test_file_in_the_place_of_a_scheme_is_refused(tmp_path: Path) -> None:
    path = with_file("evil-1.0.data/scripts").write(tmp_path)
    assert [p.code for p in wheel.check(path)] == ["WHEEL_DATA_SCHEME"]


def test_hooks_that_the_manifest_names_are_left_out(tmp_path: Path) -> None:
    path = with_file("evil.pth", b"import evil\n").write(tmp_path)
    assert [p.code for p in wheel.check(path, ["other.pth"])] == ["WHEEL_STARTUP_HOOK"]
    assert wheel.check(path, ["evil.pth"]) == ()


def test_refused_hook_says_how_it_is_allowed(tmp_path: Path) -> None:
    (problem,) = wheel.check(with_file("evil.pth", b"import evil\n").write(tmp_path))
    assert 'startup_hooks = ["evil.pth"] in payload.toml' in problem.fix


def test_repaired_wheel_may_name_an_older_libc(tmp_path: Path) -> None:
    told = WHEEL.replace(b"py3-none-any", b"cp311-cp311-linux_x86_64")
    path = WheelBuilder(wheel=told).write(tmp_path, "evil-1.0-cp311-cp311-manylinux1_x86_64.whl")
    assert wheel.check(path) == ()


def test_sizes_in_records_of_zip64_are_taken(tmp_path: Path) -> None:
    sizes = struct.pack("<HHQQ", 1, 16, len(SOURCE), len(ZipMember(INIT, SOURCE).packed))
    lies = {INIT: Lie(local_extra=sizes, local_size=0xFFFFFFFF)}
    assert wheel.check(WheelBuilder(lies=lies, end=End(with_zip64=True)).write(tmp_path)) == ()


def test_sizes_after_a_member_are_taken(tmp_path: Path) -> None:
    packed = len(ZipMember(INIT, SOURCE).packed)
    told = struct.pack("<3L", zlib.crc32(SOURCE), packed, len(SOURCE))
    for after in (b"PK\x07\x08" + told, told):
        lie = Lie(flags=8, local_crc=0, local_size=0, after=after)
        assert wheel.check(WheelBuilder(lies={INIT: lie}).write(tmp_path)) == ()


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
        found = wheel.lay_out(data, path.name).needs.requirements
    assert found == ("a>=1", "b; extra=='c'")


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
