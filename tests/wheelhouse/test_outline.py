"""What the records of a zip file say against one another, each told for itself."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

import pytest
from tests.kit.golden import Golden
from tests.wheelhouse.hostile_wheels import End, ZipBuilder

from nondum.wheelhouse.wheels import outline

PLAIN = ZipBuilder().add("evil/__init__.py", b"X = 1\n")
DATA = PLAIN.bytes()
DIRECTORY = DATA.index(b"PK\x01\x02")


def ended(**lies: int | bool) -> bytes:
    return ZipBuilder(PLAIN.members, end=End(**lies)).bytes()  # type: ignore[arg-type]  # as named


def flaws(data: bytes, change: Callable[[zipfile.ZipInfo], object] = repr) -> list[str]:
    """What is wrong with a file whose directory said, as it was read, what the plain one's does,
    but for a change."""
    (info,) = zipfile.ZipFile(io.BytesIO(DATA)).infolist()
    change(info)
    return list(outline.flaws(memoryview(data), [info], DIRECTORY))


def test_plain_records_agree() -> None:
    assert not list(outline.end_flaws(memoryview(DATA)))
    assert not flaws(DATA)


@pytest.mark.parametrize(
    ("data", "situation"),
    [
        pytest.param(b"", "it is empty", id="empty"),
        pytest.param(b"xxPK\x05\x06xxxxxx", "its end is short", id="short"),
        pytest.param(DATA + b"x", "bytes follow", id="bytes after it"),
        pytest.param(DATA[:-2] + b"\1\0", "it claims a comment", id="claimed comment"),
        pytest.param(
            ended(with_zip64=True, zip64_count=2, count=1), "its ends differ", id="two counts"
        ),
        pytest.param(ended(disk=1), "it is on another disk", id="another disk"),
        pytest.param(ended(disk_count=2), "its disk has more members", id="other count of disk"),
        pytest.param(
            ended(directory_size=outline.MAX_DIRECTORY + 1), "its directory is long", id="too long"
        ),
        pytest.param(ended(directory_offset=7), "its directory is elsewhere", id="another offset"),
    ],
)
def test_what_is_wrong_with_an_end_is_told(data: bytes, situation: str, golden: Golden) -> None:
    golden.check(situation, "\n".join(outline.end_flaws(memoryview(data))))


def test_directory_that_is_not_where_it_was_is_told(golden: Golden) -> None:
    for moved in (DATA[: DIRECTORY + 9], DATA.replace(b"PK\x01\x02", b"PK\x01\x03")):
        golden.check("its directory is elsewhere", "\n".join(flaws(moved)))


def test_directory_of_another_length_is_told(golden: Golden) -> None:
    two = ZipBuilder(PLAIN.members).add("b", b"x").bytes()
    infos = zipfile.ZipFile(io.BytesIO(two)).infolist()
    found = list(outline.flaws(memoryview(two), infos[:1], two.index(b"PK\x01\x02")))
    golden.check("its directory has a member more", "\n".join(found[:2]))


def test_ends_that_contradict_each_other_tell_no_number(golden: Golden) -> None:
    found = flaws(ended(with_zip64=True, zip64_count=2, count=1))
    golden.check("its ends tell two numbers", "\n".join(found))


def test_member_without_a_header_is_told(golden: Golden) -> None:
    def moved(info: zipfile.ZipInfo) -> None:
        info.header_offset = len(DATA) - 3

    no_header = flaws(DATA.replace(b"PK\x03\x04", b"PK\x03\x05"))[0]
    golden.check("a member has no header", no_header)
    assert no_header in flaws(DATA, moved)


def test_member_that_would_end_outside_is_told(golden: Golden) -> None:
    def grown(info: zipfile.ZipInfo) -> None:
        info.compress_size = len(DATA)

    golden.check_line("a member ends outside", "\n".join(flaws(DATA, grown)))
