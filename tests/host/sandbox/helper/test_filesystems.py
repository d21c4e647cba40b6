"""File systems are known by their magic numbers."""

from __future__ import annotations

import pytest

from nondum.host.sandbox.helper.filesystems import recognise


def head(*pieces: tuple[int, bytes]) -> bytes:
    data = bytearray(4096)
    for offset, piece in pieces:
        data[offset : offset + len(piece)] = piece
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (head((1080, b"\x53\xef")), "ext4"),
        (head((3, b"EXFAT   "), (510, b"\x55\xaa")), "exfat"),
        (head((54, b"FAT16"), (510, b"\x55\xaa")), "vfat"),
        (head((82, b"FAT32"), (510, b"\x55\xaa")), "vfat"),
        (head((510, b"\x55\xaa")), ""),
        (head((3, b"NTFS    "), (510, b"\x55\xaa")), ""),
        (b"", ""),
    ],
    ids=["ext4", "exfat", "fat16", "fat32", "partition-table", "ntfs", "nothing"],
)
def test_magic_number_names_the_file_system(data: bytes, name: str) -> None:
    assert recognise(data) == name
