"""Making keys and signatures, as `ssh-keygen` does, and by it where it is there.

With ssh-keygen, keys may be in an agent or a FIDO token, or locked by a passphrase; without it,
only plain key files sign.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from nondum.sdk.errors import Problem, TrustRefused
from nondum.wheelhouse.trust import public_key, sshsig
from nondum.wheelhouse.trust.public_key import PublicKey
from nondum.wheelhouse.trust.wire import Malformed

HASH = "sha512"
PUBLIC_SUFFIX = ".pub"


def make_key(path: Path, comment: str, *, fido: bool, passphrase: bool) -> PublicKey:
    """Make a key pair: `path`, readable by its owner only, and `path`.pub.

    `passphrase`: ssh-keygen asks the person for one; a FIDO token asks to be touched.
    Raises `TrustRefused` (KEY_EXISTS, SSH_KEYGEN), `OSError`.
    """
    if path.exists() or _public_path(path).exists():
        fix = "choose another name: whatever was signed with it would be worth nothing"
        raise _refused("KEY_EXISTS", "there is a key of that name", path, fix)
    path.parent.mkdir(parents=True, exist_ok=True)
    if fido or passphrase or shutil.which("ssh-keygen"):
        kind = "ed25519-sk" if fido else "ed25519"
        secret = () if passphrase else ("-N", "")
        _ssh_keygen(path, "-q", "-t", kind, "-C", comment, *secret, "-f", str(path))
    else:
        _make_plain(path, comment)
    return read_public(path)


def read_public(path: Path) -> PublicKey:
    """The public key of a key file, or of its `.pub`. Raises `TrustRefused` (KEY_MALFORMED),
    `OSError`."""
    file = path if path.suffix == PUBLIC_SUFFIX else _public_path(path)
    text = file.read_bytes()[: public_key.MAX_LINE].decode("utf-8", "replace")
    return parse_public(text, str(file))


def parse_public(text: str, where: str) -> PublicKey:
    """The key of a line. Raises `TrustRefused` (KEY_MALFORMED)."""
    try:
        return public_key.parse_line(text)[0]
    except Malformed as flaw:
        fix = "give a line or file like those that `nondum keys new` makes"
        told = f"is no public key: {flaw}"
        raise TrustRefused(Problem("KEY_MALFORMED", told, where=where, fix=fix)) from flaw


def sign(data: bytes, key: Path, namespace: str) -> bytes:
    """The signature of data, in the form of a signature file. With a `.pub`, the agent signs.

    Raises `TrustRefused` (SSH_KEYGEN, KEY_MALFORMED), `OSError`.
    """
    if shutil.which("ssh-keygen"):
        made = _ssh_keygen(key, "-Y", "sign", "-q", "-n", namespace, "-f", str(key), data=data)
        where = f"{key}.sig"
        (found,) = sshsig.parse(made, where)  # a key of another kind is told here
        assert found.holds(data), "ssh-keygen signs what it is given"
        return made
    return _sign_plain(data, key, namespace)


def added(signatures: bytes | None, new: bytes, where: str) -> bytes:
    """A signature file with one more signature; it replaces an earlier one of the same key.

    Raises `PayloadRefused` (SIG_MALFORMED …) where the file is none.
    """
    if signatures is None:
        return new
    (mine,) = sshsig.parse(new, where)
    parts = [part for part in _parts(signatures, where) if _key_of(part) != mine.key]
    joined = b"".join([*parts, new])
    sshsig.parse(joined, where)
    return joined


def _parts(signatures: bytes, where: str) -> list[bytes]:
    sshsig.parse(signatures, where)
    end = f"{sshsig.END}\n".encode("ascii")
    whole = signatures if signatures.endswith(b"\n") else signatures + b"\n"
    return [part.lstrip(b"\n") + end for part in whole.split(end)[:-1]]


def _key_of(part: bytes) -> PublicKey:
    return sshsig.parse(part, "")[0].key


def _ssh_keygen(key: Path, *arguments: str, data: bytes | None = None) -> bytes:
    """Run it at the person's terminal, where it may ask. Raises `TrustRefused` (SSH_KEYGEN)."""
    try:
        # Prompts go to the terminal, not to these pipes.
        done = subprocess.run(["ssh-keygen", *arguments], input=data, capture_output=True)
    except FileNotFoundError as error:
        fix = "install openssh-client"
        raise _refused("SSH_KEYGEN", "ssh-keygen is not there", key, fix) from error
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        told = f"ssh-keygen refuses: {said[-1] if said else done.returncode}"
        fix = "is it an Ed25519 key, its file of mode 0600, its agent or token there?"
        raise _refused("SSH_KEYGEN", told, key, fix)
    return done.stdout


def _make_plain(path: Path, comment: str) -> None:
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    secret = Ed25519PrivateKey.generate()
    text = secret.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.OpenSSH,
        serialization.NoEncryption(),
    )
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(text)
    key = PublicKey(public_key.ED25519, secret.public_key().public_bytes_raw())
    _public_path(path).write_text(f"{key.line} {comment}".rstrip() + "\n", encoding="utf-8")


def _sign_plain(data: bytes, key: Path, namespace: str) -> bytes:
    """Sign with a key file that no passphrase locks."""
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    try:
        secret = serialization.load_ssh_private_key(key.read_bytes(), password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        fix = "install openssh-client: ssh-keygen uses locked keys, agents and FIDO tokens"
        raise _refused("KEY_MALFORMED", f"cannot be used: {error}", key, fix) from error
    if not isinstance(secret, Ed25519PrivateKey):
        fix = "make one with `nondum keys new`"
        raise _refused("KEY_MALFORMED", "is no Ed25519 key", key, fix)
    public = PublicKey(public_key.ED25519, secret.public_key().public_bytes_raw())
    signature = secret.sign(sshsig.to_be_signed(data, namespace, HASH))
    return sshsig.armoured(public, namespace, HASH, signature)


def _public_path(path: Path) -> Path:
    return Path(f"{path}{PUBLIC_SUFFIX}")  # also of a path without a name


def _refused(code: str, told: str, path: Path, fix: str) -> TrustRefused:
    return TrustRefused(Problem(code, told, where=str(path), fix=fix))
