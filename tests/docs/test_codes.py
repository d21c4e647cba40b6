"""Every code that a person may meet is in the reference, and no other."""

from __future__ import annotations

import re

from tests.docs.codes import all_told
from tests.docs.reference import DOCS, MARK


def test_documented_codes_are_those_that_are_given() -> None:
    written = (DOCS / "codes.md").read_text(encoding="utf-8").partition(MARK)[2]
    documented = set(re.findall(r"^\| `([A-Z0-9_]+)` ", written, re.MULTILINE))
    given = {told.code for told in all_told()}
    assert documented == given, "run: python -m tests.docs.reference"


def test_words_and_remedies_are_found() -> None:
    told = {found.code: found for found in all_told()}
    assert told["ROLLBACK"].words == "an older release than was active here before"
    assert told["ROLLBACK"].remedy == "plug in the newer release"
    assert told["CHILD_STALLED"].words == "…: nothing was heard for … s"
