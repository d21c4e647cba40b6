"""The first trust file on a host's disk, from which its trust begins, and its signatures.

/etc/nondum/trust.toml        written by root: from an image, or by `nondum keys trust`
/etc/nondum/trust.toml.sig    what its roots have signed it with; `nondum keys trust` keeps it

It is verified at each start. One without signatures is believed because only root, or the user that
the host runs as, can have written it, and everything that shows trust says that.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
from enum import Enum
from pathlib import Path
from typing import BinaryIO

from nondum.sdk.errors import Problem, TrustRefused
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import disk
from nondum.wheelhouse.trust import sshsig, succession, trust_file
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Trust

SIGNATURE_SUFFIX = ".sig"
MOST_LINKS = 40
"""As many as the kernel follows (path_resolution(7))."""

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC


class Origin(Enum):
    """Who vouches for the first trust file; the values are what people and programs are told."""

    SIGNED = "signed by its roots"
    ROOT = "unsigned, placed by root"
    USER = "unsigned, placed by the user that this host runs as"


@frozen
class Anchor:
    """A first trust file that is believed."""

    file: SignedFile
    trust: Trust
    origin: Origin


def load(path: Path) -> Anchor:
    """Read a first trust file and verify its signatures, if there are any.

    Raises `TrustRefused` (TRUST_MISSING, TRUST_OPEN_TO_OTHERS, TRUST_SIGNATURE, TRUST_…, TOO_LARGE,
    IO_ERROR).
    """
    file, owner = _read_own(path)
    trust = succession.placed(file)
    if file.signature is not None:
        return Anchor(file, trust, Origin.SIGNED)
    return Anchor(file, trust, Origin.ROOT if owner == 0 else Origin.USER)


def missing(path: Path) -> Problem:
    """What is told where there is no first trust file."""
    fix = "put the first trust file there: `nondum keys trust FILE`"
    return Problem("TRUST_MISSING", "there is no trust file", str(path), fix=fix)


def read(path: Path) -> SignedFile:
    """A trust file on this host's disk, and its signatures. Raises `TrustRefused` (TOO_LARGE,
    IO_ERROR)."""
    try:
        with path.open("rb") as opened:
            return _signed(path, opened)
    except OSError as error:
        raise TrustRefused(disk.problem_of(error, "cannot be read", path)) from error


def place(path: Path, file: SignedFile) -> None:
    """Write a first trust file and its signatures where a host reads them; folders that are missing
    are made.

    Nothing is written where another user can change a folder on the way: that user could have the
    caller, who may be root, write to another place.

    Raises `TrustRefused` (TRUST_OPEN_TO_OTHERS), `OSError`.
    """
    try:
        folder = os.open(_safe_folder(path.parent), _FOLDER)
        try:
            # The file alone would count as placed by root.
            if file.signature is not None:
                _replace(folder, path.name + SIGNATURE_SUFFIX, file.signature)
            _replace(folder, path.name, file.data)
        finally:
            os.close(folder)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _read_own(path: Path) -> tuple[SignedFile, int]:
    """The file, and the user that it belongs to: root, or the one that this host runs as."""
    try:
        with path.open("rb") as opened:
            status = os.fstat(opened.fileno())
            if status.st_mode & _OTHERS_WRITE or status.st_uid not in (0, os.geteuid()):
                raise TrustRefused(_writable_by_other_users(path, status))
            return _signed(path, opened), status.st_uid
    except OSError as error:
        if isinstance(error, FileNotFoundError) and error.filename == str(path):
            raise TrustRefused(missing(path)) from error
        raise TrustRefused(disk.problem_of(error, "cannot be read", path)) from error


def _signed(path: Path, opened: BinaryIO) -> SignedFile:
    data, signed = opened.read(trust_file.MAX_BYTES + 1), None
    signature = path.with_name(path.name + SIGNATURE_SUFFIX)
    if os.path.lexists(signature):
        with signature.open("rb") as beside:
            signed = beside.read(sshsig.MAX_BYTES + 1)
    if len(data) > trust_file.MAX_BYTES or len(signed or b"") > sshsig.MAX_BYTES:
        told, fix = f"is longer than {trust_file.MAX_BYTES} bytes", "put the genuine file there"
        raise TrustRefused(Problem("TOO_LARGE", told, where=str(path), fix=fix))
    return SignedFile(data, signed, str(path))


def _writable_by_other_users(path: Path, status: os.stat_result) -> Problem:
    return Problem(
        "TRUST_OPEN_TO_OTHERS",
        "others can change this file, so it does not say which keys to trust",
        where=str(path),
        need="owner root, mode 0644",
        have=f"user {status.st_uid}, mode {stat.S_IMODE(status.st_mode):04o}",
        fix="put the genuine file there, then `chown root` and `chmod 644` it",
    )


def _safe_folder(folder: Path) -> Path:
    """The folder without links on its way; each folder that leads there, and each that a link leads
    to, is one that others cannot change.

    In a folder with the sticky bit (/tmp) others cannot replace what is not theirs, so it may lead
    to one, but not be it; links that they have made there are not followed.
    """
    here = Path(folder.absolute().anchor)
    left = list(reversed(folder.absolute().parts[1:]))
    links = 0
    while True:
        _refuse_open(here, is_last=not left)
        if not left:
            return here
        inner = here / left.pop()
        if not os.path.lexists(inner):
            inner.mkdir(mode=0o755)
            disk.sync(here)
        if not inner.is_symlink():
            here = inner
            continue
        _refuse_open(inner, is_last=False)
        links += 1
        if links > MOST_LINKS:
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(folder))
        to = here / inner.readlink()
        here, left = Path(to.anchor), [*left, *reversed(to.parts[1:])]


def _refuse_open(folder: Path, *, is_last: bool) -> None:
    """Raise `TrustRefused` for a folder, or a link to one, that others can change."""
    status = folder.lstat()
    may_lead = bool(status.st_mode & stat.S_ISVTX) and not is_last
    is_link = stat.S_ISLNK(status.st_mode)  # its mode means nothing (symlink(7))
    is_open = bool(status.st_mode & _OTHERS_WRITE) and not may_lead and not is_link
    if is_open or status.st_uid not in (0, os.geteuid()):
        raise TrustRefused(
            Problem(
                "TRUST_OPEN_TO_OTHERS",
                "others can change this folder, so no trust file is written there",
                where=str(folder),
                need="owner root, mode 0755",
                have=f"user {status.st_uid}, mode {stat.S_IMODE(status.st_mode):04o}",
                fix="`chown root` and `chmod go-w` it, or name another place: `file` under [trust]",
            )
        )


def _replace(folder: int, name: str, data: bytes) -> None:
    """Give a file in an open folder a content, whole or not at all, never through a link."""
    unfinished = f".{name}.{secrets.token_hex(8)}"
    try:
        with os.fdopen(os.open(unfinished, _NEW, 0o600, dir_fd=folder), "wb") as out:
            out.write(data)
            out.flush()
            os.fchmod(out.fileno(), 0o644)
            os.fsync(out.fileno())
        os.rename(unfinished, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(unfinished, dir_fd=folder)
        raise
    os.fsync(folder)
