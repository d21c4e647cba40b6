"""Which payload would help: asked of a real host, and of none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from demo.robot import View
from tests.daemon.plugins import gauge, scribe, talker
from tests.kit.beacon import BEACON, BEACON_ID
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import RunningHost

from nondum.cli.mind import GLANCES
from nondum.wheelhouse.format.lock import file_name

WRITTEN = "(written self)"


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive with three payloads that no host has seen."""
    drive = tmp_path_factory.mktemp("shelf")
    make_payload(drive, scribe(), payload_id="org.example.write")
    make_payload(drive, talker("left"), payload_id="org.example.left")
    make_payload(drive, talker("right"), payload_id="org.example.right", version="2.0")
    return drive


def test_payloads_that_help_together_are_told_with_their_plan(shelf: Path) -> None:
    shown = nondum("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", shelf).ok().out
    folder = shelf / "nondum"
    rows = [" ".join(line.split()) for line in shown.splitlines()]
    assert rows[0] == "goal (written self)"
    assert "nothing" not in rows[-1]
    plan = "test-left.talk, then test-scribe.write"
    assert f"1 org.example.left 1.0 {folder}/org.example.left {plan}" in rows
    assert f"and org.example.write 1.0 {folder}/org.example.write" in rows
    assert any(row.startswith("2 org.example.right 2.0") for row in rows)


def test_words_that_come_with_what_would_help_are_no_mistake(shelf: Path) -> None:
    asked = ("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", shelf)
    assert "PDDL_UNKNOWN" not in nondum(*asked).ok().out
    assert nondum(*asked, "--json").ok().json["causes"] == []


def test_folder_of_drives_is_looked_through(shelf: Path, tmp_path: Path) -> None:
    (tmp_path / "drives").mkdir()
    (tmp_path / "drives/one").symlink_to(shelf)
    asked = ("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", tmp_path / "drives")
    assert "org.example.write 1.0" in nondum(*asked).ok().out


def test_folder_without_payloads_is_told(tmp_path: Path) -> None:
    asked = ("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", tmp_path)
    nondum(*asked).refused(1, "DRIVE_NOT_PAYLOAD")


def test_advice_in_json_has_whole_plans(shelf: Path) -> None:
    ran = nondum("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", shelf, "--json").ok()
    assert set(ran.json) == {
        "goal",
        "kind",
        "now",
        "causes",
        "ways",
        "complete",
        "known",
        "unfit",
        "unread",
    }
    assert ran.json["complete"]
    left, right = ran.json["ways"]
    assert [row["payload"] for row in left["payloads"]] == ["org.example.left", "org.example.write"]
    assert left["plan"] == [
        "test-left.talk spot__left__mouth spot__left__voice spot",
        "test-scribe.write spot__scribe__pen spot__left__voice spot",
    ]
    assert right["payloads"][0]["version"] == "2.0"


def test_a_folder_of_payload_folders_is_looked_through_too(shelf: Path) -> None:
    ways = nondum(
        "advise", WRITTEN, "--host-of", "spot", "--wheelhouse", shelf / "nondum", "--json"
    ).json["ways"]
    assert len(ways) == 2


def test_nothing_that_helps_is_an_exit_code(shelf: Path, golden: Golden) -> None:
    only = shelf / "nondum" / "org.example.write"
    ran = nondum("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", only)
    assert ran.code == 11
    golden.check_line("nothing gives a text", ran.out)
    golden.check_line("the only payload would not help", ran.out)


def test_goal_that_a_payload_alone_makes_true_is_said_to_hold_then(
    shelf: Path, golden: Golden
) -> None:
    goal = "(exists (?u - sensor) (ready ?u))"
    ran = nondum("advise", goal, "--host-of", "spot", "--wheelhouse", shelf).ok()
    folder = shelf / "nondum/org.example.write"
    golden.check_line("a payload alone makes it true", ran.out, folder=folder)


def test_where_nothing_is_known_it_is_said_how_to_look_further(golden: Golden) -> None:
    ran = nondum("advise", "(exists (?u - camera) (ready ?u))", "--host-of", "spot")
    assert ran.code == 11
    golden.check_line("no payload is known", ran.out)


def test_unknown_words_are_refused(shelf: Path) -> None:
    asked = ("advise", "(wirtten self)", "--host-of", "spot", "--wheelhouse", shelf)
    nondum(*asked).refused(1, "'written'")


def test_words_of_a_payload_on_the_shelf_are_understood(tmp_path: Path) -> None:
    make_payload(tmp_path, Part("beacon", BEACON), payload_id=BEACON_ID)
    found = nondum(
        "advise", "greet", "people", "--host-of", "spot", "--wheelhouse", tmp_path, "--json"
    ).ok()
    assert found.json["goal"] == "(greeted person spot)"
    assert [row["payload"] for row in found.json["ways"][0]["payloads"]] == [BEACON_ID]


def test_payload_for_another_machine_helps_with_a_caveat(tmp_path: Path) -> None:
    part = replace(talker(), tag="cp39-cp39-win32")
    make_payload(tmp_path, part, scribe(), payload_id="org.example.foreign")
    shown = nondum("advise", WRITTEN, "--host-of", "spot", "--wheelhouse", tmp_path).ok().out
    assert "but org.example.foreign 1.0: " in shown
    assert file_name("talker") in shown


def test_payload_that_cannot_be_read_is_named(tmp_path: Path, shelf: Path) -> None:
    folder = make_payload(tmp_path, talker(), payload_id="org.example.broken")
    (folder / "index.json").write_text("{")
    ran = nondum(
        "advise", WRITTEN, "--host-of", "spot", "--wheelhouse", tmp_path, "--wheelhouse", shelf
    )
    assert ran.code == 0
    assert f"warning: INDEX_INVALID {folder}: index.json" in ran.err


BROKEN = """
from nondum.sdk import Fragment, hookimpl

@hookimpl
def fragments():
    return [Fragment("domain.pddl", "(define (domain broken)\\n  (:predicates (written")]
"""


def test_payload_with_wrong_fragments_is_left_out_by_name(tmp_path: Path, shelf: Path) -> None:
    make_payload(tmp_path, Part("broken", BROKEN), payload_id="org.example.broken")
    asked = ("--host-of", "spot", "--wheelhouse", tmp_path, "--wheelhouse", shelf)
    shown = nondum("advise", WRITTEN, *asked).ok().out
    [told] = [line for line in shown.splitlines() if "org.example.broken" in line]
    assert told.startswith("left out: org.example.broken 1.0: ")
    assert "domain.pddl" in told
    found = nondum("advise", WRITTEN, *asked, "--json").ok().json
    [payload] = found["unfit"]
    assert payload["payload"] == "org.example.broken"
    assert len(found["ways"]) == 2


def test_payload_is_of_use_without_its_component_with_wrong_fragments(
    tmp_path: Path,
) -> None:
    parts = (talker(), scribe(), Part("broken", BROKEN))
    make_payload(tmp_path, *parts, payload_id="org.example.half")
    asked = ("--host-of", "spot", "--wheelhouse", tmp_path)
    found = nondum("advise", WRITTEN, *asked, "--json").ok().json
    [way] = found["ways"]
    assert [caveat["where"] for caveat in way["payloads"][0]["caveats"]]
    [left_out] = nondum("advise", "(self spot)", *asked, "--json").ok().json["unfit"]
    assert left_out["payload"] == "org.example.half"


def test_host_that_runs_needs_only_what_it_lacks(
    daemon: RunningHost, shelf: Path, golden: Golden
) -> None:
    ran = daemon.run("advise", "(lit self)").ok()
    golden.check("it can be had now", ran.out)
    ways = daemon.run("advise", WRITTEN, "--wheelhouse", shelf, "--json").ok().json["ways"]
    assert len(ways) == 2


def test_device_that_is_not_plugged_in_is_a_caveat(daemon: RunningHost, tmp_path: Path) -> None:
    make_payload(tmp_path, gauge(), payload_id="org.example.gauge")
    ran = daemon.run("advise", "(measured self)", "--wheelhouse", tmp_path, "--json").ok()
    [way] = ran.json["ways"]
    [caveat] = way["payloads"][0]["caveats"]
    assert caveat["code"] == "DEVICE_MISSING"
    assert caveat["need"] == "ID_MODEL=Gauge"


def test_why_says_what_a_goal_lacks_and_what_would_help(
    daemon: RunningHost, shelf: Path, golden: Golden
) -> None:
    shown = daemon.run("why", "(found person self)", "--wheelhouse", shelf).ok().out
    golden.check("nothing makes it true", "\n".join(shown.splitlines()[:2]))
    golden.check_line("no payload would help", shown)


def test_why_of_everything_says_what_would_help_each_goal(
    daemon: RunningHost, shelf: Path, golden: Golden
) -> None:
    waiting = "(found person self)"
    ids = [daemon.run("goal", "--pddl", waiting, "--json").ok().json["id"] for _ in range(5)]

    def are_suspended(view: View) -> bool:
        return {row["id"] for row in view["goals"] if row["state"] == "suspended"} >= {*ids}

    daemon.until("the goals are suspended", are_suspended)
    shown = daemon.run("why", "--wheelhouse", shelf).ok().out
    advice = daemon.run("why", "--wheelhouse", shelf, "--json").ok().json["advice"]
    daemon.run("halt").ok()
    told = [line for line in shown.splitlines() if line.startswith("goal ") and "advise" in line]
    assert len(told) == len(ids)
    for number, (id, line) in enumerate(zip(ids, told, strict=True)):
        if number < GLANCES:
            golden.check("no payload would help a goal", line, id=id)
        else:
            golden.check("a goal is one of many", line, id=id)
    assert advice[0] == {"goal": ids[0], "now": None, "ways": [], "complete": True}
    assert advice[-1] == {"goal": ids[-1]}


def test_why_of_a_fact_that_holds_explains_the_fact(daemon: RunningHost) -> None:
    shown = daemon.run("why", "(self panther)").ok().out
    assert shown.startswith("(self panther) holds\nfor it: this is the host that plans")


def test_why_of_a_goal_that_is_none_is_refused(daemon: RunningHost) -> None:
    daemon.run("why", "4711").refused(1, "GOAL_UNKNOWN").refused(1, "'4711'")


def test_without_a_daemon_it_is_said_what_to_do(tmp_path: Path) -> None:
    ran = nondum("--control", tmp_path / "none.sock", "advise", WRITTEN)
    ran.refused(4, "--host-of NAME")


def test_refusals_are_told_in_json_too(shelf: Path) -> None:
    ran = nondum("advise", "(wirtten self)", "--host-of", "spot", "--json")
    assert ran.code == 1
    assert json.loads(ran.out)["problems"][0]["code"] == "PDDL_UNKNOWN"
