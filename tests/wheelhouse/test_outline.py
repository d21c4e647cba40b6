"""What the records of a zip file say against one another, each told for itself."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

import pytest
from tests.wheelhouse.hostile_wheels import End, ZipBuilder

from nondum.wheelhouse.wheels import outline

PLAIN = ZipBuilder().add("evil/__init__.py", b"X = 1\n")
DATA = PLAIN.bytes()
DIRECTORY = DATA.index(b"PK\x01\x02")
ELSEWHERE = "has its directory elsewhere than its end says"
NO_HEADER = "'evil/__init__.py' has no local header where the directory says"


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
    ("data", "words"),
    [
        pytest.param(b"", "does not end as a zip file does", id="empty"),
        pytest.param(b"xxPK\x05\x06xxxxxx", "does not end as a zip file does", id="short"),
        pytest.param(DATA + b"x", "or bytes follow its end", id="bytes after it"),
        pytest.param(DATA[:-2] + b"\1\0", "has a comment", id="claimed comment"),
        pytest.param(
            ended(with_zip64=True, zip64_count=2, count=1), "two end records", id="two counts"
        ),
        pytest.param(ended(disk=1), "on another disk", id="another disk"),
        pytest.param(ended(disk_count=2), "with 2 and with 1 members", id="other count of disk"),
        pytest.param(
            ended(directory_size=outline.MAX_DIRECTORY + 1), "has a directory longer", id="too long"
        ),
        pytest.param(ended(directory_offset=7), ELSEWHERE, id="another offset"),
    ],
)
def test_what_is_wrong_with_an_end_is_told(data: bytes, words: str) -> None:
    assert any(words in flaw for flaw in outline.end_flaws(memoryview(data)))


def test_directory_that_is_not_where_it_was_is_told() -> None:
    assert flaws(DATA[: DIRECTORY + 9]) == [ELSEWHERE]
    assert flaws(DATA.replace(b"PK\x01\x02", b"PK\x01\x03")) == [ELSEWHERE]


def test_directory_of_another_length_is_told() -> None:
    two = ZipBuilder(PLAIN.members).add("b", b"x").bytes()
    infos = zipfile.ZipFile(io.BytesIO(two)).infolist()
    found = list(outline.flaws(memoryview(two), infos[:1], two.index(b"PK\x01\x02")))
    assert found[:2] == [
        "has 1 members, and its end tells of another number",
        "has bytes after its directory",
    ]


def test_ends_that_contradict_each_other_tell_no_number() -> None:
    found = flaws(ended(with_zip64=True, zip64_count=2, count=1))
    assert found == ["has 1 members, and its end tells of another number"]


def test_member_without_a_header_is_told() -> None:
    def moved(info: zipfile.ZipInfo) -> None:
        info.header_offset = len(DATA) - 3

    assert flaws(DATA.replace(b"PK\x03\x04", b"PK\x03\x05"))[0] == NO_HEADER
    assert NO_HEADER in flaws(DATA, moved)


def test_member_that_would_end_outside_is_told() -> None:
    def grown(info: zipfile.ZipInfo) -> None:
        info.compress_size = len(DATA)

    assert "'evil/__init__.py' lies outside the file" in flaws(DATA, grown)
