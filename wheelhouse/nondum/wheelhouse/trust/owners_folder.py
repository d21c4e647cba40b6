"""A trust file as its owner keeps it: the version in work, and those before it.

    trust.toml        the newest version: signed, or in work
    trust.toml.sig    its roots' signatures
    trust-1.toml      the version before, and its signatures; robots that missed it need it
    trust-1.toml.sig

A version that was signed is never changed: what follows is the next one.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from nondum.sdk.errors import Problem, TrustRefused
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.store import disk
from nondum.wheelhouse.trust import editing, signing, sshsig, succession, trust_file, trust_text
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Roots, Trust

SIGNATURE_SUFFIX = ".sig"


def read(path: Path) -> SignedFile:
    """A trust file, with its signatures if there are any. Raises `TrustRefused` (TOO_LARGE),
    `OSError`."""
    data, signature = path.read_bytes(), _signature(path)
    signed = signature.read_bytes() if signature.exists() else None
    if len(data) > trust_file.MAX_BYTES or len(signed or b"") > sshsig.MAX_BYTES:
        told, fix = f"is longer than {trust_file.MAX_BYTES} bytes", "give the genuine file"
        raise TrustRefused(Problem("TOO_LARGE", told, where=str(path), fix=fix))
    return SignedFile(data, signed, str(path))


def parsed(path: Path) -> Trust:
    """What it says. Raises `TrustRefused`, `OSError`."""
    return trust_file.parse_bytes(read(path).data, str(path))


def create(path: Path, trust: Trust) -> None:
    """Write a first version. Raises `TrustRefused` (TRUST_EXISTS, TRUST_…), `OSError`."""
    if path.exists():
        told, fix = "there is a trust file already", "choose another name, or change that one"
        raise TrustRefused(Problem("TRUST_EXISTS", told, where=str(path), fix=fix))
    disk.make_folder(path.parent)
    _write(path, trust)


def edit(path: Path, change: Callable[[Trust], Trust], now: datetime) -> Trust:
    """Change a trust file: the version in work, or the next one of a signed version, which is kept
    beside it. Raises what `change` does, `TrustRefused`, `OSError`."""
    before = parsed(path)
    is_signed = _signature(path).exists()
    after = change(editing.following(before, now) if is_signed else before)
    trust_file.parse(trust_text.to_text(after), str(path))
    if is_signed:
        kept = _kept(path, before.version)
        disk.write(kept, path.read_bytes())
        _signature(path).rename(_signature(kept))
    _write(path, after)
    return after


def sign(path: Path, key: Path) -> Trust:
    """Add the signature of one root. Raises `TrustRefused` (KEY_NOT_ROOT, SSH_KEYGEN, …),
    `PayloadRefused` (SIG_MALFORMED), `OSError`."""
    file = read(path)
    trust = trust_file.parse_bytes(file.data, str(path))
    made = signing.sign(file.data, key, sshsig.TRUST)
    (signature,) = sshsig.parse(made, str(key))
    points = {root.key.point for roots in _who_must(path, trust) for root in roots.keys}
    if signature.key.point not in points:
        told = f"the key {signature.key.fingerprint} is none of the roots"
        fix = "sign with a root's key; roots are changed by `nondum keys rotate`"
        raise TrustRefused(Problem("KEY_NOT_ROOT", told, where=str(path), fix=fix))
    added = signing.added(file.signature, made, str(_signature(path)))
    disk.write(_signature(path), added)
    return trust


def still_missing(path: Path) -> tuple[str, ...]:
    """The signatures that are missing, a sentence for each set of roots; empty: none."""
    file = read(path)
    trust = trust_file.parse_bytes(file.data, str(path))
    points = succession.signers(file) if file.signature is not None else frozenset()
    return tuple(
        sentence
        for roots in _who_must(path, trust)
        if (sentence := _missing(roots, points)) is not None
    )


def versions(path: Path) -> tuple[SignedFile, ...]:
    """All signed versions that lie beside a trust file, oldest first, itself at last."""
    newest = parsed(path).version
    before = (_kept(path, version) for version in range(1, newest))
    return tuple(read(file) for file in (*before, path) if file.exists())


def sign_payload(folder: Path, key: Path) -> tuple[str, ...]:
    """Add a signature to a payload; gives the fingerprints of all who have signed.

    Raises `PayloadRefused` (a list that is none; SIG_…), `TrustRefused` (SSH_KEYGEN, …), `OSError`.
    """
    data = (folder / contents.NAME).read_bytes()
    contents.parse(data, f"{folder.name}/{contents.NAME}")
    path = folder / contents.SIGNATURE_NAME
    before = path.read_bytes() if path.exists() else None
    if before is not None and not all(s.holds(data) for s in sshsig.parse(before, str(path))):
        before = None  # the payload was built again
    made = signing.added(before, signing.sign(data, key, sshsig.PAYLOAD), str(path))
    disk.write(path, made)
    return tuple(one.key.fingerprint for one in sshsig.parse(made, str(path)))


def _who_must(path: Path, trust: Trust) -> tuple[Roots, ...]:
    """The sets of roots whose threshold must sign a version."""
    kept = _kept(path, trust.version - 1)
    before = (parsed(kept).roots,) if kept.exists() else ()
    return tuple(dict.fromkeys((*before, trust.roots)))


def _missing(roots: Roots, points: frozenset[bytes]) -> str | None:
    names = [root.name for root in roots.keys if root.key.point not in points]
    count = roots.threshold - (len(roots.keys) - len(names))
    return f"{count} more of {', '.join(names)}" if count > 0 else None


def _write(path: Path, trust: Trust) -> None:
    text = trust_text.to_text(trust)
    trust_file.parse(text, str(path))
    disk.write(path, text.encode())


def _signature(path: Path) -> Path:
    return path.with_name(path.name + SIGNATURE_SUFFIX)


def _kept(path: Path, version: int) -> Path:
    return path.with_name(f"{path.stem}-{version}{path.suffix}")
