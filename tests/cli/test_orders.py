"""What the command line has a real host do."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator

import pytest
from tests.kit.beacon import BEACON, BEACON_ID, BRIGHTNESS, LAMP
from tests.kit.golden import Golden
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import RunningHost, goal

from nondum.sdk.description import PluginDescription

SLOW = """
import asyncio
from nondum.sdk import hookimpl

@hookimpl
async def start(ctx):
    await asyncio.sleep(20)
"""
POINTER = """
from nondum.sdk import Phrase, hookimpl

@hookimpl
def phrases():
    return [Phrase("[please] point at {t:target}", "(pointing self ?t)", kind="maintain")]
"""
SHINE = f"test-beacon.shine {LAMP} {BRIGHTNESS} panther"
SHINE_SHORT = "test-beacon.shine lamp brightness panther"

TORCH_ID = "org.example.torch"


@pytest.fixture(autouse=True)
def at_rest(daemon: RunningHost) -> Iterator[None]:
    """Each test finds, and leaves, a host that does nothing."""
    yield
    daemon.run("halt", "--now").ok()
    daemon.until("nothing is done", lambda view: not view["plan"]["steps"])


def until_alone(daemon: RunningHost) -> None:
    """Wait until the beacon is the only payload."""
    daemon.until("the beacon is alone", lambda view: len(view["payloads"]) == 1)


def test_a_goal_in_words_is_kept_up(daemon: RunningHost, golden: Golden) -> None:
    given = daemon.run("goal", "shine", "for", "all", "--wait", "--json").ok().json
    assert (given["text"], given["kind"], given["state"]) == ("shine for all", "maintain", "active")
    assert given["holds"]
    plan = daemon.run("plan", "--json").ok().json
    assert [step["action"] for step in plan["steps"]] == [SHINE]
    golden.check_line("why: a step runs", daemon.run("why").ok().out)
    assert "1     test-beacon.shine  " in daemon.run("plan").ok().out


def test_a_goal_is_reached_while_another_is_kept_up(daemon: RunningHost) -> None:
    daemon.run("goal", "shine", "--wait").ok()
    reached = daemon.run("goal", "greet people", "--wait").ok().out
    assert reached.split("  ")[1:] == ["(greeted person panther)", "reached", "it holds\n"]


def test_answer_to_a_goal_names_the_goals_that_it_replaces(daemon: RunningHost) -> None:
    first = daemon.run("goal", "shine", "--wait", "--json").ok().json
    assert first["replaces"] == []
    second = daemon.run("goal", "shine", "--json").ok().json
    (replaced,) = second["replaces"]
    assert (replaced["id"], replaced["text"]) == (first["id"], "shine")
    assert f"goal {second['id']}, 'shine'" in daemon.run("goal", "shine").ok().out
    third = daemon.run("goal", "shine", "--wait", "--json").ok().json
    assert second["id"] not in [goal["id"] for goal in third["replaces"] if not goal["is_over"]]
    assert f"goal {third['id']}, 'shine'" in daemon.run("say", "shine").ok().out


def test_a_goal_in_pddl_is_understood(daemon: RunningHost) -> None:
    given = daemon.run("goal", "--pddl", "(lit self)", "--maintain", "--wait", "--json").ok().json
    assert (given["goal"], given["kind"], given["holds"]) == ("(lit panther)", "maintain", True)


def test_words_that_ask_for_nothing_are_refused_with_the_nearest(daemon: RunningHost) -> None:
    daemon.run("goal", "shien", "brightly").refused(1, "PHRASE_")


def test_wrong_pddl_is_refused_with_a_caret(daemon: RunningHost) -> None:
    ran = daemon.run("goal", "--pddl", "(lit stranger)").refused(1, "(lit stranger)\n")
    assert ran.err.rstrip().endswith("^\n→ declare it, or correct its spelling")


def test_a_goal_without_a_plan_says_what_is_missing(daemon: RunningHost) -> None:
    ran = daemon.run("goal", "--pddl", "(reported person self)", "--wait")
    assert ran.code == 1
    assert "suspended" in ran.out
    assert "WHY_" in ran.out
    daemon.until("the host is ready", lambda view: view["state"] == "ready")
    assert "WHY_" in daemon.run("why").ok().out


def test_halting_one_goal_leaves_the_rest(daemon: RunningHost) -> None:
    first = daemon.run("goal", "shine", "--wait", "--json").ok().json["id"]
    second = daemon.run("goal", "--pddl", "(reported person self)", "--json").ok().json["id"]
    halted = daemon.run("halt", "--goal", second, "--json").ok().json
    assert halted == {"goals": [second], "halted": [], "peers": []}
    daemon.until_goal(second, "halted")
    kept = goal(daemon.view, first)
    assert kept and kept["state"] == "active"


def test_halting_now_halts_what_runs(daemon: RunningHost, golden: Golden) -> None:
    id = daemon.run("goal", "shine", "--wait", "--json").ok().json["id"]
    shown = daemon.run("halt", "--now").ok().out
    golden.check("what ran is halted", shown, id=id, behaviour=SHINE_SHORT)
    golden.check("nothing runs", daemon.run("halt").ok().out)


@pytest.mark.parametrize(
    "words",
    [
        *(["stop"], ["goal", "stop"], ["goal", "halt", "now,", "please"]),
        *(
            ["goal", "panther,", "stop"],
            ["goal", "rover,", "stop"],
            ["goal", "stop,", "panther"],
            ["goal", "please", "halt", "rover", "now"],
            ["goal", "--keep", "hey", "stop"],
        ),
    ],
)
def test_a_word_stops_the_robot(daemon: RunningHost, words: list[str], golden: Golden) -> None:
    id = daemon.run("goal", "shine", "--wait", "--json").ok().json["id"]
    golden.check("what ran is halted", daemon.run(*words).ok().out, id=id, behaviour=SHINE_SHORT)
    daemon.until_goal(id, "halted")


def test_the_journal_has_short_names_for_people(daemon: RunningHost) -> None:
    daemon.run("goal", "shine", "--wait").ok()
    daemon.run("halt", "--now").ok()
    with daemon.started("journal", "--follow", "--since", "10min") as process:
        assert process.stdout is not None
        halted = next(line for line in process.stdout if "BehavioursHalted" in line)
    assert SHINE_SHORT in halted
    shown = daemon.run("journal", "--limit", "20").ok().out
    assert SHINE_SHORT in shown
    assert LAMP not in shown


def test_a_robot_at_rest_can_be_stopped(daemon: RunningHost) -> None:
    stopped = daemon.run("goal", "stop", "--wait", "--json").ok().json
    assert stopped == {"goals": [], "halted": [], "peers": []}


def test_a_goal_that_is_none_cannot_be_halted(daemon: RunningHost) -> None:
    daemon.run("halt", "--goal", "999").refused(1, "GOAL_UNKNOWN")


def test_a_mount_is_told_and_what_is_not_said_stays(daemon: RunningHost, golden: Golden) -> None:
    shown = daemon.run("mount", LAMP, "--xyz", "0.1", "-0.2", "0.4").ok().out
    golden.check("a unit is mounted", shown, unit=LAMP)
    turned = daemon.run("mount", LAMP, "--rpy", "0", "0", "-1.5", "--json").ok().json
    assert turned == {"unit": LAMP, "xyz": [0.1, -0.2, 0.4], "rpy": [0, 0, -1.5], "warnings": []}
    (unit,) = daemon.run("units", "--json").ok().json
    assert (unit["xyz"], unit["rpy"], unit["mount"]) == ([0.1, -0.2, 0.4], [0, 0, -1.5], "person")


def test_an_implausible_mount_is_doubted(daemon: RunningHost, golden: Golden) -> None:
    ran = daemon.run("mount", LAMP, "--xyz", "400", "0", "0", "--rpy", "0", "0", "90")
    assert ran.code == 0
    golden.check("a mount is implausible", ran.err, unit=LAMP)


def test_no_place_at_all_is_refused(daemon: RunningHost) -> None:
    daemon.run("mount", LAMP, "--xyz", "nan", "0", "0").refused(1, "CONTROL_ARGUMENT")


def test_a_unit_that_is_none_is_refused_with_the_nearest(daemon: RunningHost) -> None:
    ran = daemon.run("mount", "panther__beacon__lmap", "--xyz", "0", "0", "0")
    ran.refused(1, "UNIT_UNKNOWN").refused(1, f"'{LAMP}'")


def test_a_stream_is_followed_message_by_message(daemon: RunningHost) -> None:
    daemon.run("goal", "shine", "--wait").ok()
    lines = daemon.run("streams", "--follow", BRIGHTNESS, "--count", "3", "--json").ok().out
    messages = [json.loads(line) for line in lines.splitlines()]
    assert [message["fields"] for message in messages] == 3 * [{"value": 0.5, "unit": "1"}]
    assert {message["frame_id"] for message in messages} == {LAMP}
    assert len({message["seq"] for message in messages}) == 3
    shown = daemon.run("streams", "-f", BRIGHTNESS, "-n", "1").ok().out
    assert shown.split("  ")[1:] == [LAMP, shown.split("  ")[2], "value=0.5 unit=1\n"]


def test_a_stream_ends_with_its_component(daemon: RunningHost) -> None:
    daemon.bring("torch", Part("torch", BEACON.replace("beacon", "torch")))
    daemon.run(
        "goal", "--pddl", "(flowing panther__torch__brightness)", "--maintain", "--wait"
    ).ok()
    with daemon.started("streams", "-f", "panther__torch__brightness") as process:
        assert process.stdout is not None
        assert "panther__torch__lamp" in process.stdout.readline()
        daemon.pull("torch")
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "panther__torch__brightness has ended\n")
    until_alone(daemon)


def test_what_is_sound_is_not_tried_again(daemon: RunningHost) -> None:
    daemon.run("retry", BEACON_ID).refused(1, "RETRY_NOTHING")
    daemon.run("retry", "org.example.baecon").refused(1, "'org.example.beacon'")


def test_what_was_refused_is_told_and_tried_again(daemon: RunningHost) -> None:
    said = PluginDescription("test-broken", "1.0")
    broken = Part("broken", "raise RuntimeError('no bulb')", description=said)
    daemon.plug(daemon.drive("broken", broken))
    row = daemon.until_step("broken", "quarantined")
    assert "IMPORT_FAILED" in row["codes"]
    status = daemon.run("status").ok().out
    assert daemon.ask("status")["state"] == "ready, with problems"
    assert "no bulb" in status
    assert "no bulb" in daemon.run("why").ok().out
    retried = daemon.run("retry", "org.example.broken", "--json").ok().json
    assert retried == {"payloads": ["org.example.broken"]}
    daemon.until_step("broken", "quarantined")
    daemon.pull("broken")
    until_alone(daemon)


def test_a_phrase_without_anything_to_name_is_shown_with_a_blank(
    daemon: RunningHost, golden: Golden
) -> None:
    daemon.bring("pointer", Part("pointer", POINTER))
    golden.check_line("a phrase has a blank", daemon.run("goals").ok().out)
    [row] = [r for r in daemon.run("goals", "--json").ok().json["can"] if "{" in r["words"]]
    assert row["words"] == "[please] point at {t:target}"
    daemon.pull("pointer")
    until_alone(daemon)


def test_a_payload_is_installed_for_good_and_removed(daemon: RunningHost) -> None:
    drive = daemon.work / "drives/torch-to-install"
    torch = Part("torch", BEACON.replace("beacon", "torch"))
    make_payload(drive, torch, payload_id=TORCH_ID)
    shown = daemon.run("payload", "install", drive).ok().out
    assert shown == "installed org.example.torch 1.0\n"
    daemon.run("payload", "install", drive).refused(1, "ALREADY_PRESENT")
    removed = daemon.run("payload", "uninstall", "org.example.torch").ok().out
    assert removed == "uninstalled org.example.torch\n"
    daemon.run("payload", "uninstall", "org.example.torch").refused(1, "NOT_INSTALLED")


def test_a_payload_is_taken_back_to_the_release_before(daemon: RunningHost, golden: Golden) -> None:
    drives = {n: daemon.work / f"drives/torch-{n}" for n in (1, 2)}
    for release, drive in drives.items():
        version = f"{release}.0"
        torch = Part("torch", BEACON.replace("beacon", "torch"), version=version)
        make_payload(drive, torch, payload_id=TORCH_ID, version=version, release=release)
    daemon.run("payload", "rollback", TORCH_ID).refused(1, "PAYLOAD_UNKNOWN")
    daemon.run("payload", "install", drives[1]).ok()
    daemon.run("payload", "rollback", TORCH_ID).refused(1, "ROLLBACK_NOTHING")
    daemon.run("payload", "install", drives[2]).ok()
    shown = daemon.run("status").ok().out
    assert "2 (was 1)" in shown
    assert "superseded" in shown
    gone_back = daemon.run("payload", "rollback", TORCH_ID).ok().out
    golden.check("a person goes back", gone_back, payload=TORCH_ID)
    golden.check_line("a person went back", daemon.run("status").ok().out, payload=TORCH_ID)
    assert "1 (gone back from 2)" in daemon.run("components").ok().out
    daemon.run("retry", TORCH_ID).ok()
    daemon.until(
        "release 2 is active",
        lambda view: {r["release"]: r["state"] for r in view["payloads"]}.get(2) == "active",
    )
    daemon.run("payload", "uninstall", TORCH_ID).ok()


def test_what_cannot_be_installed_leaves_nothing(daemon: RunningHost) -> None:
    drive = daemon.work / "drives/broken-to-install"
    said = PluginDescription("test-broken", "1.0")
    broken = Part("broken", "raise RuntimeError('no bulb')", description=said)
    make_payload(drive, broken, payload_id="org.example.broken")
    daemon.run("payload", "install", drive).refused(1, "no bulb")
    until_alone(daemon)


def test_an_interrupted_installation_leaves_nothing(daemon: RunningHost) -> None:
    drive = daemon.work / "drives/slow-to-install"
    slow = Part("slow", SLOW)
    make_payload(drive, slow, payload_id="org.example.slow")
    with daemon.started("payload", "install", drive) as process:
        daemon.until_step("slow", "stored")
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 130
        until_alone(daemon)


@pytest.mark.parametrize("verb", ["say", "goal"])
def test_a_question_typed_is_answered_and_no_goal(
    daemon: RunningHost, verb: str, golden: Golden
) -> None:
    before = daemon.run("goals", "--json").ok().json["given"]
    golden.check("what it can do", daemon.run(verb, "What can you do?").ok().out)
    told = daemon.run(verb, "panther,", "what are you doing", "--json").ok().json
    assert told.keys() == {"answer"}
    golden.check("it does nothing", told["answer"])
    assert daemon.run("goals", "--json").ok().json["given"] == before
    assert told["answer"] in [row["text"] for row in daemon.ask("status")["told"]]


def test_what_is_said_is_a_goal_or_stops_or_is_refused(daemon: RunningHost, golden: Golden) -> None:
    told = daemon.run("say", "shine").ok().out
    assert told.startswith("that is goal ")
    daemon.until_goal(told.split()[-1], "holds")
    doing = daemon.run("say", "what are you doing").ok().out
    golden.check("it shines", doing)
    assert daemon.run("say", "stop").ok().out.startswith("stopped: 1 goal")
    daemon.run("say", "shine").ok()
    assert daemon.run("say", "rover,", "please", "stop").ok().out.startswith("stopped: 1 goal")
    daemon.run("say", "sing").refused(1, "PHRASE_UNKNOWN")
    daemon.run("say", "never", "stop").refused(1, "PHRASE_UNKNOWN")


def test_a_phrase_that_ends_with_a_word_that_stops_is_a_goal(daemon: RunningHost) -> None:
    for verb in ("say", "goal"):
        daemon.run(verb, "shine", "for", "freeze").ok()
        (given,) = [row for row in daemon.view["goals"] if row["state"] != "halted"][-1:]
        assert given["text"] == "shine for freeze"
        daemon.run("stop").ok()


def test_a_robot_goes_by_its_own_name_where_there_are_no_peers(daemon: RunningHost) -> None:
    told = daemon.run("say", "panther,", "shine").ok().out
    daemon.until_goal(told.split()[-1], "holds")
    assert daemon.run("say", "Panther,", "stop!").ok().out.startswith("stopped: 1 goal")
    given = daemon.run("goal", "panther,", "shine", "--wait", "--json").ok().json
    assert (given["text"], given["holds"]) == ("shine", True)
