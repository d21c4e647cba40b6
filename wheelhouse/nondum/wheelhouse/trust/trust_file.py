"""`trust.toml`: the keys that a robot's owner trusts, as people write it and read it.

format = "nondum-trust 1"
owner = "survey"
version = 3
made = "2026-08-01T00:00:00Z"
fleets = ["survey"]

[roots]
threshold = 2
[[roots.key]]
name = "alice"
key = "ssh-ed25519 AAAA…"

[[key]]
name = "acme-release"
key = "ssh-ed25519 AAAA…"
until = "2028-01-01T00:00:00Z"

[[role]]
name = "acme"
payloads = ["com.acme"]
keys = ["acme-release"]
permissions = ["network"]

[[revoked]]
fingerprint = "SHA256:…"
why = "lost"
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from datetime import UTC, datetime

from nondum.sdk.errors import PayloadRefused, Problem, TrustRefused
from nondum.wheelhouse.format import limits, names, tables
from nondum.wheelhouse.format.manifest import GRANTABLE
from nondum.wheelhouse.format.tables import Form, Table
from nondum.wheelhouse.trust.public_key import FINGERPRINT, PublicKey, parse_line
from nondum.wheelhouse.trust.trust import ANY, Bounds, Revocation, Role, Roots, Trust, TrustedKey
from nondum.wheelhouse.trust.wire import Malformed

NAME = "trust.toml"
FORMAT = "nondum-trust 1"
MAX_BYTES = tables.MAX_BYTES
MAX_VERSION = 99_999_999
MAX_RELEASE = 2**53

_FORMAT = Form(re.compile(re.escape(FORMAT)), f"{FORMAT!r}, which this nondum knows")
_NAME = Form(
    re.compile(r"[a-z0-9]+([-_.][a-z0-9]+)*"), "a name of lower-case letters, digits, -, _ and ."
)
_FLEET = re.compile(r"[a-z0-9.-]{1,64}")
_TIME = Form(
    re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ"), "a time (UTC) like 2026-08-01T00:00:00Z"
)
_PAYLOAD_ID = Form(names.PAYLOAD_ID, "a payload's id like org.example.blinker")
_FINGERPRINT = Form(FINGERPRINT, "a fingerprint like SHA256:…, of 43 characters")
_PREFIX = re.compile(r"[a-z0-9][a-z0-9-]*(\.[a-z0-9][a-z0-9-]*)*")


def parse(text: str, where: str) -> Trust:
    """Check and parse a trust file. Raises `TrustRefused` (TRUST_TOML, TRUST_KEY, TRUST_VALUE,
    TRUST_TWICE, TOO_LARGE) with everything wrong in it."""
    try:
        return _parse(text, where)
    except PayloadRefused as refused:
        fix = "correct it there, and have the roots sign it again: `nondum keys sign FILE`"
        told = (replace(problem, fix=problem.fix or fix) for problem in refused.problems)
        raise TrustRefused(*told) from refused


def parse_bytes(data: bytes, where: str) -> Trust:
    """The same of bytes. Raises `TrustRefused`."""
    try:
        return parse(data.decode("utf-8"), where)
    except UnicodeDecodeError as error:
        told = f"byte {error.start} is not UTF-8"
        problem = Problem("NOT_UTF8", told, where=where, fix="have the trust file copied again")
        raise TrustRefused(problem) from error


def moment(text: str) -> datetime:
    """A time as the file has it. Raises `ValueError`.

    >>> moment("2026-08-01T00:00:00Z")
    datetime.datetime(2026, 8, 1, 0, 0, tzinfo=datetime.timezone.utc)
    """
    return datetime.strptime(text, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=UTC)


def _parse(text: str, where: str) -> Trust:
    root, report = tables.read(text, "TRUST", where)
    root.text("format", _FORMAT)
    trust = Trust(
        owner=root.text("owner", _NAME),
        version=_whole(root, "version", 0, 1, MAX_VERSION),
        made=_time(root, "made") or datetime.min.replace(tzinfo=UTC),
        roots=_roots(root.table("roots")),
        fleets=_texts(root, "fleets", _FLEET.fullmatch, "a fleet's name"),
        keys=tuple(_key(table) for table in root.tables("key")),
        roles=tuple(_role(table) for table in root.tables("role")),
        revoked=tuple(_revoked(table) for table in root.tables("revoked")),
        bounds=tuple(_bounds(table) for table in root.tables("release")),
    )
    root.close()
    for kind, name, message, fix in _contradictions(trust):
        report.add(kind, message, _last_line(report.text, name), fix)
    report.raise_if_any()
    return trust


def _roots(table: Table) -> Roots:
    keys = tuple(_root(key) for key in table.tables("key", required=True))
    roots = Roots(keys, _whole(table, "threshold", 1, 1, max(1, len(keys))))
    table.close()
    return roots


def _root(table: Table) -> TrustedKey:
    known = TrustedKey(table.text("name", _NAME), _public(table))
    table.close()
    return known


def _key(table: Table) -> TrustedKey:
    known = TrustedKey(
        table.text("name", _NAME), _public(table), _time(table, "since"), _time(table, "until")
    )
    if known.since is not None and known.until is not None and known.since >= known.until:
        table.wrong("until", "it ends before it begins", "`until` is later than `since`")
    table.close()
    return known


def _role(table: Table) -> Role:
    name = table.text("name", _NAME)
    keys = _required(table, "keys", "names of keys")
    role = Role(
        name=name,
        payloads=_texts(table, "payloads", _is_prefix, f"the beginning of ids, or {ANY!r}"),
        keys=keys,
        threshold=_whole(table, "threshold", 1, 1, max(1, len(set(keys)))),
        permissions=_texts(
            table,
            "permissions",
            lambda one: one == ANY or one in GRANTABLE,
            f"one of {', '.join(GRANTABLE)} and {ANY!r}",
        ),
        most=limits.parse(table.optional_table("most")),
    )
    if not role.payloads:
        table.wrong("payloads", "is missing or empty", f'payloads = ["org.example"], or ["{ANY}"]')
    table.close()
    return role


def _revoked(table: Table) -> Revocation:
    gone = Revocation(table.text("fingerprint", _FINGERPRINT), table.text("why", default=""))
    table.close()
    return gone


def _bounds(table: Table) -> Bounds:
    payload = table.text("payload", _PAYLOAD_ID)
    least = _whole(table, "least", 0, 0, MAX_RELEASE)
    most = _whole(table, "most", MAX_RELEASE, 0, MAX_RELEASE)
    if least > most:
        table.wrong("least", "is above `most`, so that no release could come in")
    table.close()
    return Bounds(payload, least, most if most < MAX_RELEASE else None)


def _public(table: Table) -> PublicKey:
    line = table.text("key")
    try:
        return parse_line(line)[0]
    except Malformed as flaw:
        if line:  # what is missing has been told
            fix = "copy the line of a .pub file that `nondum keys new` or ssh-keygen made"
            table.wrong("key", f"is no public key: {flaw}", fix)
    return PublicKey("", b"")


def _time(table: Table, key: str) -> datetime | None:
    """A time; a trust file's own, `made`, must be there."""
    text = table.text(key, _TIME, default=None if key == "made" else "0000-00-00T00:00:00Z")
    if not text or text.startswith("0000"):
        return None
    try:
        return moment(text)
    except ValueError:
        table.wrong(key, f"{text!r} is not {_TIME.words}")
        return None


def _whole(table: Table, key: str, default: int, least: int, most: int) -> int:
    number = table.integer(key, default)
    if not least <= number <= most:
        table.wrong(key, f"{number} is not a whole number from {least} to {most}")
        return max(least, min(number, most))
    return number


def _required(table: Table, key: str, what: str) -> tuple[str, ...]:
    found = _texts(table, key, _NAME.pattern.fullmatch, _NAME.words)
    if not found:
        table.wrong(key, "is missing or empty", f"a list of {what}")
    return found


def _texts(table: Table, key: str, is_good: Callable[[str], object], words: str) -> tuple[str, ...]:
    found = table.texts(key)
    for one in found:
        if not is_good(one):
            table.wrong(key, f"{one[:60]!r} is not {words}")
    return found


def _is_prefix(text: str) -> bool:
    return text == ANY or (len(text) <= names.MAX_PATH and bool(_PREFIX.fullmatch(text)))


def _contradictions(trust: Trust) -> Iterator[tuple[str, str, str, str]]:
    """Kind, name, message and remedy of what the parts of a file say against one another. The name
    is a text of the file."""
    for what, known in (("root", trust.roots.keys), ("key", trust.keys)):
        yield from _twice(what, (one.name for one in known))
        points = {one.key.point.hex(): one.name for one in known}
        for again in _repeated(one.key.point.hex() for one in known if one.name):
            fix = "a person with two names would count twice: keep one of them"
            name = points[again]
            yield "TWICE", name, f"the key of {name!r} stands twice", fix
    yield from _twice("role", (role.name for role in trust.roles))
    yield from _twice("bound for releases of", (bounds.payload for bounds in trust.bounds))
    yield from _twice("revocation of", (gone.fingerprint for gone in trust.revoked))
    named = {known.name for known in trust.keys}
    for role in trust.roles:
        for unknown in sorted({*role.keys} - named):
            fix = f"known: {', '.join(sorted(named)) or 'none'}"
            message = f"role {role.name!r} names a key {unknown!r} that is not there"
            yield "VALUE", unknown, message, fix
        yield from _twice(f"key of role {role.name!r}:", role.keys)
    gone = {revocation.fingerprint for revocation in trust.revoked}
    for root in trust.roots.keys:
        if root.key.point and root.key.fingerprint in gone:
            fix = "take it out of [[roots.key]], or out of [[revoked]]"
            yield "VALUE", root.name, f"the root {root.name!r} is revoked", fix


def _twice(what: str, known: Iterable[str]) -> Iterator[tuple[str, str, str, str]]:
    for again in _repeated(known):
        yield "TWICE", again, f"{what} {again!r} stands twice", "keep one of them"


def _repeated(known: Iterable[str]) -> list[str]:
    return [one for one, count in Counter(known).items() if one and count > 1]


def _last_line(text: str, name: str) -> int | None:
    """The number of the last line that has a name in it. None for a name that was refused."""
    numbered = enumerate(text.splitlines(), start=1)
    return next((n for n, line in reversed(list(numbered)) if name and name in line), None)
