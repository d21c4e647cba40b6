"""`python packaging/development install …`, as `./run` and tox call it, and `… lock`, as `./run
lock` does."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from nondum_dev.install import Own, install
from nondum_dev.problem import SetUpFailed
from nondum_dev.relock import relock


def main(words: Sequence[str]) -> int:
    """Do what is asked for; answers the exit status."""
    told = _arguments(words)
    try:
        if told.command == "lock":
            relock(upgrade=told.upgrade)
        else:
            own = [Own.parse(word, is_editable=True) for word in told.editable]
            own += [Own.parse(word) for word in told.what if _is_path(word)]
            words = [word for word in told.what if not _is_path(word)]
            install(own, told.group, words, keep=told.keep)
    except SetUpFailed as error:
        print(f"run: {error}", file=sys.stderr)
        return error.status
    return 0


def _is_path(word: str) -> bool:
    return "/" in word or word.startswith(".")


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="packaging/development", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    lock = commands.add_parser("lock", prog="./run lock", help="lock what is asked for")
    lock.add_argument("--upgrade", "-U", action="store_true", help="in the newest versions")
    installs = commands.add_parser("install", help="install from the lock, and from the checkout")
    installs.add_argument("what", nargs="*", help="folders, wheels, and names of packages")
    installs.add_argument("--editable", "-e", action="append", default=[], metavar="FOLDER")
    installs.add_argument("--group", action="append", default=[])
    installs.add_argument("--keep", action="store_true", help="the checkout's that are installed")
    for of_pip in ("--no-deps", "--force-reinstall"):
        installs.add_argument(of_pip, action="store_true", help="taken from tox; always so")
    return parser.parse_args(words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
