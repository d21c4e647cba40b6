"""Which block devices are the machine's own, whatever they hang on: pure.

A robot may boot from a USB disk, keep /var on one, swap to it, or have made an array of several.
Such a disk is the machine's as a whole: unused partitions of it are no drives either.
What a person or a desktop has mounted where people look for their sticks is theirs, and no more
than that one partition.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import PurePath, PurePosixPath

from nondum.host.sandbox.helper.mountinfo import Mount, unescaped
from nondum.sdk.frozen import frozen

PEOPLES = tuple(map(PurePosixPath, ("/media", "/run/media", "/mnt")))
"""Where people, and desktops for them, mount what they plug in (file-hierarchy(7))."""
_BY = {
    "UUID": "by-uuid",
    "LABEL": "by-label",
    "PARTUUID": "by-partuuid",
    "PARTLABEL": "by-partlabel",
    "ID": "by-id",
}
_AT_BOOT = ("root", "resume", "mount.usr")
"""What of the kernel's command line names a disk (kernel-command-line(7))."""


@frozen
class Block:
    """A block device, as sysfs shows it."""

    name: str
    number: int
    disk: str
    """What it is a partition of; a disk is its own."""
    holders: tuple[str, ...] = ()
    """Devices that are made of it: logical volumes, arrays, what is decrypted."""


@frozen
class Named:
    """A device that the machine's configuration names, by a path below /dev."""

    path: str
    why: str


@frozen
class Use:
    """What a block device is needed for."""

    why: str
    is_own: bool = True
    """Whether the machine needs it; else somebody does, as long as it is mounted."""


def in_fstab(text: str) -> Iterator[Named]:
    """What fstab(5) names.

    >>> [named.path for named in in_fstab("UUID=1-2 /var ext4 defaults 0 2")]
    ['/dev/disk/by-uuid/1-2']
    """
    for words in _lines(text):
        where = unescaped(words[1]) if len(words) > 1 else "none"
        is_swap = len(words) > 2 and words[2] == "swap"
        use = "swaps to it" if is_swap else f"mounts it on {where}"
        yield from _named(words[0], f"the machine {use} (/etc/fstab)")


def in_unit(text: str, unit: str) -> Iterator[Named]:
    """What a unit that mounts or swaps names, or what is dropped in for one (systemd.mount(5),
    systemd.swap(5)).

    >>> [named.path for named in in_unit("[Mount]\\nWhat = LABEL=OURS", "srv.mount")]
    ['/dev/disk/by-label/OURS']
    """
    verb = "swaps to" if unit.endswith(".swap") else "mounts"
    for line in text.splitlines():
        key, _, spec = line.partition("=")
        if key.strip() == "What":
            yield from _named(spec.strip().replace("%%", "%"), f"the machine {verb} it ({unit})")


def in_crypttab(text: str) -> Iterator[Named]:
    """What crypttab(5) names."""
    for words in _lines(text):
        if len(words) > 1:
            yield from _named(words[1], f"the machine decrypts it as {words[0]} (/etc/crypttab)")


def in_swaps(text: str) -> Iterator[Named]:
    """What /proc/swaps lists."""
    for words in _lines(text.partition("\n")[2]):
        yield from _named(words[0], "the machine swaps to it")


def in_command_line(text: str) -> Iterator[Named]:
    """What the kernel was told to boot from.

    >>> [named.path for named in in_command_line("quiet root=PARTUUID=12-02 rw")]
    ['/dev/disk/by-partuuid/12-02']
    """
    for word in text.split():
        key, _, spec = word.partition("=")
        if key in _AT_BOOT:
            yield from _named(spec, f"the machine was booted with it ({key}=)")


def mounted(mounts: Iterable[Mount], ours: PurePath) -> Iterator[tuple[Mount, Use]]:
    """What mounts need their devices for, but for those below `ours`."""
    for mount in mounts:
        at = PurePosixPath(mount.at)
        if ours not in at.parents:
            is_own = not any(place in at.parents for place in PEOPLES)
            yield mount, Use(f"it is mounted on {at}", is_own)


def uses(blocks: Collection[Block], direct: Mapping[int, Use]) -> dict[str, Use]:
    """What block devices are needed for, by their names; those that are not in it are free.

    `direct` is what is known by numbers; from there it spreads to what a device is made of, and
    from what is the machine's own to the whole disk.
    """
    by_name = {block.name: block for block in blocks}
    found: dict[str, Use] = {}
    for block in blocks:
        known = direct.get(block.number)
        if block.holders and (known is None or not known.is_own):
            known = Use(f"{', '.join(block.holders)} is made of it")
        if known is not None:
            found[block.name] = known
    own_disks = {
        by_name[name].disk: replace(use, why=f"{name}: {use.why}")
        for name, use in sorted(found.items())
        if use.is_own
    }
    for block in blocks:
        known = found.get(block.name)
        if block.disk in own_disks and (known is None or not known.is_own):
            found[block.name] = own_disks[block.disk]
    return found


def _lines(text: str) -> Iterator[list[str]]:
    for line in text.splitlines():
        words = line.split()
        if words and not words[0].startswith("#"):
            yield words


def _named(spec: str, why: str) -> Iterator[Named]:
    """The path that a word of fstab stands for; of what is no device nothing: to look at a path of
    a network's file system may take for ever."""
    tag, _, value = unescaped(spec).partition("=")
    if tag in _BY and value:
        name = value.strip('"')
        yield Named(f"/dev/disk/{_BY[tag]}/{name}", why)
        if (escaped := _as_udev_writes(name)) != name:
            yield Named(f"/dev/disk/{_BY[tag]}/{escaped}", why)
    elif tag.startswith("/dev/"):
        yield Named(unescaped(spec), why)


def _as_udev_writes(label: str) -> str:
    """The name of a label's link (ID_FS_LABEL_ENC).

    >>> _as_udev_writes("my stick/1")
    'my\\\\x20stick\\\\x2f1'
    """
    keeps = "#+-.:=@_"
    return "".join(
        letter
        if letter.isalnum() or letter in keeps or not letter.isascii()
        else f"\\x{ord(letter):02x}"
        for letter in label
    )
