"""Extension modules of a wheel, which must be for the machine that its name says.

Wheels may carry programs and libraries for any machine as data, so only what an interpreter would
load is judged: the libraries that `auditwheel` puts beside the packages, and extension modules
(PEP 3149, PEP 384) in importable places. Of those without a machine in their name, one for another
machine passes where the wheel has it for its own as well, or where it is no module but a library.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.fixed_file import Bytes
from nondum.wheelhouse.wheels import archive
from nondum.wheelhouse.wheels.archive import Member
from nondum.wheelhouse.wheels.dist_info import WheelName
from nondum.wheelhouse.wheels.elf import ARCHITECTURES, HEAD_BYTES, Elf

MAX_TOLD = 10
"""Files that are told when they are wrong."""
MAX_SEARCHED = 256 * 1024**2
"""Bytes of foreign files that are searched for what modules are begun by: all honest wheels have
fewer, and others are not to take long."""

_EXTENSION = re.compile(r"(?P<module>\w+)(\.cpython-\w+-(?P<machine>\w+)-linux-\w+|\.abi3|)\.so")
_LIBRARY = re.compile(r".+\.so(\.\d+)*")
_TRIPLETS = {"armv6l": "arm", "armv7l": "arm", "i686": "i386", "ppc64le": "powerpc64le"}
"""How names of files call architectures that tags call otherwise."""


@frozen
class _Placed:
    """A file of a wheel, its place in site-packages and what it is for; None: no machine code."""

    target: str
    member: Member
    elf: Elf | None

    @property
    def name(self) -> str:
        return self.target.rpartition("/")[2]


def problems(
    data: Bytes, files: Sequence[tuple[str, Member]], named: WheelName, filename: str
) -> Iterator[Problem]:
    """What of a wheel's files, each with its place in site-packages, is for another machine."""
    architectures = named.architectures
    if not architectures or not architectures <= ARCHITECTURES.keys():
        return
    wanted = {ARCHITECTURES[name] for name in architectures}
    found = [
        _Placed(target, member, Elf.parse(archive.head(data, member, HEAD_BYTES)))
        for target, member in files
        if ".so" in target
    ]
    foreign = (one for one in found if one.elf is not None and one.elf not in wanted)
    own = {one.name for one in found if one.elf in wanted}
    for one in itertools.islice(_loaded(data, foreign, architectures, own), MAX_TOLD):
        yield Problem(
            "WHEEL_MACHINE",
            f"{one.target!r} is machine code for another processor",
            where=filename,
            need=", ".join(sorted(architectures)),
            have=str(one.elf),
            fix="build the wheel on such a machine or for it, and then the payload again",
        )


def _loaded(
    data: Bytes, foreign: Iterable[_Placed], architectures: AbstractSet[str], own: AbstractSet[str]
) -> Iterator[_Placed]:
    """Those of the files for other machines that an interpreter would load; `own` are the names of
    those for its own."""
    left = MAX_SEARCHED
    for one in foreign:
        begun_by = _begun_by(one, architectures)
        if begun_by and one.name not in own:
            left -= one.member.size
            if left >= 0 and archive.contains(data, one.member, begun_by):
                yield one
        elif begun_by == b"":
            yield one


def _begun_by(one: _Placed, architectures: AbstractSet[str]) -> bytes | None:
    """The function that a file would have to export to be loaded, where its place and name do not
    settle it; empty: it would be loaded; None: it would not."""
    folders = one.target.split("/")[:-1]
    if len(folders) == 1 and folders[0].endswith(".libs"):
        return b"" if _LIBRARY.fullmatch(one.name) else None
    named = _EXTENSION.fullmatch(one.name)
    if named is None or not all(name.isidentifier() for name in (*folders, named["module"])):
        return None
    if named["machine"]:
        return b"" if named["machine"] in {_TRIPLETS.get(a, a) for a in architectures} else None
    return f"PyInit_{named['module']}".encode()
