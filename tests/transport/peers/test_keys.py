"""Keys, certificates, trust, and the files that they are kept in."""

from __future__ import annotations

import base64
import errno
import json
import os
import resource
import stat
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from zmq.utils import z85

from nondum.transport.peers import (
    HostKeys,
    PeerRefused,
    Trust,
    fingerprint,
    load_or_create,
    private_file,
    trust_file,
)
from nondum.transport.peers import certificate as certificates
from nondum.transport.peers.certificate import (
    Certificate,
    FleetKey,
    issue,
    new_fleet,
    parse,
    verify,
)
from nondum.transport.peers.keys import PeerKey, parse_key
from nondum.transport.peers.trust import TrustState

NOW = datetime(2026, 6, 1, tzinfo=UTC)
FLEET, SECRET = new_fleet()
KEYS, OTHERS = HostKeys.generate(), HostKeys.generate()


def issued(**changes: object) -> Certificate:
    given_ = {
        "host": "rover-1",
        "key": KEYS.public,
        "not_before": NOW - timedelta(days=1),
        "not_after": NOW + timedelta(days=30),
        **changes,
    }
    return issue(SECRET, **given_)  # type: ignore[arg-type]  # by name, of the types above


def test_keys_are_made_once_and_kept_private(tmp_path: Path) -> None:
    path = tmp_path / "host.key"
    pair = load_or_create(path)
    assert load_or_create(path) == pair
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert [p.name for p in tmp_path.iterdir()] == ["host.key"]
    assert pair.secret not in repr(pair)


def test_no_public_key_looks_like_an_option_on_a_command_line() -> None:
    made = [HostKeys.generate().public for _ in range(1000)]
    assert not [key for key in made if key.startswith("-")]


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660])
def test_key_file_readable_by_other_users_is_refused(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "host.key"
    load_or_create(path)
    path.chmod(mode)
    with pytest.raises(PeerRefused, match="FILE_OPEN_TO_OTHERS"):
        load_or_create(path)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "FILE_MALFORMED"),
        ("nondum-host-key@2 a b", "FILE_MALFORMED"),
        ("nondum-host-key@1 a b", "KEY_MALFORMED"),
        (f"nondum-host-key@1 {KEYS.public} {OTHERS.secret}", "KEY_MALFORMED"),
    ],
    ids=["empty", "version", "no keys", "not a pair"],
)
def test_malformed_key_file_is_refused(tmp_path: Path, text: str, code: str) -> None:
    path = tmp_path / "host.key"
    private_file.create(path, text)
    with pytest.raises(PeerRefused, match=code):
        load_or_create(path)


def test_new_file_never_replaces_one(tmp_path: Path) -> None:
    path = tmp_path / "secret"
    private_file.create(path, "first")
    with pytest.raises(FileExistsError):
        private_file.create(path, "second")
    assert path.read_text(encoding="utf-8") == "first"
    assert [found.name for found in tmp_path.iterdir()] == ["secret"]


@pytest.mark.parametrize("write", [private_file.create, private_file.replace])
def test_file_that_cannot_be_written_leaves_nothing_behind(
    tmp_path: Path, write: Callable[[Path, str], None]
) -> None:
    """As on a full disk: a file may have no more than some bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, hard))
    try:
        with pytest.raises(OSError, match=os.strerror(errno.EFBIG)):
            write(tmp_path / "trust", "x" * 100)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())


def test_file_that_cannot_take_its_place_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "trust").mkdir()
    with pytest.raises(IsADirectoryError):
        private_file.replace(tmp_path / "trust", "text")
    assert [found.name for found in tmp_path.iterdir()] == ["trust"]


@given(st.text(max_size=60))
def test_any_text_is_a_key_in_its_one_form_or_refused(text: str) -> None:
    try:
        assert parse_key(text) == text
    except PeerRefused as refused:
        assert refused.code == "KEY_MALFORMED"


def test_key_beyond_its_range_is_refused() -> None:
    """Z85 groups above 2**32 would otherwise be a second text for another key."""
    with pytest.raises(PeerRefused, match="KEY_MALFORMED"):
        parse_key("#" * 40)


def test_longer_text_than_a_key_is_refused() -> None:
    with pytest.raises(PeerRefused, match="KEY_MALFORMED"):
        parse_key(KEYS.public + "00000")


def test_key_has_one_text_whatever_the_reader_of_z85_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Some readers let groups beyond 2**32 wrap around: another text for the same key."""
    decode = z85.decode
    monkeypatch.setattr(z85, "decode", lambda text: decode(text.replace("#", "0")))
    with pytest.raises(PeerRefused, match="KEY_MALFORMED"):
        parse_key("#" * 40)


def test_fingerprints_differ_and_have_a_hundred_bits() -> None:
    assert fingerprint(KEYS.public) != fingerprint(OTHERS.public)
    assert len(fingerprint(KEYS.public).replace("-", "")) * 5 == 100


def test_certificate_survives_its_file() -> None:
    found = issued()
    assert parse(found.to_bytes()) == found
    verify(found, {FLEET}, NOW)


@given(st.data())
def test_certificate_with_any_byte_changed_is_refused(data: st.DataObject) -> None:
    form = bytearray(issued().to_bytes())
    place = data.draw(st.integers(0, len(form) - 1))
    form[place] = data.draw(st.integers(0, 255).filter(lambda byte: byte != form[place]))
    with pytest.raises(PeerRefused):
        verify(parse(bytes(form)), {FLEET}, NOW)


@given(st.binary(max_size=300))
def test_any_bytes_are_a_certificate_or_refused(data: bytes) -> None:
    with pytest.raises(PeerRefused):
        parse(data)


def test_certificate_has_one_form() -> None:
    form = issued().to_bytes()
    padded = _other_base64(form.removesuffix(b"\n")) + b"\n"
    short = form.replace(b"not-before: 2026-05-31T00", b"not-before: 2026-5-31T0")
    assert short != form
    others = (form + b"\n", form.replace(b"\n", b"\r\n"), form[:-1], b" " + form, padded, short)
    for other in others:
        with pytest.raises(PeerRefused, match="CERTIFICATE_MALFORMED"):
            parse(other)


def _other_base64(text: bytes) -> bytes:
    """The same bytes, written otherwise: bits that fill the last letter are not looked at."""
    letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
    assert text.endswith(b"==")
    last = letters[letters.index(text[-3]) + 1]
    return text[:-3] + bytes([last]) + b"=="


def test_fleet_that_is_not_trusted_is_named() -> None:
    other, _ = new_fleet()
    with pytest.raises(PeerRefused, match="CERTIFICATE_FLEET") as refused:
        verify(issued(), {other}, NOW)
    assert refused.value.problems[0].have == FLEET


def test_certificate_signed_by_another_than_it_says_is_refused() -> None:
    _, forger = new_fleet()
    forged = issue(forger, "rover-1", KEYS.public, not_before=NOW, not_after=NOW + timedelta(1))
    claimed = Certificate(
        FLEET, forged.host, forged.key, forged.not_before, forged.not_after, forged.signature
    )
    with pytest.raises(PeerRefused, match="CERTIFICATE_SIGNATURE"):
        verify(claimed, {FLEET}, NOW)


@pytest.mark.parametrize(("days", "is_valid"), [(-2, False), (-1, True), (30, True), (31, False)])
def test_certificate_holds_between_its_times(days: int, is_valid: bool) -> None:
    found = issued()
    if is_valid:
        verify(found, {FLEET}, NOW + timedelta(days=days))
    else:
        with pytest.raises(PeerRefused, match="CERTIFICATE_TIME"):
            verify(found, {FLEET}, NOW + timedelta(days=days))


def test_clocks_may_be_apart_a_little() -> None:
    skew = timedelta(seconds=certificates.SKEW_S - 1)
    verify(issued(not_before=NOW + skew), {FLEET}, NOW)


@pytest.mark.parametrize("name", ["", "Rover", "rover_1", "-rover", "r" * 64, "a.b", "rover\n"])
def test_name_that_is_no_hosts_is_refused(name: str) -> None:
    with pytest.raises(PeerRefused, match="HOST_NAME"):
        issued(host=name)


def test_certificate_that_ends_before_it_begins_is_refused() -> None:
    with pytest.raises(PeerRefused, match="CERTIFICATE_VALIDITY"):
        issued(not_after=NOW - timedelta(days=2))


def test_name_in_a_certificate_that_is_no_hosts_is_refused() -> None:
    """Even if the fleet has signed it."""
    for odd, code in (
        (replace(issued(), host="Rover"), "HOST_NAME"),
        (replace(issued(), not_after=NOW - timedelta(days=2)), "CERTIFICATE_VALIDITY"),
    ):
        with pytest.raises(PeerRefused, match=code):
            parse(odd.to_bytes())


@pytest.mark.parametrize("fleet", ["AAAA", "no base64"])
def test_fleet_key_that_is_none_has_signed_nothing(fleet: str) -> None:
    odd = replace(issued(), fleet=FleetKey(fleet))
    with pytest.raises(PeerRefused, match="CERTIFICATE_SIGNATURE"):
        verify(odd, {FleetKey(fleet)}, NOW)


def test_certificate_of_another_key_is_refused() -> None:
    trust = Trust().with_fleet(FLEET, "survey")
    assert trust.admit(KEYS.public, issued().to_bytes(), NOW).name == "rover-1"
    with pytest.raises(PeerRefused, match="CERTIFICATE_KEY"):
        trust.admit(OTHERS.public, issued().to_bytes(), NOW)
    with pytest.raises(PeerRefused, match="CERTIFICATE_TIME"):
        trust.admit(KEYS.public, issued().to_bytes(), NOW + timedelta(days=60))
    for either in (trust, Trust()):
        with pytest.raises(PeerRefused, match="KEY_UNKNOWN"):
            either.admit(KEYS.public, b"", NOW)
    with pytest.raises(PeerRefused, match="KEY_UNKNOWN"):
        Trust().admit(KEYS.public, issued().to_bytes(), NOW)


def test_revoked_key_is_out_however_it_came_in() -> None:
    trust = Trust().with_fleet(FLEET, "survey").with_paired(KEYS.public, "rover")
    revoked = trust.with_revoked(KEYS.public, "stolen")
    assert revoked.state_of(KEYS.public) is TrustState.REVOKED
    with pytest.raises(PeerRefused, match="stolen"):
        revoked.admit(KEYS.public, issued().to_bytes(), NOW)
    with pytest.raises(PeerRefused, match="KEY_REVOKED"):
        revoked.with_paired(KEYS.public, "rover")


def test_trust_survives_its_file(tmp_path: Path) -> None:
    trust = (
        Trust()
        .with_fleet(FLEET, "survey")
        .with_paired(KEYS.public, "röver")
        .with_revoked(OTHERS.public, "lost")
    )
    path = tmp_path / "peers" / "trust.json"
    assert trust_file.load(path) == Trust()
    trust_file.save(path, trust)
    assert trust_file.load(path) == trust
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_trust_file_writable_by_other_users_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trust.json"
    trust_file.save(path, Trust())
    path.chmod(0o666)
    with pytest.raises(PeerRefused, match="FILE_OPEN_TO_OTHERS"):
        trust_file.load(path)


@given(st.text() | st.recursive(st.none() | st.text(), st.lists).map(str))
def test_any_text_is_trust_or_refused(text: str) -> None:
    with pytest.raises(PeerRefused, match="FILE_MALFORMED"):
        trust_file.parse(text)


WHOLE = {"format": "nondum-trust@1", "fleets": {}, "paired": {}, "revoked": {}}


@pytest.mark.parametrize(
    ("data", "code"),
    [
        ([], "FILE_MALFORMED"),
        ({key: WHOLE[key] for key in ("format", "fleets", "paired")}, "FILE_MALFORMED"),
        ({**WHOLE, "more": {}}, "FILE_MALFORMED"),
        ({**WHOLE, "format": "nondum-trust@2"}, "FILE_MALFORMED"),
        ({**WHOLE, "paired": []}, "FILE_MALFORMED"),
        ({**WHOLE, "revoked": {KEYS.public: 7}}, "FILE_MALFORMED"),
        ({**WHOLE, "paired": {"key": "rover"}}, "KEY_MALFORMED"),
    ],
)
def test_almost_a_trust_file_is_refused(data: object, code: str) -> None:
    assert trust_file.parse(json.dumps(WHOLE)) == Trust()
    with pytest.raises(PeerRefused) as refused:
        trust_file.parse(json.dumps(data))
    assert refused.value.code == code


@pytest.mark.skipif(os.geteuid() != 0, reason="giving files away needs root")
def test_file_of_another_user_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trust.json"
    trust_file.save(path, Trust())
    os.chown(path, 65534, -1)
    with pytest.raises(PeerRefused, match="FILE_OPEN_TO_OTHERS"):
        trust_file.load(path)


def test_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trust.json"
    trust_file.save(path, Trust())
    path.write_bytes(b"\xff")
    with pytest.raises(PeerRefused, match="FILE_MALFORMED"):
        trust_file.load(path)


def test_fleet_keys_are_ed25519() -> None:
    assert len(base64.b64decode(FLEET)) == len(SECRET) == 32
    assert PeerKey(KEYS.public) == KEYS.public
