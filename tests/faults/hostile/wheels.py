"""Every hostile wheel of the wheelhouse's own corpus, in a payload that is right otherwise."""

from __future__ import annotations

from packaging.tags import sys_tags
from packaging.utils import InvalidWheelFilename, parse_wheel_filename
from tests.faults.hostile.case import Bench, HostileDrive
from tests.faults.hostile.changes import wheel_of
from tests.faults.hostile.payload_files import locked
from tests.wheelhouse.hostile import WHEELS, HostileWheel


def carrying(wheel: HostileWheel) -> HostileDrive:
    """A drive with one payload that needs that wheel and no other."""

    def make(bench: Bench) -> None:
        data = wheel.build(bench.canary)
        name, version, _, _ = parse_wheel_filename(wheel.filename)
        made = bench.payload_files()
        made = made.without(wheel_of(made)).with_file(f"wheels/{wheel.filename}", data)
        lock = locked(wheel.filename, data, name=str(name), version=str(version))
        made = made.with_file(made.lock, lock)
        own = f'distribution = "test-{made.component}"'
        made.edited("payload.toml", own, f'distribution = "{name}"').write(bench.drive, bench.sign)

    # What its metadata asks for may be missing in the lock as well.
    return HostileDrive(
        f"wheel-{wheel.name}", code_here(wheel), make, also=frozenset({"LOCK_INCOMPLETE"})
    )


def code_here(wheel: HostileWheel) -> str:
    """What a host tells: one that is built for another machine by its name is not looked into."""
    tags = parse_wheel_filename(wheel.filename)[3]
    is_foreign = wheel.code == "WHEEL_MACHINE" and tags.isdisjoint(sys_tags())
    return "WHEEL_INCOMPATIBLE" if is_foreign else wheel.code


def can_be_locked(wheel: HostileWheel) -> bool:
    """Whether a lock can name it; others are refused for their names, by the lock."""
    try:
        parse_wheel_filename(wheel.filename)
    except InvalidWheelFilename:
        return False
    return True


DRIVES: tuple[HostileDrive, ...] = tuple(carrying(w) for w in WHEELS if can_be_locked(w))
