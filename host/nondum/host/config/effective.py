"""What holds: defaults, the file over them, the command line over both; and who said it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from nondum.host.config import host_config, parsing
from nondum.host.config.host_config import HostConfig
from nondum.host.config.places import Places
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.confinement import Level


@frozen
class Asked:
    """What a command line says of the configuration."""

    is_user: bool = False
    """As this user: no root, no systemd, own state."""
    file: Path | None = None
    """None: the system's, if there is one; with `is_user` none."""
    name: str | None = None
    peers: tuple[str, ...] = ()


@frozen
class Setting:
    """One key, and who says what it is."""

    section: str
    key: str
    value: Any
    origin: str
    """`default`, `default with --user`, `default with a router`, `FILE:LINE`, or the option's
    name."""

    def to_dict(self) -> dict[str, Any]:
        """Plain data for tables and JSON."""
        key = f"{self.section}.{self.key}"
        return {"key": key, "value": plain(self.value), "from": self.origin}


def file_of(asked: Asked) -> Path | None:
    """The file that is read; None: there is none."""
    if asked.file is not None:
        return asked.file
    is_there = not asked.is_user and host_config.SYSTEM_FILE.exists()
    return host_config.SYSTEM_FILE if is_there else None


def effective(asked: Asked) -> HostConfig:
    """The configuration that a daemon starts with. Raises `ConfigRefused`, with all that is wrong
    in the file, or with the name of the command line."""
    file = file_of(asked)
    chosen = _defaults(asked) if file is None else parsing.load(file, _defaults(asked))
    if asked.name is not None:
        parsing.check_name(asked.name, where="--name")
        chosen = dataclasses.replace(chosen, host=dataclasses.replace(chosen.host, name=asked.name))
    if asked.peers:
        static = (*chosen.peers.static, *asked.peers)
        peers = dataclasses.replace(chosen.peers, enabled=True, static=static)
        chosen = dataclasses.replace(chosen, peers=peers)
    return chosen


def settings(asked: Asked) -> Iterator[Setting]:
    """Every key, in the order of the reference. Raises `ConfigRefused` like `effective`."""
    chosen, file = effective(asked), file_of(asked)
    places = Places(str(file), parsing.read(file)) if file else None
    said = dict(_said(asked))
    for section, key, _ in host_config.documented():
        value = getattr(getattr(chosen, section), key)
        origin = _default_of(section, key, value, asked)
        if places is not None and places.has(section, key):
            origin = places.of(section, key)
        yield Setting(section, key, value, said.get((section, key), origin))


def remarks(asked: Asked) -> Iterator[Problem]:
    """What is right and of no effect. Raises `ConfigRefused` like `effective`."""
    chosen, file = effective(asked), file_of(asked)
    if file is None or chosen.peers.enabled:
        return
    places = Places(str(file), parsing.read(file))
    for key in parsing.REACHED_BY:
        if places.has("peers", key):
            told = f"[peers] {key} has no effect, for peers are off"
            where, fix = places.of("peers", key), "set `enabled = true` under [peers]"
            yield Problem("CONFIG_UNUSED", told, where=where, fix=fix)


def plain(value: Any) -> Any:
    """A value as JSON and TOML have it."""
    if isinstance(value, Path | Level):
        return str(value)
    return [plain(item) for item in value] if isinstance(value, tuple) else value


def as_toml(value: Any) -> str:
    """A value as the file would say it; empty for what cannot be said there.

    >>> as_toml((Path("/a"),)), as_toml(True), as_toml(2.0), as_toml(None)
    ('["/a"]', 'true', '2.0', '')
    """
    return "" if value is None else json.dumps(plain(value), ensure_ascii=False)


def _defaults(asked: Asked) -> HostConfig:
    return host_config.user_config() if asked.is_user else HostConfig()


def _default_of(section: str, key: str, value: Any, asked: Asked) -> str:
    """Why a key that nothing sets has this value."""
    if value == getattr(getattr(HostConfig(), section), key):
        return "default"
    is_users = value == getattr(getattr(_defaults(asked), section), key)
    return "default with --user" if is_users else "default with a router"


def _said(asked: Asked) -> Mapping[tuple[str, str], str]:
    named = {("host", "name"): "--name"} if asked.name is not None else {}
    return named | (
        {("peers", "enabled"): "--peer", ("peers", "static"): "--peer"} if asked.peers else {}
    )
