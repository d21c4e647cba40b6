"""Every code that a person may meet is declared once, with what to do; and no other is."""

from __future__ import annotations

import re
from collections import Counter

from tests.docs.codes import NO_CODES, PUT_TOGETHER, TABLE, all_told, mentioned
from tests.docs.reference import DOCS, MARK

from nondum.sdk import codes
from nondum.sdk.codes.former import FORMER
from nondum.sdk.errors import Problem

HOW = f"""
Declare each in the module of its area in {TABLE}/, like the others there:

    Code(
        "WHEEL_BOMB",
        "The wheel would unpack to far more than any honest one.",   # what it means, one sentence
        "get the payload from somebody you trust",                   # what a person can do
    ),
"""


def test_every_code_that_is_told_is_declared() -> None:
    told = {found.code: found.path for found in all_told()} | dict(mentioned())
    unknown = {code: told[code] for code in told.keys() - codes.every().keys() - NO_CODES}
    assert not unknown, f"""codes that no table declares: {unknown}
{HOW}
(A string that only looks like a code belongs into NO_CODES in tests/docs/codes.py.)"""


def test_every_code_that_is_declared_is_told() -> None:
    told = {found.code for found in all_told()} | mentioned().keys() | PUT_TOGETHER
    unused = codes.every().keys() - told
    assert not unused, f"nothing tells these any more: take them out of {TABLE}/: {unused}"


def test_every_former_name_leads_to_a_code() -> None:
    lost = {former: name for former, name in FORMER.items() if name not in codes.every()}
    assert not lost, "`nondum explain` finds nothing for these"


def test_every_code_is_declared_once() -> None:
    names = Counter(code.name for declared in codes.areas().values() for code in declared)
    assert {name for name, count in names.items() if count > 1} == set()


def test_every_code_says_what_it_means_and_what_to_do() -> None:
    for code in codes.every().values():
        assert code.meaning.endswith("."), f"{code.name}: its meaning is a sentence"
        assert len(code.remedy) > 4 and not code.remedy.endswith("."), (
            f"{code.name}: {code.remedy!r}"
        )


def test_documented_codes_are_those_that_are_declared() -> None:
    written = (DOCS / "codes.md").read_text(encoding="utf-8").partition(MARK)[2]
    documented = set(re.findall(r"^\| `([A-Z0-9_-]+)` ", written, re.MULTILINE))
    assert documented == codes.every().keys(), "run: python -m tests.docs.reference"


def test_words_and_remedies_are_found() -> None:
    told = {found.code: found for found in all_told()}
    assert told["DEVELOPMENT_LOOPBACK"].words == "without keys, peers may be on this machine only"
    assert told["DEVELOPMENT_LOOPBACK"].remedy == "use 127.0.0.1, or give the host keys"
    assert told["CHILD_STALLED"].words == "…: nothing was heard for … s"


def test_problem_that_says_no_remedy_tells_the_declared_one() -> None:
    assert Problem("GOAL_TOO_EARLY", "not yet").fix == "ask again in a second"
    assert Problem("GOAL_TOO_EARLY", "not yet", fix="wait").fix == "wait"
    assert Problem("WHY_NO_ACTION", "nothing makes (lit hall) true").fix == ""
    assert Problem("OF_ANOTHER_VERSION", "who knows").fix == ""
