"""`nondum pddl`: files in, answers out, no daemon anywhere."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from pathlib import Path

import pytest
from tests.kit.command_line import (
    Ran,
    at_terminal,
    clean_environment,
    command,
    in_new_interpreter,
    nondum,
)
from tests.kit.descendants import descendants
from tests.kit.endless_problem import ENDLESS, endless
from tests.kit.golden import Golden
from tests.kit.until import PATIENCE_S, until
from tests.planning.differential.texts import TEXTS

ROADS = """(define (domain roads)
  (:predicates (at ?x) (road ?x ?y))
  (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
    :effect (and (at ?y) (not (at ?x)))))
"""
MAP = """(define (problem map) (:domain roads)
  (:objects a b c d)
  (:init (at a) (road a b) (road b c))
  (:goal {goal}))
"""
EYE = """(define (domain eye)
  (:predicates (seen ?c - class ?h - host) (looks ?u - camera))
  (:action look :parameters (?u - camera ?c - class ?h - host)
    :precondition (and (ready ?u) (on ?u ?h)) :effect (seen ?c ?h)))
"""
CLASSES = """(define (problem eye) (:domain eye)
  (:objects person dog - class) (:init (seen person self) (looks left)))
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with a domain, problems of all kinds, and fragments."""
    for name, text in {
        "domain.pddl": ROADS,
        "problem.pddl": MAP.format(goal="(at c)"),
        "here.pddl": MAP.format(goal="(at a)"),
        "cut-off.pddl": MAP.format(goal="(at d)"),
        "either.pddl": MAP.format(goal="(or (at d) (and (at d) (road d a)))"),
        "torn.pddl": MAP.format(goal="(and (at b) (at c))"),
        "wrong.pddl": MAP.format(goal="(att c)"),
        "endless-domain.pddl": ENDLESS,
        "endless.pddl": endless(),
        "eye/domain.pddl": EYE,
        "eye/problem.pddl": CLASSES,
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def pddl(files: Path, *arguments: str) -> Ran:
    """Run `nondum pddl` in the folder."""
    words = [str(files / a) if a.endswith((".pddl", "/")) else a for a in arguments]
    return nondum("pddl", *words, COLUMNS="100")


# plan


def test_a_plan_is_printed_as_the_competitions_write_it(files: Path) -> None:
    lines = pddl(files, "plan", "domain.pddl", "problem.pddl").ok().out.splitlines()
    assert lines[:3] == ["(go a b)", "(go b c)", "; cost = 2 (unit cost)"]
    assert lines[3].startswith("; parse ")
    assert all(phase in lines[3] for phase in ("parse", "ground", "search"))


def test_a_plan_by_one_planner_only(files: Path) -> None:
    ran = pddl(files, "plan", "domain.pddl", "problem.pddl", "--planner", "native", "--json").ok()
    assert ran.json["answer"] == "plan"
    assert ran.json["steps"] == ["go a b", "go b c"]
    assert ran.json["cost"] == 2
    assert ran.json["planner"] == "native"
    assert set(ran.json["seconds"]) == {"parse", "ground", "search"}


def test_a_plan_goes_where_it_is_wanted(files: Path) -> None:
    ran = pddl(files, "plan", "domain.pddl", "problem.pddl", "-o", str(files / "plan"))
    assert ran.ok().out == ""
    assert (files / "plan").read_text().startswith("(go a b)\n(go b c)\n; cost = 2")


def test_costs_are_told_for_what_they_are(files: Path) -> None:
    text = next(text for text in TEXTS if text.name == "costs")
    (files / "costs.pddl").write_text(text.domain)
    (files / "costs-problem.pddl").write_text(text.problem)
    ran = pddl(files, "plan", "costs.pddl", "costs-problem.pddl").ok()
    assert "; cost = 8 (general cost)" in ran.out


def test_what_is_true_already_needs_no_step(files: Path, golden: Golden) -> None:
    ran = pddl(files, "plan", "domain.pddl", "here.pddl").refused(10, "")
    golden.check_line("the goal is true already", ran.err)
    assert ran.out.startswith("; cost = 0 (unit cost)\n")


@pytest.mark.parametrize(
    ("problem", "words", "proof"),
    [
        ("cut-off.pddl", "(at d) cannot be reached", "relaxed"),
        ("either.pddl", "the goal cannot be reached", "relaxed"),
        ("torn.pddl", "looked at all that can be reached", "exhausted"),
    ],
)
def test_what_has_no_plan_is_proved(files: Path, problem: str, words: str, proof: str) -> None:
    assert pddl(files, "plan", "domain.pddl", problem).refused(11, words).out == ""
    ran = pddl(files, "plan", "domain.pddl", problem, "--json")
    assert (ran.code, ran.json["answer"], ran.json["proof"]) == (11, "unsolvable", proof)


def test_who_gives_up_says_so_and_why(files: Path) -> None:
    arguments = ("endless-domain.pddl", "endless.pddl", "--timeout", "0.5")
    pddl(files, "plan", *arguments).refused(12, "")
    ran = pddl(files, "plan", *arguments, "--json")
    assert (ran.code, ran.json["answer"]) == (12, "gave up")
    assert "native" in ran.json["reason"]


def test_a_wrong_file_is_told_with_its_place(files: Path) -> None:
    ran = pddl(files, "plan", "domain.pddl", "wrong.pddl")
    ran.refused(
        2, f"error: PDDL_UNKNOWN {files}/wrong.pddl:4:11: predicate 'att' is not declared\n"
    )
    ran.refused(2, "  (:goal (att c)))\n          ^")
    ran.refused(2, "'at'")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["domain.pddl"], "Missing argument 'PROBLEM'"),
        (["domain.pddl", "nowhere.pddl"], "does not exist"),
        (["domain.pddl", "problem.pddl", "--timeout", "0"], "'--timeout'"),
        (["domain.pddl", "problem.pddl", "--planner", "lpg"], "no planner 'lpg' is installed"),
        (["problem.pddl", "domain.pddl"], "PDDL_KIND"),
    ],
    ids=["no problem", "no file", "no time", "no such planner", "the wrong way round"],
)
def test_wrong_usage_of_plan(files: Path, arguments: list[str], words: str) -> None:
    pddl(files, "plan", *arguments).refused(2, words)


def test_text_that_is_not_utf_8_is_told(files: Path) -> None:
    (files / "latin.pddl").write_bytes("(define\n (problem zür) )".encode("latin-1"))
    pddl(files, "plan", "domain.pddl", "latin.pddl").refused(2, "NOT_UTF8")
    pddl(files, "check", "latin.pddl").refused(2, "latin.pddl:2:12: byte 20 is not UTF-8")


def test_a_byte_order_mark_does_no_harm(files: Path) -> None:
    for name in ("domain.pddl", "problem.pddl"):
        (files / name).write_text((files / name).read_text("utf-8"), encoding="utf-8-sig")
    pddl(files, "plan", "domain.pddl", "problem.pddl").ok()
    assert check_plan(files, "\ufeff(go a b)\n(go b c)\n").ok()


def test_a_problem_of_another_domain_is_warned_of(files: Path) -> None:
    other = (files / "domain.pddl").read_text("utf-8").replace("roads", "rails")
    (files / "rails.pddl").write_text(other, encoding="utf-8")
    (files / "steps").write_text("(go a b)\n(go b c)\n", encoding="utf-8")
    for command_name, more in (("plan", ()), ("why", ()), ("validate", (str(files / "steps"),))):
        ran = pddl(files, command_name, "rails.pddl", "problem.pddl", *more)
        assert (ran.code, ran.err.count("\n")) == (0, 1)
        assert ran.err.startswith("warning: PDDL_DOMAIN ")


def test_ctrl_c_ends_a_search_in_silence_and_leaves_no_process_behind(files: Path) -> None:
    arguments = (files / "endless-domain.pddl", files / "endless.pddl")
    process = subprocess.Popen(
        command("pddl", "plan", *arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=clean_environment(),
    )
    planners = until("a search", lambda: searching(process.pid))
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=PATIENCE_S) == ("", "")
    assert process.returncode == 130
    # Killed as their command ended, by which they are over a moment later.
    until("the end of all", lambda: not any(Path(f"/proc/{pid}").exists() for pid in planners))


def searching(pid: int) -> set[int]:
    """The processes that plan for a command, once a fork server has made some."""
    found = descendants(pid)
    listed = [Path(f"/proc/{child}/cmdline").read_bytes() for child in found]
    return found if sum(b"planner_child" in line for line in listed) > 1 else set()


def test_a_long_search_is_shown_at_a_terminal(files: Path) -> None:
    arguments = (files / "endless-domain.pddl", files / "endless.pddl")
    code, shown = at_terminal("pddl", "plan", *arguments, "--timeout", "2", typed="")
    assert code == 12
    assert re.search(r"endless\.pddl: search\b.*\b1 s\b.*\b2 s\b", shown)


def test_the_same_plan_whatever_the_hash_seed(files: Path) -> None:
    plans = {
        in_new_interpreter(
            *("pddl", "plan", files / "domain.pddl", files / "problem.pddl"),
            *("--planner", "native", "--json"),
            PYTHONHASHSEED=seed,
        )
        .ok()
        .out.partition('"seconds"')[0]
        for seed in ("1", "2", "3")
    }
    assert len(plans) == 1


# check


def test_files_that_are_right_are_named(files: Path, golden: Golden) -> None:
    ran = pddl(files, "check", "problem.pddl", "domain.pddl").ok()
    golden.check("a domain and its problem are right", ran.out, folder=files)


def test_every_mistake_of_every_file_is_told(files: Path, golden: Golden) -> None:
    (files / "torn.pddl").write_text(MAP.format(goal="(and (at x) (road a))"))
    (files / "open.pddl").write_text("(define (problem map) (:domain roads) (:init (at a))")
    ran = pddl(files, "check", "domain.pddl", "wrong.pddl", "torn.pddl", "open.pddl")
    for place in ("wrong.pddl:4:11: ", "torn.pddl:4:19: ", "torn.pddl:4:23: ", "open.pddl:"):
        ran.refused(2, place)
    golden.check("three problems are wrong", f"{ran.out}{ran.err}", folder=files)


def test_a_problem_without_its_domain_is_half_checked(files: Path, golden: Golden) -> None:
    ran = pddl(files, "check", "wrong.pddl")
    assert ran.code == 0
    golden.check_line("a problem comes without its domain", ran.err, folder=files)


def test_a_problem_goes_with_the_last_domain_of_its_name_before_it(files: Path) -> None:
    (files / "other.pddl").write_text(ROADS.replace("(:predicates", "(:predicates (att ?x)"))
    assert pddl(files, "check", "other.pddl", "wrong.pddl", "domain.pddl", "problem.pddl").ok()
    pddl(files, "check", "domain.pddl", "wrong.pddl", "other.pddl").refused(2, "'att'")


def test_a_problem_goes_with_its_own_domain_before_any_other(files: Path) -> None:
    for number in range(2):
        text = ROADS.replace("(:predicates", f"(:predicates (p{number})")
        (files / f"p{number}-domain.pddl").write_text(text)
        goal = f"(and (at c) (p{number}))"
        (files / f"p{number}-a.pddl").write_text(MAP.format(goal=goal))
    names = ("p0-a.pddl", "p0-domain.pddl", "p1-a.pddl", "p1-domain.pddl")
    assert pddl(files, "check", *names).ok().out.count("problem 'map' of") == 2


def test_mistakes_as_json(files: Path) -> None:
    ran = pddl(files, "check", "domain.pddl", "wrong.pddl", "--json")
    assert (ran.code, ran.json["ok"]) == (2, False)
    assert [len(file["problems"]) for file in ran.json["files"]] == [0, 1]
    assert ran.json["files"][1]["problems"][0]["code"] == "PDDL_UNKNOWN"


def test_fragments_are_judged_together(files: Path) -> None:
    fragments = ("eye/domain.pddl", "eye/problem.pddl")
    ran = pddl(files, "check", "--fragment", "--unit", "left=camera", *fragments).ok()
    assert ran.out.count("a fragment") == 2
    ran = pddl(files, "check", "--fragment", "--unit", "left=arm", *fragments)
    ran.refused(2, f"PDDL_TYPE eye {files}/eye/problem.pddl:2:66: ")


def test_a_unit_of_an_unknown_type_is_a_problem_of_the_component(files: Path) -> None:
    ran = pddl(files, "check", "--fragment", "--unit", "left=camra", "eye/domain.pddl")
    ran.refused(2, "unit 'left': ").refused(2, "'camra'")


def test_a_domain_is_no_fragment_for_all_that(files: Path) -> None:
    pddl(files, "check", "--fragment", "domain.pddl").refused(2, "PDDL_ACTOR")


# merge


def test_fragments_are_merged_into_pddl_that_plans(files: Path) -> None:
    arguments = ("--unit", "eye:left=camera", "--goal", "(seen dog self)")
    ran = pddl(files, "merge", "eye/", *arguments, "-o", str(files / "both")).ok()
    assert ran.out.splitlines() == [f"{files}/both/domain.pddl", f"{files}/both/problem.pddl"]
    plan = pddl(files, "plan", "both/domain.pddl", "both/problem.pddl").ok().out
    assert plan.startswith("(eye__look robot__eye__left dog robot)\n")


def test_both_texts_are_printed(files: Path) -> None:
    out = pddl(files, "merge", "eye/", "--unit", "left=camera").ok().out
    assert "(define (domain nondum)" in out
    assert "(define (problem nondum)" in out
    assert "(:goal (and))" in out


def test_who_contradicts_is_left_out_by_name(files: Path) -> None:
    (files / "arm.pddl").write_text("(define (domain arm) (:predicates (seen ?c - class)))")
    ran = pddl(files, "merge", "arm.pddl", "eye/", "--unit", "eye:left=camera")
    ran.refused(3, "left out: eye")
    ran.refused(3, "PDDL_ARITY")
    assert "eye__look" not in ran.out
    assert "(seen ?x1 - class)" in ran.out


def test_provenance_is_in_the_json(files: Path) -> None:
    ran = pddl(files, "merge", "eye/", "--unit", "left=camera", "--json").ok()
    assert ran.json["actions"] == {"eye.look": [f"eye {files}/eye/domain.pddl:3:12"]}
    assert ran.json["quarantined"] == {}
    assert "(:action eye__look" in ran.json["domain"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["eye/", "--goal", "(seen dog)"], "PDDL_ARITY"),
        (["eye/", "--unit", "left"], "expected UNIT=TYPE"),
        (["eye/", "eye/"], "a second component 'eye'"),
    ],
    ids=["goal", "unit", "twice"],
)
def test_wrong_usage_of_merge(files: Path, arguments: list[str], words: str) -> None:
    pddl(files, "merge", *arguments, "--unit", "left=camera").refused(2, words)


def test_a_folder_without_fragments_is_none(files: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    pddl(files, "merge", "empty/").refused(2, "*.pddl")


# validate


def check_plan(files: Path, text: str, *options: str) -> Ran:
    (files / "plan").write_text(text, encoding="utf-8")
    return pddl(files, "validate", "domain.pddl", "problem.pddl", str(files / "plan"), *options)


@pytest.mark.parametrize(
    "text",
    [
        "(go a b)\n(go b c)\n; cost = 2 (unit cost)\n",
        "; found by somebody\n\n( GO A B )\n\t(Go  b C)  ; on\n(REACH-GOAL)\n",
        "0.000: (go a b) [1.000]\n1.000: (go b c) [1.000]\n",
        "0: (GO A B) [D:1.00; C:1.00]\r\n1.0e0: (GO B C)  [D:1.00; C:1.00] ; last\r\n",
    ],
    ids=["plain", "as others write", "with times", "with costs"],
)
def test_a_plan_of_any_planner_is_read(files: Path, text: str, golden: Golden) -> None:
    golden.check("a plan is valid", check_plan(files, text).ok().out)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("(go a b)\n(go a c)\n", "plan:2:1: step 2, (go a c), needs (at a), (road a c)"),
        ("(go a b)\n", "plan: at the end the goal is missed: (at c)"),
        ("(run a b)\n", "there is no action 'run'"),
        ("(go a)\n", "'go' has 2 parameters"),
        ("(go a x)\n", "there is no object 'x'"),
        ("(go a b)\n(go b c)\n; cost = 3\n", "PLAN_COST"),
    ],
    ids=["impossible step", "goal missed", "action", "arity", "object", "cost"],
)
def test_a_plan_that_does_not_hold_is_told_with_its_step(
    files: Path, text: str, words: str
) -> None:
    ran = check_plan(files, text)
    assert ran.code == 3
    assert words in ran.out
    assert ran.out.endswith("invalid\n")
    assert json.loads(check_plan(files, text, "--json").out)["valid"] is False


def test_what_is_no_plan_is_bad_input(files: Path) -> None:
    check_plan(files, "go a b\n").refused(2, "plan:1:1: ")
    ran = check_plan(files, "anything else\n" * 20_000)
    ran.refused(2, "plan:50:1: ")
    assert "plan:51:1" not in ran.err


# why


def test_what_is_missing_is_told(files: Path) -> None:
    ran = pddl(files, "why", "domain.pddl", "cut-off.pddl")
    assert (ran.code, ran.err) == (11, "")
    assert "(at d) cannot be reached" in ran.out
    assert "WHY_" in ran.out


@pytest.mark.parametrize(
    ("problem", "code", "words"),
    [("problem.pddl", 0, "there is a plan: 2 steps"), ("here.pddl", 10, "true already")],
)
def test_what_has_a_plan_needs_no_reason(files: Path, problem: str, code: int, words: str) -> None:
    ran = pddl(files, "why", "domain.pddl", problem)
    assert ran.code == code
    assert words in ran.out


def test_reasons_as_json(files: Path) -> None:
    ran = pddl(files, "why", "domain.pddl", "cut-off.pddl", "--json")
    assert (ran.code, ran.json["answer"]) == (11, "unsolvable")
    assert ran.json["problems"]


def test_why_says_that_no_planner_found_an_answer(files: Path) -> None:
    arguments = ("endless-domain.pddl", "endless.pddl", "--timeout", "0.3")
    ran = pddl(files, "why", *arguments)
    assert ran.code == 12
    assert "no planner" in ran.out


def test_a_reader_that_leaves_ends_it_in_silence(files: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with open(write, "wb") as broken:  # noqa: PTH123  # it is a descriptor, not a path
        done = subprocess.run(
            command("pddl", "plan", files / "domain.pddl", files / "problem.pddl"),
            stdout=broken,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (141, "")
