"""`nondum explain`: every code, for people and for programs."""

from __future__ import annotations

from tests.kit.command_line import nondum
from tests.kit.golden import Golden

from nondum.sdk import codes


def test_a_code_is_explained() -> None:
    said = nondum("explain", "goal_too_early").ok().out
    assert said == (
        "GOAL_TOO_EARLY  (Goals and plans)\n"
        "The host does not know itself yet.\n"
        "  told as: the host does not know itself yet\n"
        "→ ask again in a second\n"
    )


def test_what_is_told_of_a_code_is_quoted(golden: Golden) -> None:
    view = nondum("explain", "DEVELOPMENT_LOOPBACK", "--json").ok().json
    golden.check("what is told of a code", "\n".join(view["told"]))
    assert view.keys() == {"code", "area", "meaning", "told", "causes", "fix"}


def test_an_unknown_code_gets_the_nearest_ones() -> None:
    nondum("explain", "WHEEL_RECROD").refused(2, "WHEEL_RECORD")
    nondum("explain", "zip64").refused(2, "`nondum explain`")


def test_without_a_code_all_are_listed_by_area() -> None:
    lines = nondum("explain").ok().out.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == list(codes.areas())
    assert {line.split()[0] for line in lines if line.startswith(" ")} == codes.every().keys()


def test_all_codes_are_given_to_programs() -> None:
    listed = nondum("explain", "--json").ok().json["codes"]
    assert {row["code"] for row in listed} == codes.every().keys()
    assert all(row["fix"] for row in listed)
