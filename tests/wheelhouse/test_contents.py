"""The contents list: the same value through its bytes, and everything wrong told at once."""

from __future__ import annotations

import hashlib
import string

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.contents import Contents, Entry

SHA = "a" * 64
DIGITS = "9" * 5_000
"""More than Python makes a number of."""
PLAIN = (
    "nondum-payload 1\nid: org.example.blinker\nversion: 1.0\nrelease: 7\nfleet:\n"
    "minimum-nondum: 0.1\nbuilt: 2026-01-01T00:00:00Z\n\n"
    f"{SHA}  12  index.json\n{SHA}  3  wheels/a-1-py3-none-any.whl\n"
)


def codes(data: bytes | str) -> list[str]:
    raw = data.encode() if isinstance(data, str) else data
    with pytest.raises(PayloadRefused) as refused:
        contents.parse(raw, "CONTENTS")
    return [problem.code for problem in refused.value.problems]


WORD = st.from_regex(r"[a-z0-9][a-z0-9-]{0,9}", fullmatch=True)
LISTS = st.builds(
    Contents,
    payload_id=st.lists(WORD, min_size=2, max_size=5).map(".".join),
    version=st.sampled_from(["1", "1.0", "2.0rc1", "1!3.post4+local"]),
    release=st.integers(0, contents.MAX_RELEASE),
    fleet=st.text(f"{string.ascii_lowercase}{string.digits}.-", max_size=64),
    minimum_nondum=st.just("0.1"),
    built=st.just("2026-01-01T00:00:00Z"),
    hosts=st.lists(st.from_regex(r"[a-z0-9]{1,9}", fullmatch=True), max_size=3).map(tuple),
    entries=st.lists(
        st.builds(
            Entry,
            sha256=st.text("0123456789abcdef", min_size=64, max_size=64),
            size=st.integers(0, contents.MAX_FILE_BYTES),
            path=st.from_regex(r"[a-z0-9]{1,8}(/[a-z0-9]{1,8}){0,3}", fullmatch=True),
        ),
        unique_by=lambda entry: entry.path,
    ).map(lambda entries: tuple(sorted(entries, key=lambda entry: entry.path))),
)


@given(LISTS)
def test_a_list_survives_its_bytes(listed: Contents) -> None:
    assert contents.parse(listed.to_bytes(), "CONTENTS") == listed
    assert listed.digest == hashlib.sha256(listed.to_bytes()).hexdigest()


@given(st.binary(max_size=600))
def test_noise_is_refused_and_nothing_else_raised(noise: bytes) -> None:
    for data in (noise, PLAIN.encode() + noise):
        try:
            listed = contents.parse(data, "CONTENTS")
        except PayloadRefused:
            continue
        assert contents.parse(listed.to_bytes(), "again") == listed


@given(LISTS, st.data())
def test_one_list_has_one_form(listed: Contents, data: st.DataObject) -> None:
    lines = listed.to_bytes().decode().split("\n")
    end = lines.index("")
    headers = data.draw(st.permutations(lines[1:end]))
    other = "\n".join([lines[0], *headers, *lines[end:]]).encode()
    if other == listed.to_bytes():
        assert contents.parse(other, "CONTENTS") == listed
    else:
        assert {*codes(other)} == {"CONTENTS_HEADER"}


@given(st.integers(0, len(PLAIN) - 1), st.characters(codec="latin-1"))
@example(PLAIN.index(" 1.0"), "\r")
def test_a_changed_byte_never_passes_unnoticed(at: int, byte: str) -> None:
    changed = PLAIN[:at] + byte + PLAIN[at + 1 :]
    try:
        listed = contents.parse(changed.encode("latin-1"), "CONTENTS")
    except PayloadRefused:
        return
    assert (listed.to_bytes() == PLAIN.encode()) == (changed == PLAIN)


def test_a_plain_list_is_read() -> None:
    listed = contents.parse(PLAIN.encode(), "CONTENTS")
    assert (listed.payload_id, listed.release, listed.fleet) == ("org.example.blinker", 7, "")
    assert listed.total_bytes == 15
    assert listed.to_bytes() == PLAIN.encode()


REFUSED = {
    "not-ascii": ("CONTENTS_ENCODING", PLAIN.replace("index", "indéx")),
    "empty": ("SCHEMA_VERSION", ""),
    "byte-order-mark": ("CONTENTS_ENCODING", "\ufeff" + PLAIN),
    "other-format": ("SCHEMA_VERSION", PLAIN.replace("payload 1", "payload 2")),
    "unknown-header": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet:\ncolour: red")),
    "header-twice": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet:\nfleet: other")),
    "header-missing": ("CONTENTS_HEADER", PLAIN.replace("release: 7\n", "")),
    "no-colon": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet")),
    "id-upper-case": ("CONTENTS_HEADER", PLAIN.replace("blinker\n", "Blinker\n")),
    "id-not-reverse-dns": ("CONTENTS_HEADER", PLAIN.replace("org.example.", "")),
    "version": ("CONTENTS_HEADER", PLAIN.replace("version: 1.0", "version: newest")),
    "version-long": ("CONTENTS_HEADER", PLAIN.replace("version: 1.0", f"version: 1.{'0' * 249}")),
    "version-without-end": ("CONTENTS_HEADER", PLAIN.replace("version: 1.0", f"version: {DIGITS}")),
    "nondum-without-end": ("CONTENTS_HEADER", PLAIN.replace("0.1", DIGITS)),
    "order": ("CONTENTS_HEADER", PLAIN.replace("release: 7\nfleet:\n", "fleet:\nrelease: 7\n")),
    "hosts-at-the-end": ("CONTENTS_HEADER", PLAIN.replace("00Z\n", "00Z\nhosts: spot\n")),
    "release-negative": ("CONTENTS_HEADER", PLAIN.replace("release: 7", "release: -7")),
    "release-jump": ("CONTENTS_HEADER", PLAIN.replace("release: 7", f"release: {2**53 + 1}")),
    "release-without-end": ("CONTENTS_HEADER", PLAIN.replace("release: 7", f"release: {2**62}")),
    "release-leading-zero": ("CONTENTS_HEADER", PLAIN.replace("release: 7", "release: 07")),
    "release-digits-elsewhere": ("CONTENTS_ENCODING", PLAIN.replace("release: 7", "release: ٧")),
    "fleet": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet: a b")),
    "hosts-none": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet:\nhosts:")),
    "hosts-many": ("CONTENTS_HEADER", PLAIN.replace("fleet:", f"fleet:\nhosts:{' a' * 65}")),
    "hosts-oddly-called": ("CONTENTS_HEADER", PLAIN.replace("fleet:", "fleet:\nhosts: a_b")),
    "built": ("CONTENTS_HEADER", PLAIN.replace("00Z", "00")),
    "built-on-no-day": ("CONTENTS_HEADER", PLAIN.replace("2026-01-01", "2026-02-31")),
    "entry-short-hash": ("CONTENTS_ENTRY", PLAIN.replace(f"{SHA}  12", f"{SHA[1:]}  12")),
    "entry-upper-hash": ("CONTENTS_ENTRY", PLAIN.replace(f"{SHA}  12", f"{SHA.upper()}  12")),
    "entry-size": ("CONTENTS_ENTRY", PLAIN.replace("  12  ", "  012  ")),
    "entry-one-space": ("CONTENTS_ENTRY", PLAIN.replace("  12  ", " 12 ")),
    "entry-cut-off": ("CONTENTS_ENTRY", PLAIN.removesuffix("\n")),
    "entry-carriage-return": ("CONTENTS_ENTRY", PLAIN.replace(".json\n", ".json\r\n")),
    "entries-unsorted": ("CONTENTS_ENTRY", PLAIN.replace("index.json", "z.json")),
    "lists-itself": ("CONTENTS_ENTRY", PLAIN.replace("index.json", "CONTENTS")),
    "lists-signature": ("CONTENTS_ENTRY", PLAIN.replace("index.json", "CONTENTS.sig")),
    "path-up": ("PATH_UNSAFE", PLAIN.replace("index.json", "../index.json")),
    "path-inner-up": ("PATH_UNSAFE", PLAIN.replace("index.json", "a/../../index.json")),
    "path-absolute": ("PATH_UNSAFE", PLAIN.replace("index.json", "/etc/passwd")),
    "path-backslash": ("PATH_UNSAFE", PLAIN.replace("index.json", "a\\b")),
    "path-doubled-slash": ("PATH_UNSAFE", PLAIN.replace("index.json", "a//b")),
    "path-dot": ("PATH_UNSAFE", PLAIN.replace("index.json", "./a")),
    "path-long": ("PATH_UNSAFE", PLAIN.replace("index.json", "a" * 256)),
    "path-control": ("PATH_UNSAFE", PLAIN.replace("index.json", "a\x07b")),
    "path-case-pair": (
        "PATH_UNSAFE",
        PLAIN.replace(f"{SHA}  12  index", f"{SHA}  12  INDEX.json\n{SHA}  12  index"),
    ),
    "path-twice": (
        "PATH_UNSAFE",
        PLAIN.replace(f"{SHA}  12  index", f"{SHA}  12  index.json\n{SHA}  12  index"),
    ),
    "file-huge": ("TOO_LARGE", PLAIN.replace("  12  ", f"  {9 * 1024**3}  ")),
    "list-huge": ("TOO_LARGE", PLAIN + "a" * contents.MAX_BYTES),
    "files-many": ("TOO_MANY_FILES", PLAIN + "x\n" * contents.MAX_FILES),
}


@pytest.mark.parametrize(("code", "text"), REFUSED.values(), ids=REFUSED)
def test_a_wrong_list_is_refused(code: str, text: str) -> None:
    assert {*codes(text)} == {code}


def test_everything_wrong_is_told_with_its_line() -> None:
    text = PLAIN.replace("release: 7", "release: x").replace("index.json", "../up")
    with pytest.raises(PayloadRefused) as refused:
        contents.parse(text.encode(), "CONTENTS")
    assert [(p.code, p.where) for p in refused.value.problems] == [
        ("CONTENTS_HEADER", "CONTENTS:4"),
        ("PATH_UNSAFE", "CONTENTS:9"),
    ]


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"\xff" * 300_000, "CONTENTS_ENCODING"),
        (b"nondum-payload", "SCHEMA_VERSION"),
        (b"", "SCHEMA_VERSION"),
    ],
)
def test_what_is_no_list_is_told_by_its_first_bytes(data: bytes, code: str) -> None:
    flaw = contents.begins_wrong(data, "CONTENTS")
    assert flaw is not None
    assert (flaw.code, flaw.where) == (code, "CONTENTS")
    assert flaw.fix


@pytest.mark.parametrize("data", [PLAIN.encode(), b"nondum-payload 2\n", b"nondum-payload \xff"])
def test_what_may_be_a_list_is_left_to_its_parser(data: bytes) -> None:
    assert contents.begins_wrong(data, "CONTENTS") is None
