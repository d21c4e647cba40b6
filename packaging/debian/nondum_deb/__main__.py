"""`./run package`: builds nondum_VERSION_ARCH.deb; see docs/install.md.

The same commit, and the same lock, give the same bytes, whenever and wherever it is built.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from nondum_deb import control, lock, places, repository, tree
from nondum_deb.architecture import ARCHITECTURES, Architecture, here
from nondum_deb.command import BuildFailed, call
from nondum_deb.places import CHECKOUT

OUTPUT = CHECKOUT / "build/packages"
FIRST_EPOCH = 1577836800
"""What counts as the time of a checkout without history: the start of 2020, as wheels have it."""
VERSION = re.compile(r"[0-9][A-Za-z0-9.+~]*")


def main(words: Sequence[str]) -> int:
    """Do what is asked for; answers the exit status."""
    asked = _arguments(words)
    try:
        if asked.lock:
            lock.write()
            return 0
        if asked.repository:
            repository.see_to_it(asked.repository)
        wanted = [ARCHITECTURES[name] for name in asked.arch or [_default()]]
        versions = asked.version or [debian(places.version())]
        with tempfile.TemporaryDirectory(prefix="nondum-own-") as own:
            tree.own_wheels(Path(own))
            for architecture in wanted:
                for package in build(architecture, versions, Path(own), asked.output):
                    print(package)
        if asked.repository:
            print(repository.write(asked.output, asked.repository))
    except BuildFailed as error:
        print(f"package: {error}", file=sys.stderr)
        return 1
    return 0


def build(
    architecture: Architecture, versions: Sequence[str], own: Path, output: Path
) -> Iterator[Path]:
    """Build the packages of one architecture, of the checkout's own wheels; yields their files."""
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="nondum-deb-") as scratch:
        root = Path(scratch, "root")
        root.mkdir()
        tree.make(root, architecture, own)
        for version in versions:
            target = output / f"nondum_{version}_{architecture.debian}.deb"
            made = _packed(root, version, architecture, Path(scratch, version))
            yield Path(shutil.move(made, target))


def _packed(root: Path, version: str, architecture: Architecture, work: Path) -> Path:
    epoch = _epoch()
    files, made = work / "files", work / "made.deb"
    shutil.copytree(root, files, symlinks=True)
    control.write(files, version, architecture, epoch)
    _settle(files, epoch)
    surroundings = {**os.environ, "SOURCE_DATE_EPOCH": str(epoch)}
    call("dpkg-deb", "--root-owner-group", "-Zxz", "--build", files, made, env=surroundings)
    return made


def debian(version: str) -> str:
    """A version of Python's (PEP 440) in Debian's order.

    >>> debian("1.2.0rc1"), debian("1.2.0.dev3"), debian("1.2.0.post1")
    ('1.2.0~rc1', '1.2.0~dev3', '1.2.0+post1')
    """
    before = re.sub(r"\.?(a|b|rc|dev)(?=[0-9])", r"~\1", version)
    return before.replace(".post", "+post")


def _settle(root: Path, epoch: int) -> None:
    """Give every file the modes of a package and one time, whatever the umask of the build."""
    for path in [root, *root.rglob("*")]:
        if not path.is_symlink():
            is_program = path.is_dir() or path.parent.name in ("bin", "DEBIAN")
            keeps = is_program and path.stat().st_mode & 0o100
            path.chmod(0o755 if keeps else 0o644)
        os.utime(path, (epoch, epoch), follow_symlinks=False)


def _epoch() -> int:
    if given := os.environ.get("SOURCE_DATE_EPOCH"):
        return int(given)
    try:
        return int(call("git", "-C", CHECKOUT, "log", "-1", "--format=%ct"))
    except BuildFailed:
        return FIRST_EPOCH


def _default() -> str:
    machine = here()
    if machine is None:
        raise BuildFailed(f"say --arch: one of {', '.join(ARCHITECTURES)}")
    return machine.debian


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./run package", description="Builds nondum's package.")
    parser.add_argument(
        *("--arch", "-a"), action="append", choices=ARCHITECTURES, help="this machine's; repeatable"
    )
    parser.add_argument(
        "--version", action="append", type=_version, help="Debian's version, for builds of your own"
    )
    parser.add_argument("--output", "-o", type=Path, default=OUTPUT, help="folder (build/packages)")
    parser.add_argument(
        "--repository",
        metavar="KEY",
        help="make the folder one that apt reads, signed with this key of gpg's",
    )
    parser.add_argument(
        "--lock", action="store_true", help="only fetch the newest of what it needs, and lock that"
    )
    return parser.parse_args(words)


def _version(text: str) -> str:
    if not VERSION.fullmatch(text):
        raise argparse.ArgumentTypeError(f"{text!r} is none: such as 0.1.0+site2")
    return text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
