"""Reading a drive: nothing is believed, and no byte is read twice.

Only listed regular files are opened, step by step through directory descriptors, never through a
link; each is hashed while it is copied, and from then on only the copy is read. A drive may vanish
or lie at any byte.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from nondum.sdk.errors import DriveGone, InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse.format import contents, names
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.signatures import MAX_SIGNATURE_BYTES

Progress = Callable[[str, int, int], None]
"""Phase, bytes done, bytes in all."""

FOLDER = "nondum"
MAX_PAYLOADS = 64
MAX_ENTRIES = 4096
"""What is looked at in a drive's folder of payloads, whatever it is."""

_CHUNK = 1024 * 1024
_WRITTEN_OUT = 64 * 1024 * 1024
"""Of a large file, each time this much was copied, it is written to the disk: several gigabytes
would fill the memory of a small host, and take minutes at the end."""
_OPEN_ROOT = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
"""A slot may be a link to what stands for the drive; what is on a drive may not."""
_OPEN_FOLDER = _OPEN_ROOT | os.O_NOFOLLOW
_OPEN_FILE = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_GONE = frozenset({errno.EIO, errno.ENODEV, errno.ENXIO, errno.ENOMEDIUM, errno.ESTALE})
_DAMAGED = frozenset({errno.EUCLEAN, errno.EBADMSG, errno.ENODATA, errno.EINVAL, errno.EOVERFLOW})
"""What file systems say of structures that cannot be, and of checksums that do not fit."""
_CLOSED = frozenset({errno.EACCES, errno.EPERM, errno.ENOKEY, errno.EOPNOTSUPP})
"""Encrypted, sealed, or somebody else's."""
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
_COPY_AGAIN = "copy the payload to the drive again"


def find_payloads(root: Path) -> tuple[Path, ...]:
    """The payload folders on a drive, by name; empty when it carries none.

    What else people and their machines leave on drives is passed over. Raises `DriveGone` when the
    drive cannot be read, `PayloadRefused` (TOO_MANY_FILES) when there is more than a person puts
    there.
    """
    with _folder(root, _OPEN_ROOT) as drive:
        try:
            with _inner(drive, FOLDER) as folder, os.scandir(folder) as entries:
                found = sorted(_named(entries, root / FOLDER))
        except (FileNotFoundError, _Unsafe):
            return ()
        except OSError as error:
            raise _gone(root, error) from error
    if len(found) > MAX_PAYLOADS:
        raise PayloadRefused(_crowded(root / FOLDER, f"{MAX_PAYLOADS} payloads"))
    return tuple(root / FOLDER / name for name in found)


def _named(entries: Iterable[os.DirEntry[str]], where: Path) -> Iterator[str]:
    """Names of what are folders, and are called as payloads are."""
    for number, entry in enumerate(entries):
        if number == MAX_ENTRIES:
            raise PayloadRefused(_crowded(where, f"{MAX_ENTRIES} entries"))
        if names.PAYLOAD_ID.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
            yield entry.name


def _crowded(where: Path, most: str) -> Problem:
    text = f"holds more than {most}"
    fix = "put fewer payloads on one drive"
    return Problem("TOO_MANY_FILES", text, where=str(where), fix=fix)


def read_contents(folder: Path) -> bytes:
    """The contents list's bytes, at most one more than allowed. Raises as `read_signature`."""
    data = read_small(folder, contents.NAME, contents.MAX_BYTES)
    if data is None:
        raise PayloadRefused(
            Problem(
                "CONTENTS_MISSING",
                f"there is no file {contents.NAME}",
                where=str(folder),
                fix="build the payload with `nondum payload build`",
            )
        )
    return data


def read_signature(folder: Path) -> bytes | None:
    """The signature file's bytes, or None when there is none.

    Raises `PayloadRefused` (PATH_UNSAFE, TOO_LARGE), `DriveGone`.
    """
    return read_small(folder, contents.SIGNATURE_NAME, MAX_SIGNATURE_BYTES)


def copy(
    folder: Path,
    listed: Contents,
    staging: Path,
    progress: Progress | None = None,
    wanted: Callable[[Entry], bool] = lambda entry: True,
) -> int:
    """Copy the wanted listed files to `staging`, hashing on the way; returns bytes copied.

    `staging` is made if it is not there, and holds afterwards what the list says, or an error is
    raised: `PayloadRefused` (FILE_MISSING, HASH_MISMATCH, PATH_UNSAFE) with every file that is
    wrong, `DriveGone`, `InstallFailed` (DISK_FULL, IO_ERROR).
    """
    staging.mkdir(parents=True, exist_ok=True)
    return _read(folder, listed, staging, progress, wanted)


def check(
    folder: Path,
    listed: Contents,
    progress: Progress | None = None,
    wanted: Callable[[Entry], bool] = lambda entry: True,
) -> int:
    """Hash the wanted listed files and keep nothing of them; returns bytes read. Raises as `copy`,
    but for `InstallFailed`."""
    return _read(folder, listed, None, progress, wanted)


def _read(
    folder: Path,
    listed: Contents,
    staging: Path | None,
    progress: Progress | None,
    wanted: Callable[[Entry], bool],
) -> int:
    entries = [entry for entry in listed.entries if wanted(entry)]
    total = sum(entry.size for entry in entries)
    problems: list[Problem] = []
    done = 0

    def copied(size: int) -> None:
        nonlocal done
        done += size
        if progress is not None:
            progress("copy", done, total)

    with _folder(folder) as source:
        for entry in entries:
            target = staging / entry.path if staging is not None else None
            problem = _copy(source, folder, entry, target, copied)
            if problem is not None:
                problems.append(problem)
    if problems:
        raise PayloadRefused(*problems)
    return total


def _copy(
    source: int, folder: Path, entry: Entry, target: Path | None, copied: Callable[[int], None]
) -> Problem | None:
    where = f"{folder.name}/{entry.path}"
    try:
        descriptor = _open(source, entry.path)
    except FileNotFoundError:
        return Problem("FILE_MISSING", "is listed but not there", where=where, fix=_COPY_AGAIN)
    except _Unsafe as unsafe:
        return Problem("PATH_UNSAFE", str(unsafe), where=where, fix=_COPY_AGAIN)
    except OSError as error:
        raise _gone(folder, error) from error
    try:
        digest, size = _copy_bytes(descriptor, entry, target, folder, copied)
    finally:
        os.close(descriptor)
    if size != entry.size or digest != entry.sha256:
        return Problem(
            "HASH_MISMATCH",
            "its bytes are not those that were listed",
            where=where,
            need=f"{entry.size} bytes, {entry.sha256[:16]}…",
            have=f"{'more' if size > entry.size else size} bytes, {digest[:16]}…",
            fix=_COPY_AGAIN,
        )
    return None


def _copy_bytes(
    descriptor: int, entry: Entry, target: Path | None, folder: Path, copied: Callable[[int], None]
) -> tuple[str, int]:
    """Digest and size of what was read; at most one byte more than listed. Without a target, none
    of it is written."""
    digest, size = hashlib.sha256(), 0
    with _opened(target) as out:
        for piece in _pieces(descriptor, entry.size + 1, folder):
            digest.update(piece)
            if out is not None:
                out.write(piece)
                if size // _WRITTEN_OUT < (size + len(piece)) // _WRITTEN_OUT:
                    out.flush()
                    os.fdatasync(out.fileno())
            size += len(piece)
            copied(len(piece))
    return digest.hexdigest(), size


@contextmanager
def _opened(target: Path | None) -> Iterator[BinaryIO | None]:
    """A file that is made, with its folders; None for none. Raises `InstallFailed`."""
    if target is None:
        yield None
        return
    _make_folder(target.parent)
    try:
        # Buffered: a raw file on a full disk writes less than it was given, and does not raise.
        with target.open("xb") as out:
            yield out
    except OSError as error:
        raise _unstaged(target, error) from error


def _pieces(descriptor: int, limit: int, folder: Path) -> Iterator[bytes]:
    while limit:
        try:
            piece = os.read(descriptor, min(_CHUNK, limit))
        except OSError as error:
            raise _gone(folder, error) from error
        if not piece:
            return
        limit -= len(piece)
        yield piece


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unstaged(folder, error) from error


def _unstaged(path: Path, error: OSError) -> InstallFailed:
    code = "DISK_FULL" if error.errno in _FULL else "IO_ERROR"
    fix = "free some disk" if code == "DISK_FULL" else "see what is wrong with this host's disk"
    text = f"cannot be staged: {error.strerror}"
    return InstallFailed(Problem(code, text, where=str(path), fix=fix))


class _Unsafe(Exception):
    """A listed path is not a plain file in plain folders."""


@contextmanager
def _folder(folder: Path, flags: int = _OPEN_FOLDER) -> Iterator[int]:
    try:
        descriptor = os.open(folder, flags)
    except OSError as error:
        raise _gone(folder, error) from error
    try:
        yield descriptor
    finally:
        os.close(descriptor)


@contextmanager
def _inner(folder: int, name: str) -> Iterator[int]:
    """A folder in an open folder. Raises `_Unsafe`, `OSError`."""
    descriptor = _step(name, _OPEN_FOLDER, folder)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _open(folder: int, path: str) -> int:
    """Open a regular file below an open folder, following no link on the way."""
    *parents, leaf = PurePosixPath(path).parts
    current = os.dup(folder)
    try:
        for parent in parents:
            inner = _step(parent, _OPEN_FOLDER, current)
            os.close(current)
            current = inner
        descriptor = _step(leaf, _OPEN_FILE, current)
    finally:
        os.close(current)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise _Unsafe("is no regular file")
    return descriptor


def _step(name: str, flags: int, folder: int) -> int:
    try:
        return os.open(name, flags, dir_fd=folder)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.EMLINK):
            raise _Unsafe("leads through a link") from error
        if error.errno in (errno.ENOTDIR, errno.ENXIO, errno.ENODEV):
            raise _Unsafe("is no regular file in regular folders") from error
        if error.errno == errno.ENAMETOOLONG:  # as of the signature beside a very long name
            raise FileNotFoundError(errno.ENOENT, "no file can be called so", name) from error
        raise


def read_small(folder: Path, name: str, limit: int) -> bytes | None:
    """A file's bytes, or None when it is not there. Raises as `read_signature`."""
    with _folder(folder) as source:
        try:
            descriptor = _open(source, name)
        except FileNotFoundError:
            return None
        except _Unsafe as unsafe:
            where = f"{folder.name}/{name}"
            problem = Problem("PATH_UNSAFE", str(unsafe), where=where, fix=_COPY_AGAIN)
            raise PayloadRefused(problem) from unsafe
        except OSError as error:
            raise _gone(folder, error) from error
    try:
        data = b"".join(_pieces(descriptor, limit + 1, folder))
    finally:
        os.close(descriptor)
    if len(data) > limit:
        where = f"{folder.name}/{name}"
        text = f"is longer than {limit} bytes"
        fix = "make it again, with less in it"
        raise PayloadRefused(Problem("TOO_LARGE", text, where=where, fix=fix))
    return data


def _gone(folder: Path, error: OSError) -> DriveGone | PayloadRefused:
    """What is told of a drive of which something cannot be read."""
    if error.errno in _DAMAGED | _CLOSED:
        what = "its file system is damaged" if error.errno in _DAMAGED else "it cannot be read"
        fix = "check the drive on another computer, or format it and copy the payload again"
        text = f"{what} ({error.strerror})"
        return PayloadRefused(Problem("FS_ERROR", text, where=str(folder), fix=fix))
    why = "was pulled" if error.errno in _GONE or not folder.exists() else "cannot be read"
    return DriveGone(
        Problem(
            "DRIVE_GONE",
            f"the drive {why} ({error.strerror})",
            where=str(folder),
            fix="plug it in again",
        )
    )
