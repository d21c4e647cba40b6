"""Match rules of `[[component.device]]`: which node of which device serves a need.

A rule is a key and a pattern. Keys in small letters are nondum's own words, below; any other key is
a property of udev. Patterns are those of udev(7): `*`, `?` and `[…]`, alternatives with `|`
between. All rules of a need must match.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TypeAlias

from nondum.sdk.frozen import frozen

Facts: TypeAlias = Mapping[str, Sequence[str]]
"""What is known of a node: word or property → its values, of which one must match."""

WORDS: Mapping[str, str] = {
    "bus": "what it hangs on: usb, i2c, spi, pci, platform …",
    "driver": "the kernel's driver of its interface",
    "interface": "class of its USB interface: a name, or 03, 03:01, 03:01:02 in hexadecimal",
    "port": "where it is plugged in: 1-4.2",
    "serial": "its serial number",
    "subsystem": "the kernel's kind of node: tty, video4linux, hidraw, sound, i2c-dev …",
    "usb": "vendor and product: 0403:6001 in hexadecimal",
}
"""Word → what it is compared with."""

CLASSES: Mapping[str, str] = {
    "audio": "01",
    "cdc": "02",
    "hid": "03",
    "image": "06",
    "printer": "07",
    "storage": "08",
    "hub": "09",
    "cdc-data": "0a",
    "smart-card": "0b",
    "video": "0e",
    "vendor": "ff",
}
"""Names of USB's interface classes."""

NAMING_IDS = frozenset({"usb", "serial", "ID_VENDOR_ID", "ID_MODEL_ID", "ID_MODEL"}) | frozenset(
    {"ID_SERIAL", "ID_SERIAL_SHORT", "ID_VENDOR"}
)
"""Keys by which a device is asked for by what it is, not only by its kind."""
NAMING_NODES = frozenset({"subsystem", "SUBSYSTEM", "DEVNAME", "DEVTYPE"})
"""Keys by which a kind of node is asked for."""

_PAIR = r"[0-9a-f?*\[\]!-]"
_USB = re.compile(f"{_PAIR}+:{_PAIR}+")
_INTERFACE = re.compile(f"{_PAIR}+(:{_PAIR}+){{0,2}}")


@frozen
class Verdict:
    """How one rule fared with one node."""

    key: str
    pattern: str
    found: tuple[str, ...]
    """What the node has there; empty: nothing."""
    matched: bool


def judged(match: Mapping[str, str], facts: Facts) -> tuple[Verdict, ...]:
    """Every rule of a need against a node.

    >>> [v.matched for v in judged({"usb": "0403:*", "ID_MODEL": "A|B"}, {"usb": ["0403:6001"]})]
    [True, False]
    """
    return tuple(_judged(key, pattern, facts) for key, pattern in match.items())


def fits(match: Mapping[str, str], facts: Facts) -> bool:
    """Whether all rules of a need match a node. A node without a property has it empty."""
    return all(verdict.matched for verdict in judged(match, facts))


def wrong_rules(match: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """What is wrong with the rules of a need, and what to do about it."""
    for key, pattern in match.items():
        if not key.islower():
            continue
        if key not in WORDS:
            near = difflib.get_close_matches(key, WORDS, n=1)
            known = f"known: {', '.join(WORDS)}; properties of udev are written in capitals"
            yield (
                f"there is no word {key!r} to match by",
                (f"did you mean {near[0]!r}?" if near else known),
            )
        elif key == "usb" and not all(map(_USB.fullmatch, _alternatives(pattern.lower()))):
            yield f"{pattern!r} is no vendor:product", "write both in hexadecimal: '0403:6001'"
        elif key == "interface" and not all(map(_is_interface, _alternatives(pattern.lower()))):
            yield (
                f"{pattern!r} is no class of interfaces",
                f"write '03', '03:01', '03:01:02' or one of: {', '.join(CLASSES)}",
            )


def names_id(match: Mapping[str, str]) -> bool:
    """Whether a need asks for a device by what it is: vendor, product or serial number.

    >>> names_id({"usb": "0627:0001"}), names_id({"usb": "*:*"}), names_id({"bus": "usb"})
    (True, False, False)
    """
    return any(
        key in NAMING_IDS and all(one.strip("*?:") for one in _alternatives(pattern))
        for key, pattern in match.items()
    )


def _judged(key: str, pattern: str, facts: Facts) -> Verdict:
    found = tuple(facts.get(key, ()))
    if key in ("usb", "interface"):
        pattern_told, pattern = pattern, pattern.lower()
    else:
        pattern_told = pattern
    wanted = [_interface(one) if key == "interface" else one for one in _alternatives(pattern)]
    values = found or ("",)
    matched = any(fnmatchcase(value, one) for value in values for one in wanted)
    return Verdict(key, pattern_told, found, matched)


def _alternatives(pattern: str) -> list[str]:
    return [one.strip() for one in pattern.split("|")]


def _is_interface(pattern: str) -> bool:
    return pattern in CLASSES or _INTERFACE.fullmatch(pattern) is not None


def _interface(pattern: str) -> str:
    """A class as it is compared: class, subclass and protocol.

    >>> _interface("hid"), _interface("03:01")
    ('03:*:*', '03:01:*')
    """
    parts = CLASSES.get(pattern, pattern).split(":")
    return ":".join([*parts, "*", "*"][:3])
