"""A folder of packages as apt reads it: on a stick, or behind a web server (sources.list(5): flat).

apt-ftparchive writes what is in it, gpg signs that.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from nondum_deb.architecture import ARCHITECTURES
from nondum_deb.command import BuildFailed, call

KEY = "nondum.asc"
"""The public key, in the form that `Signed-By` of a source takes."""
OF_RELEASE = {
    "Origin": "nondum",
    "Label": "nondum",
    "Suite": "stable",
    "Architectures": " ".join(ARCHITECTURES),
}


def see_to_it(key: str) -> None:
    """Raises `BuildFailed` where a repository could not be written: before a package is built."""
    if shutil.which("apt-ftparchive") is None:
        raise BuildFailed("apt-ftparchive is not there: apt-get install apt-utils")
    call("gpg", "--batch", "--list-secret-keys", key)


def write(folder: Path, key: str) -> Path:
    """List all packages of a folder, and sign that with a key of gpg's; answers the signed list.

    Raises `BuildFailed`.
    """
    (folder / "Packages").write_text(_of("packages", folder), encoding="utf-8")
    told = (f"-oAPT::FTPArchive::Release::{name}={text}" for name, text in OF_RELEASE.items())
    for former in ("Release", "InRelease", KEY):  # a list does not name itself
        (folder / former).unlink(missing_ok=True)
    (folder / "Release").write_text(_of("release", folder, *told), encoding="utf-8")
    signed = folder / "InRelease"
    call(
        "gpg", "--batch", "--local-user", key, "--output", signed, "--clearsign", folder / "Release"
    )
    call("gpg", "--batch", "--output", folder / KEY, "--armor", "--export", key)
    return signed


def _of(what: str, folder: Path, *options: str) -> str:
    return call("apt-ftparchive", *options, what, ".", folder=folder)
