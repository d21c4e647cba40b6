"""What each key means, its unit, default and an example, as `nondum config explain` tells it.

The words stand in `config.py`, below each field; `python -m tests.docs.reference` writes them to
`KEYS`, which ships with nondum, for nondum does not read its own sources.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from importlib import resources

from nondum.sdk.errors import ConfigRefused, Problem

KEYS = "keys.json"
UNITS = {"_s": "seconds", "_mb": "megabytes (of 1,048,576 bytes)", "_percent": "per cent"}
"""Ending of a key's name → its unit."""
EXAMPLES = {
    "host.name": '"panther"',
    "drives.slots": '["/srv/slots"]',
    "devices.slots": '["/srv/devices"]',
    "workers.confinement": '"sandboxed"',
    "workers.settings": '"/etc/nondum/settings.toml"',
    "peers.static": '["10.0.0.7", "mule.local:7410"]',
    "peers.offer_actuators": '["gripper"]',
    "router.endpoints": '["tls/router.example:7447"]',
    "router.authorities": '"/etc/nondum/router-ca.pem"',
    "router.certificate": '"/etc/nondum/host.pem"',
    "router.private_key": '"/etc/nondum/host.key"',
}
"""Of keys whose default is no good example."""


def unit_of(key: str) -> str:
    """The unit that a key's name tells; empty: it has none.

    >>> unit_of("deadline_s"), unit_of("memory_mb"), unit_of("slots")
    ('seconds', 'megabytes (of 1,048,576 bytes)', '')
    """
    return next((unit for ending, unit in UNITS.items() if key.endswith(ending)), "")


def keys() -> Mapping[str, Mapping[str, str]]:
    """`section.key` → its `meaning`, `kind`, `unit`, `default` and `example`."""
    text = resources.files(__package__).joinpath(KEYS).read_text(encoding="utf-8")
    found: Mapping[str, Mapping[str, str]] = json.loads(text)
    return found


def find(name: str) -> tuple[str, Mapping[str, str]]:
    """A key by `section.key`, or by its name alone where only one section has it.

    Raises `ConfigRefused` (CONFIG_KEY).
    """
    known = keys()
    wanted = name.strip("[]").replace("] ", ".").replace(" ", ".")
    meant = [key for key in known if wanted in (key, key.partition(".")[2])]
    if len(meant) == 1:
        return meant[0], known[meant[0]]
    near = meant or difflib.get_close_matches(wanted, known, n=3, cutoff=0.5)
    fix = f"did you mean {' or '.join(near)}?" if near else "`nondum config explain` lists all"
    told = f"{len(meant)} sections have a key {name!r}" if meant else f"unknown key {name[:60]!r}"
    raise ConfigRefused(Problem("CONFIG_KEY", told, fix=fix))
