"""Reads the configuration's file over its defaults: all mistakes are told at once."""

from __future__ import annotations

import contextlib
import difflib
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import GenericAlias
from typing import Any, get_args, get_type_hints

from nondum.host.config import feedback_section, stop_section
from nondum.host.config.confinement_level import Wanted, parse_wanted
from nondum.host.config.host_config import HostConfig, PeersSection, default_name
from nondum.host.config.places import Places
from nondum.sdk.errors import ConfigRefused, Problem
from nondum.wheelhouse.format import confinement
from nondum.wheelhouse.format.confinement import Level

REACHED_BY = ("listen", "static", "development")
"""Keys of [peers] that say how other hosts are reached."""
_REFERENCE = re.compile(r"[\w.]+:\w+")
_AT_LINE = re.compile(r"at line (\d+)")
HOST_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_A_PATH = "a path as a string; `~user/` only of a user of this host"
KINDS: Mapping[Any, str] = {
    str: "a string",
    int: "a whole number of at least 0",
    float: "a number above 0",
    bool: "true or false",
    Path: _A_PATH,
    Path | None: _A_PATH,
    tuple[Path, ...]: f"a list of paths, each {_A_PATH}",
    tuple[str, ...]: "a list of strings",
    Level: confinement.EXPECTED,
    Wanted: f'"auto", {confinement.EXPECTED}',
}


def _path(value: object) -> Path:
    """Absolute: processes that the daemon starts work in other folders."""
    if not isinstance(value, str) or not value or "\0" in value:
        raise ValueError(value)
    try:
        return Path(value).expanduser().absolute()
    except RuntimeError as error:  # `~name/` of a user that there is not
        raise ValueError(value) from error


_PARSERS: Mapping[Any, Callable[[object], Any]] = {
    Level: confinement.parse,
    Wanted: parse_wanted,
    Path: _path,
    Path | None: _path,
}
"""Kinds of values that are read from text or numbers; each raises `ValueError`."""


def load(path: Path, defaults: HostConfig) -> HostConfig:
    """Read a file over the defaults. Raises `ConfigRefused` with everything wrong in it."""
    return parse(read(path), str(path), defaults)


def read(path: Path) -> str:
    """The text of a file. Raises `ConfigRefused` (CONFIG_UNREADABLE)."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigRefused(
            Problem("CONFIG_UNREADABLE", f"cannot be read ({error})", where=str(path))
        ) from error


def parse(text: str, where: str, defaults: HostConfig) -> HostConfig:
    """Parse TOML over the defaults. Raises `ConfigRefused` with everything wrong in it."""
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, or a number without end
        at = _AT_LINE.search(str(error))
        place = f"{where}:{at[1] if at else len(text.splitlines())}"
        raise ConfigRefused(Problem("CONFIG_TOML", str(error), where=place)) from error
    places = Places(where, text)
    problems: list[Problem] = []
    sections = {f.name: getattr(defaults, f.name) for f in fields(HostConfig)}
    for name, table in data.items():
        if name not in sections:
            problems.append(_unknown(name, sections, places.of(name)))
        elif not isinstance(table, dict):
            problems.append(_wrong(f"[{name}]", "a table", table, places.of(name)))
        else:
            sections[name] = _section(name, sections[name], table, places, problems)
    has_router = bool(sections["router"].endpoints)
    sections["peers"] = _wanted(sections["peers"], data.get("peers"), has_router=has_router)
    if has_router:
        sections["peers"] = _unproved(sections["peers"], data.get("peers"))
    problems.extend(_contradictions(HostConfig(**sections), places))
    problems.extend(feedback_section.problems(sections["feedback"], places))
    problems.extend(stop_section.problems(sections["stop"], places))
    if problems:
        raise ConfigRefused(*problems)
    return HostConfig(**sections)


def check_name(name: str, *, where: str) -> None:
    """Raise `ConfigRefused` (CONFIG_VALUE) unless a name is one that a host can have."""
    if problems := tuple(_name_problems(name, where)):
        raise ConfigRefused(*problems)


def _wanted(peers: PeersSection, table: object, *, has_router: bool) -> PeersSection:
    """With `--user` peers are off by default; a file that says how they are to be reached wants
    them on, unless it says itself that they are off."""
    said = table.keys() if isinstance(table, dict) else set()
    is_wanted = has_router or not said.isdisjoint(REACHED_BY)
    return replace(peers, enabled=True) if is_wanted and "enabled" not in said else peers


def _unproved(peers: PeersSection, table: object) -> PeersSection:
    """What holds among peers that prove no keys, but for what the file's table says."""
    said = table.keys() if isinstance(table, dict) else set()
    return replace(
        peers,
        accept_goals="accept_goals" in said and peers.accept_goals,
        place="place" in said and peers.place,
    )


def _section(
    name: str, default: Any, table: Mapping[str, Any], places: Places, problems: list[Problem]
) -> Any:
    hints = get_type_hints(type(default))
    values = {key: getattr(default, key) for key in hints}
    for key, value in table.items():
        if key not in hints:
            problems.append(_unknown(key, hints, f"{places.of(name, key)} [{name}]"))
            continue
        typed = _typed(hints[key], value)
        if typed is None:
            kind = KINDS.get(hints[key], "another kind of value")
            problems.append(_wrong(f"[{name}] {key}", kind, value, places.of(name, key)))
        else:
            values[key] = typed
    return type(default)(**values)


def _typed(hint: Any, value: Any) -> Any:
    """The value as `hint` wants it, or None when it is of another kind."""
    if hint in _PARSERS:
        with contextlib.suppress(ValueError):
            return _PARSERS[hint](value)
        return None
    if isinstance(hint, GenericAlias):
        (item, _) = get_args(hint)
        typed = [_typed(item, v) for v in value] if isinstance(value, list) else [None]
        return None if None in typed else tuple(typed)
    if hint is float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if is_number and value > 0 else None
    if hint is int:
        return value if type(value) is int and value >= 0 else None
    return value if type(value) is hint else None


def _contradictions(config: HostConfig, places: Places) -> Iterator[Problem]:
    """What has the right kind, and a value that there is not."""
    name = config.host.name
    yield from _name_problems(name, places.of("host", "name"), key="[host] name = ")
    for section, key, is_right, expected in (
        ("trust", "on_revoke", _one_of("stop", "flag"), '"stop" or "flag"'),
        ("install", "method", _one_of("store", "pip"), '"store" or "pip"'),
        ("host", "system_tree", _REFERENCE.fullmatch, '"package:function"'),
    ):
        value = getattr(getattr(config, section), key)
        if not is_right(value):
            yield _wrong(f"[{section}] {key}", expected, value, places.of(section, key))


def _one_of(*values: str) -> Callable[[Any], object]:
    return frozenset(values).__contains__


def _name_problems(name: str, where: str, *, key: str = "") -> Iterator[Problem]:
    if not HOST_NAME.fullmatch(name):
        yield Problem(
            "CONFIG_VALUE",
            f"{key}{name!r} is not a host name",
            where=where,
            fix=f"lower-case letters, digits and single hyphens: {default_name(name)!r}",
        )


def _unknown(key: str, known: Mapping[str, Any], where: str) -> Problem:
    near = difflib.get_close_matches(key, known, n=1)
    fix = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(sorted(known))}"
    return Problem("CONFIG_KEY", f"unknown key {key!r}", where=where, fix=fix)


def _wrong(key: str, expected: str, value: Any, where: str) -> Problem:
    try:
        shown = repr(value)
    except ValueError:  # of a number with thousands of digits (sys.set_int_max_str_digits)
        shown = "a value too long to be shown"
    return Problem("CONFIG_VALUE", f"{key} = {shown}: expected {expected}", where=where)
