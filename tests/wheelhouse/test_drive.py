"""Drives lie, hide and vanish: only listed bytes of regular files reach staging."""

from __future__ import annotations

import hashlib
import os
import stat
import subprocess
from pathlib import Path

import pytest
from tests.wheelhouse.file_systems import file_system, needs_mount

from nondum.sdk.errors import DriveGone, InstallFailed, PayloadRefused
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.payload import drive

FILES = {"payload.toml": b"x = 1\n", "wheels/a.whl": b"w" * 3_000_000, "wheels/deep/b.whl": b""}


def entry(path: str, data: bytes) -> Entry:
    return Entry(hashlib.sha256(data).hexdigest(), len(data), path)


def listing(*entries: Entry) -> Contents:
    return Contents("org.example.test", "1.0", 1, "", "0.1", "2026-01-01T00:00:00Z", entries)


LISTED = listing(*(entry(path, data) for path, data in sorted(FILES.items())))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "drive/nondum/org.example.test"
    for path, data in FILES.items():
        (made / path).parent.mkdir(parents=True, exist_ok=True)
        (made / path).write_bytes(data)
    (made / contents.NAME).write_bytes(LISTED.to_bytes())
    return made


def refused(folder: Path, staging: Path, listed: Contents = LISTED) -> list[tuple[str, str]]:
    with pytest.raises(PayloadRefused) as found:
        drive.copy(folder, listed, staging)
    return [(p.code, p.where.partition("/")[2]) for p in found.value.problems]


def test_listed_files_are_copied(folder: Path, tmp_path: Path) -> None:
    (folder / "unlisted").write_text("never read")
    told: list[tuple[str, int, int]] = []
    copied = drive.copy(folder, LISTED, tmp_path / "staging", lambda *step: told.append(step))
    staged = {
        p.relative_to(tmp_path / "staging").as_posix(): p.read_bytes()
        for p in (tmp_path / "staging").rglob("*")
        if p.is_file()
    }
    assert staged == FILES
    assert copied == LISTED.total_bytes
    assert told[-1] == ("copy", copied, copied)
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)


def test_only_wanted_files_are_copied(folder: Path, tmp_path: Path) -> None:
    drive.copy(folder, LISTED, tmp_path / "staging", wanted=lambda e: "/" not in e.path)
    assert [p.name for p in (tmp_path / "staging").iterdir()] == ["payload.toml"]


def test_a_missing_file_is_refused(folder: Path, tmp_path: Path) -> None:
    (folder / "payload.toml").unlink()
    assert refused(folder, tmp_path / "staging") == [("FILE_MISSING", "payload.toml")]


@pytest.mark.parametrize("at", [0, 1_500_000, 2_999_999])
def test_a_changed_byte_is_refused(folder: Path, tmp_path: Path, at: int) -> None:
    data = bytearray(FILES["wheels/a.whl"])
    data[at] ^= 1
    (folder / "wheels/a.whl").write_bytes(data)
    assert refused(folder, tmp_path / "staging") == [("HASH_MISMATCH", "wheels/a.whl")]


@pytest.mark.parametrize("data", [b"", b"x", b"x = 1\n..."], ids=["empty", "short", "long"])
def test_another_length_is_refused(folder: Path, tmp_path: Path, data: bytes) -> None:
    (folder / "payload.toml").write_bytes(data)
    assert refused(folder, tmp_path / "staging") == [("HASH_MISMATCH", "payload.toml")]


def test_a_list_that_lies_of_a_size_is_refused(folder: Path, tmp_path: Path) -> None:
    lie = Entry(LISTED.entries[0].sha256, LISTED.entries[0].size - 1, "payload.toml")
    assert refused(folder, tmp_path / "staging", listing(lie)) == [
        ("HASH_MISMATCH", "payload.toml")
    ]


def test_every_wrong_file_is_told(folder: Path, tmp_path: Path) -> None:
    (folder / "payload.toml").unlink()
    (folder / "wheels/a.whl").write_bytes(b"")
    assert refused(folder, tmp_path / "staging") == [
        ("FILE_MISSING", "payload.toml"),
        ("HASH_MISMATCH", "wheels/a.whl"),
    ]


def test_an_endless_file_is_read_no_further_than_listed(folder: Path, tmp_path: Path) -> None:
    with (folder / "payload.toml").open("r+b") as sparse:
        sparse.truncate(2**40)
    assert refused(folder, tmp_path / "staging") == [("HASH_MISMATCH", "payload.toml")]
    assert (tmp_path / "staging/payload.toml").stat().st_size <= len(FILES["payload.toml"]) + 1


def secret(tmp_path: Path) -> Path:
    path = tmp_path / "secret"
    path.write_bytes(FILES["payload.toml"])
    return path


def as_symlink(path: Path, tmp_path: Path) -> None:
    path.unlink()
    path.symlink_to(secret(tmp_path))


def as_fifo(path: Path, tmp_path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def as_folder(path: Path, tmp_path: Path) -> None:
    path.unlink()
    path.mkdir()


def as_device(path: Path, tmp_path: Path) -> None:
    path.unlink()
    os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 5))


@pytest.mark.parametrize(
    "become",
    [
        as_symlink,
        as_fifo,
        as_folder,
        pytest.param(
            as_device, marks=pytest.mark.skipif(os.geteuid() != 0, reason="mknod needs root")
        ),
    ],
)
def test_only_regular_files_are_opened(folder: Path, tmp_path: Path, become: object) -> None:
    assert callable(become)
    become(folder / "payload.toml", tmp_path)
    assert refused(folder, tmp_path / "staging") == [("PATH_UNSAFE", "payload.toml")]


def test_no_folder_is_entered_through_a_link(folder: Path, tmp_path: Path) -> None:
    (folder / "wheels").rename(tmp_path / "elsewhere")
    (folder / "wheels").symlink_to(tmp_path / "elsewhere")
    assert refused(folder, tmp_path / "staging") == [
        ("PATH_UNSAFE", "wheels/a.whl"),
        ("PATH_UNSAFE", "wheels/deep/b.whl"),
    ]


def test_a_file_where_a_folder_is_listed_is_refused(folder: Path, tmp_path: Path) -> None:
    listed = listing(entry("payload.toml/inner", b""))
    assert refused(folder, tmp_path / "staging", listed) == [("PATH_UNSAFE", "payload.toml/inner")]


def test_payload_folders_are_found_by_name(tmp_path: Path) -> None:
    for name in ("org.example.b", "org.example.a", "nodots", "Org.example.c", ".hidden"):
        (tmp_path / "nondum" / name).mkdir(parents=True)
    (tmp_path / "nondum/org.example.file").touch()
    (tmp_path / "nondum/org.example.link").symlink_to(tmp_path / "nondum/org.example.a")
    found = drive.find_payloads(tmp_path)
    assert [path.name for path in found] == ["org.example.a", "org.example.b"]


@pytest.mark.parametrize("make", ["nothing", "file"])
def test_other_drives_are_left_alone(tmp_path: Path, make: str) -> None:
    if make == "file":
        (tmp_path / "nondum").touch()
    assert drive.find_payloads(tmp_path) == ()


def test_litter_is_passed_over(tmp_path: Path) -> None:
    """What macOS and Windows leave on sticks, beside payloads and among them."""
    payload = tmp_path / "nondum/org.example.a"
    payload.mkdir(parents=True)
    for name in (".DS_Store", "._org.example.b", "desktop.ini", "Thumbs.db", ".Trashes/1"):
        for folder in (tmp_path, tmp_path / "nondum"):
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).touch()
    (tmp_path / "nondum/System Volume Information").mkdir()
    assert drive.find_payloads(tmp_path) == (payload,)


@pytest.mark.parametrize(
    ("name", "count"),
    [("org.example.p{}", drive.MAX_PAYLOADS), ("litter-{}", drive.MAX_ENTRIES)],
    ids=["payloads", "entries"],
)
def test_more_than_a_person_puts_there_is_refused(tmp_path: Path, name: str, count: int) -> None:
    for number in range(count):
        (tmp_path / "nondum" / name.format(number)).mkdir(parents=True)
    drive.find_payloads(tmp_path)
    (tmp_path / "nondum" / name.format(count)).mkdir()
    with pytest.raises(PayloadRefused) as found:
        drive.find_payloads(tmp_path)
    assert found.value.code == "TOO_MANY_FILES"


def test_progress_is_told_while_a_long_file_is_copied(folder: Path, tmp_path: Path) -> None:
    """Silence would be taken for a drive that hangs."""
    told: list[int] = []
    drive.copy(folder, LISTED, tmp_path / "staging", lambda phase, done, total: told.append(done))
    assert len(told) >= 3
    assert told == sorted(told)
    assert told[-1] == LISTED.total_bytes


def test_payloads_are_not_found_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "real/org.example.a").mkdir(parents=True)
    (tmp_path / "drive").mkdir()
    (tmp_path / "drive/nondum").symlink_to(tmp_path / "real")
    assert drive.find_payloads(tmp_path / "drive") == ()


def test_a_pulled_drive_is_told(tmp_path: Path) -> None:
    for act in (
        lambda: drive.find_payloads(tmp_path / "gone"),
        lambda: drive.read_contents(tmp_path / "gone/nondum/org.example.a"),
        lambda: drive.copy(tmp_path / "gone", LISTED, tmp_path / "staging"),
    ):
        with pytest.raises(DriveGone) as gone:
            act()
        assert gone.value.code == "DRIVE_GONE"


@pytest.mark.skipif(os.geteuid() != 0, reason="becoming somebody else needs root")
def test_what_cannot_be_read_is_the_drive_s_fault(folder: Path) -> None:
    folder.chmod(0o700)
    os.seteuid(65534)
    try:
        with pytest.raises(PayloadRefused) as closed:
            drive.read_contents(folder)
    finally:
        os.seteuid(0)
    assert closed.value.code == "FS_ERROR"
    assert "another computer" in closed.value.problems[0].fix


def test_contents_are_read_as_they_are(folder: Path) -> None:
    assert drive.read_contents(folder) == LISTED.to_bytes()
    assert drive.read_signature(folder) is None
    (folder / contents.SIGNATURE_NAME).write_bytes(b"signed")
    assert drive.read_signature(folder) == b"signed"


def test_missing_contents_are_refused(folder: Path) -> None:
    (folder / contents.NAME).unlink()
    with pytest.raises(PayloadRefused) as found:
        drive.read_contents(folder)
    assert found.value.code == "CONTENTS_MISSING"


@pytest.mark.parametrize("name", [contents.NAME, contents.SIGNATURE_NAME])
def test_long_lists_and_signatures_are_refused(folder: Path, name: str) -> None:
    with (folder / name).open("wb") as sparse:
        sparse.truncate(2**30)
    with pytest.raises(PayloadRefused) as found:
        drive.read_contents(folder) if name == contents.NAME else drive.read_signature(folder)
    assert found.value.code == "TOO_LARGE"


def test_name_that_no_file_can_have_is_no_file(folder: Path) -> None:
    """As that of the signature beside the longest name that there is."""
    assert drive.read_small(folder, "n" * 300, 100) is None


def test_linked_contents_are_refused(folder: Path, tmp_path: Path) -> None:
    as_symlink(folder / contents.NAME, tmp_path)
    with pytest.raises(PayloadRefused) as found:
        drive.read_contents(folder)
    assert found.value.code == "PATH_UNSAFE"


@needs_mount
def test_a_full_disk_is_told_apart_from_a_bad_drive(folder: Path, tmp_path: Path) -> None:
    with file_system(tmp_path / "small", 2) as small, pytest.raises(InstallFailed) as failed:
        drive.copy(folder, LISTED, small / "staging")
    assert failed.value.code == "DISK_FULL"
    assert not isinstance(failed.value, DriveGone)


@needs_mount
def test_a_disk_that_fills_in_the_last_piece_is_told(folder: Path, tmp_path: Path) -> None:
    (folder / "wheels/a.whl").write_bytes(b"w" * 1_040_000)
    listed = listing(entry("wheels/a.whl", b"w" * 1_040_000))
    with file_system(tmp_path / "small", 1) as small, pytest.raises(InstallFailed) as failed:
        drive.copy(folder, listed, small / "staging")
    assert failed.value.code == "DISK_FULL"


@needs_mount
def test_a_drive_pulled_while_it_is_read_is_told(folder: Path, tmp_path: Path) -> None:
    with file_system(tmp_path / "stick", 16) as stick:
        payload = stick / "nondum/org.example.test"
        payload.parent.mkdir()
        subprocess.run(["cp", "-r", folder, payload], check=True)
        subprocess.run(["sync", "-f", stick], check=True)
        os.truncate(tmp_path / "stick.img", 1024**2)  # what is left of a pulled stick: errors
        Path("/proc/sys/vm/drop_caches").write_text("3", encoding="ascii")
        with pytest.raises(DriveGone) as gone:
            drive.copy(payload, LISTED, tmp_path / "staging")
        assert gone.value.code == "DRIVE_GONE"
