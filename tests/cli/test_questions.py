"""Every question of the command line, asked of a real host with one payload plugged in."""

from __future__ import annotations

import json
import re
import time
from datetime import datetime
from typing import Any

import pytest
from tests.cli.conftest import Answering
from tests.kit.beacon import BEACON_ID, BRIGHTNESS, LAMP
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.running_host import RunningHost
from tests.kit.until import until as until_seen

GOAL_KEYS = {"id", "goal", "text", "kind", "priority", "state", "reason", "problems", "holds"}
ROWS: dict[str, set[str]] = {
    "behaviours": {"behaviour", "component", "kind", "running", "phrases", "problem"},
    "components": {
        "component",
        "host",
        "state",
        "ready",
        "plugin",
        "version",
        "payload",
        "units",
        "behaviours",
        "devices",
        "data",
        "pid",
        "granted",
        "problem",
        "confinement",
        "release",
        "was",
        "built",
        "age_s",
        "since",
    },
    "facts": {"fact", "age_s", "source", "value"},
    "journal": {
        "id",
        "when",
        "monotonic",
        "boot",
        "event",
        "subject",
        "step",
        "problems",
        "detail",
    },
    "logs": {"component", "when", "level", "message"},
    "store": {"wheel", "bytes", "used_by", "sha256"},
    "streams": {"stream", "type", "component", "flowing", "rate_hz", "consumers"},
    "units": {"unit", "type", "component", "ready", "xyz", "rpy", "mount", "warnings"},
}
VIEWS: dict[str, set[str]] = {
    "goals": {"can", "phrases", "given", "elsewhere", "problems"},
    "plan": {"goal", "kind", "steps", "beside"},
    "status": {
        "host",
        "revision",
        "state",
        "safe_mode",
        "warnings",
        "trust",
        "feedback",
        "machine",
        "peers",
        "payloads",
        "drives",
        "goals",
        "told",
        "confinement",
    },
    "tree": {"name", "kind", "status", "why", "policy", "children"},
    "why": {"advice", "sentences", "problems", "told"},
}
PAYLOAD_KEYS = {
    "payload",
    "key",
    "version",
    "release",
    "state",
    "progress",
    "drive",
    "components",
    "problems",
    "codes",
    "phases",
    "place",
    "waits_for",
    "signers",
    "built",
    "age_s",
    "was",
    "gone_back",
}

STATUS = """\
host panther  revision N  ready
machine: AS IT IS
warning: payloads without a signature are accepted (allow_unsigned)
confinement of workers: LEVEL

PAYLOAD             VERSION  AGE  STATE   DRIVE   COMPONENTS
org.example.beacon  1.0      AGE  active  beacon  beacon

> TIME  beacon is here: it can greet, shine
"""
COMPONENTS = """\
COMPONENT  STATE  PLUGIN       VERSION  PAYLOAD             AGE  UNITS  CONFINEMENT  PROBLEM
beacon     ready  test-beacon  1.0      org.example.beacon  AGE  lamp   LEVEL        -
"""
BEHAVIOURS = """\
BEHAVIOUR  COMPONENT  KIND       RUNNING  PHRASES
greet      beacon     finishing  no       greet <c>
shine      beacon     lasting    no       shine
"""
UNITS = """\
UNIT  TYPE   COMPONENT  READY  XYZ  RPY  MOUNT
lamp  light  beacon     yes    -    -    unknown
"""
STREAMS = """\
STREAM      TYPE    COMPONENT  FLOWING  RATE  CONSUMERS
brightness  scalar  beacon     no       -     -
"""
FACTS = """\
FACT                    SINCE  SOURCE                                       VALUE
free brightness         AGE    nothing uses it                              -
idle lamp               AGE    nothing uses it                              -
on lamp panther         AGE    beacon is plugged into panther               -
output lamp brightness  AGE    beacon declares it                           -
ready lamp              AGE    beacon is healthy and its devices are there  -
self panther            AGE    this is the host that plans                  -
"""
GOALS = """\
WORDS         GOAL                      KIND      NOW  FROM
greet people  (greeted person panther)  achieve   can  beacon
shine         (lit panther)             maintain  can  beacon

no goal was given
"""
TREE = """\
✓ nondum
  ✓ monitor  — revision N
  ✓ world model  — N facts hold
  ✓ goals
  ✓ task  — nothing is asked for
    ✓ hold  — nothing is asked for
  ✓ people  — N sentences told
"""
WHY = """\
nothing is asked for

> TIME  beacon is here: it can greet, shine
"""
SHOWN = {
    "status": STATUS,
    "components": COMPONENTS,
    "behaviours": BEHAVIOURS,
    "units": UNITS,
    "devices": "no devices\n",
    "streams": STREAMS,
    "facts": FACTS,
    "goals": GOALS,
    "plan": "no plan; `nondum why` says why\n",
    "tree": TREE,
    "why": WHY,
}


def normalised(text: str) -> str:
    """What a command printed, without what differs from run to run."""
    text = re.sub(r"(?<=^> )\d\d:\d\d:\d\d(?=  )", "TIME", text, flags=re.MULTILINE)
    text = re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", "WHEN", text)
    text = re.sub(r"(?<=  )\d+ (?:s|min)(?= )", lambda age: "AGE".ljust(len(age[0])), text)
    text = re.sub(r"AGE +(?=STATE|UNITS)|(?<=  )\d+ d +", "AGE  ", text)
    text = re.sub(r"(confinement of workers:) .*", r"\1 LEVEL", text)
    text = re.sub(r"^shown: .*\n", "", text, flags=re.MULTILINE)  # it is another one soon
    bad = r"(?:warning: the (?:machine|disk|battery) is .*\n)*"
    text = re.sub(rf"machine: .*\n{bad}", "machine: AS IT IS\n", text)
    levels = "sandboxed|restricted|none"
    text = re.sub(rf"(?<=lamp   )(?:{levels}) +", "LEVEL        ", text)
    return re.sub(r"(revision|world model  —|people  —) \d+", r"\1 N", text)


def rows(daemon: RunningHost, *arguments: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = daemon.run(*arguments, "--json").ok().json
    return found


@pytest.mark.parametrize("verb", SHOWN)
def test_a_hundred_columns_are_enough(daemon: RunningHost, verb: str) -> None:
    assert normalised(daemon.run(verb, COLUMNS="100").ok().out) == SHOWN[verb]


@pytest.mark.parametrize("verb", ROWS)
def test_rows_have_these_keys_in_json(daemon: RunningHost, verb: str) -> None:
    found = rows(daemon, verb)
    assert found
    for row in found:
        assert row.keys() == ROWS[verb]


@pytest.mark.parametrize("verb", VIEWS)
def test_views_have_these_keys_in_json(daemon: RunningHost, verb: str) -> None:
    assert daemon.run(verb, "--json").ok().json.keys() == VIEWS[verb]


@pytest.mark.parametrize("verb", ["status", "components"])
def test_a_payload_is_as_old_as_it_says(daemon: RunningHost, verb: str) -> None:
    before_s = time.time()
    told = daemon.run(verb, "--json").ok().json
    after_s = time.time()
    (row,) = told["payloads"] if verb == "status" else told
    asked_s = datetime.fromisoformat(row["built"]).timestamp() + row["age_s"]
    assert before_s <= asked_s <= after_s


def test_a_payload_has_these_keys_and_phases(daemon: RunningHost) -> None:
    (payload,) = daemon.run("status", "--json").ok().json["payloads"]
    assert payload.keys() == PAYLOAD_KEYS
    phases = [payload["phases"][name] for name in ("seen", "verified", "installed", "ready")]
    assert phases == sorted(phases)


def test_a_pipe_folds_nothing(daemon: RunningHost) -> None:
    lines = daemon.run("journal").ok().out.splitlines()
    assert any(line.split()[2:] and "DriveInserted" in line for line in lines)
    assert max(map(len, lines)) > 100


def test_the_journal_tells_a_payload_step_by_step(daemon: RunningHost) -> None:
    found = rows(daemon, "journal", "--subject", BEACON_ID)
    steps = [row["step"] for row in found if row["step"]]
    assert steps == ["received", "copied", "verified", "staged", "stored", "probed", "active"]
    assert rows(daemon, "journal", "--subject", BEACON_ID, "--limit", "2") == found[-2:]


def test_the_journal_is_silent_of_strangers(daemon: RunningHost, golden: Golden) -> None:
    shown = daemon.run("journal", "--subject", "stranger").ok().out
    golden.check("the journal knows nothing", shown)


def test_logs_are_lines_with_time_component_and_level(daemon: RunningHost) -> None:
    shown = normalised(daemon.run("logs", "beacon").ok().out).splitlines()
    assert "WHEN  beacon  info  polished" in shown
    assert "WHEN  beacon  stdout  plain words" in shown


def test_silent_logs_say_who_runs_and_since_when(daemon: RunningHost) -> None:
    (row,) = daemon.ask("components")
    since = datetime.fromtimestamp(row["since"]).strftime("%T")
    told = f"nothing was written: beacon runs since {since}\n"
    until_seen(told, lambda: daemon.run("logs", "--since", "1s").ok().out == told)


def test_logs_of_a_stranger_are_refused_with_the_nearest(daemon: RunningHost) -> None:
    daemon.run("logs", "baecon").refused(1, "COMPONENT_UNKNOWN").refused(1, "'beacon'?")


def test_the_store_says_who_needs_what(daemon: RunningHost) -> None:
    shown = daemon.run("store").ok().out.splitlines()
    own = next(line for line in shown if line.startswith("test_beacon-1.0"))
    assert BEACON_ID in own
    assert re.fullmatch(r"4 files, \d+\.\d MB", shown[-1])


def test_one_fact_is_explained_whether_it_is_true_or_not(daemon: RunningHost) -> None:
    shown = re.sub(
        r"\d+ s ago", "AGE ago", daemon.run("facts", "--why", f"(ready {LAMP})").ok().out
    )
    assert shown == (
        "(ready lamp) holds\n"
        "for it: beacon is healthy and its devices are there, AGE ago\n"
        "note: the host itself says so, or not\n"
    )
    untrue = daemon.run("facts", "--why", f"flowing {BRIGHTNESS}").ok().out
    assert untrue == (
        "(flowing brightness) does not hold\n"
        "no source has said so\n"
        "would be made true by: test-beacon.shine\n"
    )


def test_names_are_short_for_people_and_whole_in_json(daemon: RunningHost) -> None:
    assert daemon.run("facts", "--why", "(ready lamp)").ok().out.startswith("(ready lamp) holds")
    assert rows(daemon, "units")[0]["unit"] == LAMP
    assert rows(daemon, "streams")[0]["stream"] == BRIGHTNESS


def test_a_wrong_fact_gets_the_nearest_words(daemon: RunningHost, golden: Golden) -> None:
    assert "'flowing'" in daemon.run("facts", "--why", "flowin x").ok().out
    assert "'panther'" in daemon.run("facts", "--why", "(lit panter)").ok().out
    arity = daemon.run("facts", "--why", "lit", "--json").ok().json
    golden.check("too few arguments", arity["hint"])


def test_nothing_is_parked(daemon: RunningHost, golden: Golden) -> None:
    golden.check("nothing is parked", daemon.run("facts", "--parked").ok().out)
    daemon.run("facts", "--parked", "--why", "lit").refused(2, "choose one")


def test_a_stream_that_is_none_is_refused_with_the_nearest(daemon: RunningHost) -> None:
    ran = daemon.run("streams", "--follow", "panther__beacon__brightnes")
    ran.refused(1, "STREAM_UNKNOWN").refused(1, f"'{BRIGHTNESS}'")


@pytest.mark.parametrize(
    "follow", [["status", "-f"], ["tree", "-f"], ["tree", "--watch"]], ids=" ".join
)
def test_following_draws_what_asking_does(daemon: RunningHost, follow: list[str]) -> None:
    with daemon.started(*follow) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
    assert first.startswith(("host panther", "✓ nondum"))


WAITS = "(ready head) does not hold: turret waits for its devices head and relay"
LACKS = [WAITS, "(idle head) does not hold", "there is no bearing"]
FAILED = "turret.aim failed 3 times: AIM_LOST it moved → wait\nAIM_SEEN there → look"


@pytest.mark.parametrize("is_json", [False, True])
def test_a_row_of_goals_tells_the_first_cause_alone_and_json_all(
    answering: Answering, is_json: bool
) -> None:
    can = {"words": "aim", "goal": "(aimed)", "kind": "do", "now": "cannot", "lacks": LACKS}
    goal = {"id": "1", "text": "aim", "goal": "(aimed)", "kind": "do", "resumable": False}
    given = [{**goal, "state": "suspended", "reason": FAILED}]
    given += [{**goal, "state": "reached", "reason": "at 3° → 4°"}]
    view = {"can": [{**can, "from": []}], "given": given, "elsewhere": [], "problems": []}
    answers = [json.dumps({"result": answer}).encode() + b"\n" for answer in (view, {})]
    if is_json:
        ran = nondum("--control", answering(answers[0]), "goals", "--json")
        assert ran.json == view
        return
    shown = nondum("--control", answering(*answers), "goals").ok().out
    assert WAITS in shown and "`nondum why aim`" in shown
    assert "it moved" in shown and "at 3° → 4°" in shown
    assert not any(left in shown for left in (*LACKS[1:], "→ wait", "AIM_SEEN"))
