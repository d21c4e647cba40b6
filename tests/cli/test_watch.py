"""`nondum watch`: one screen of a host, as a person sees it, and in as many lines as there are."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.beacon import BEACON
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, running
from tests.kit.screen import terminal

from nondum.cli.watch_screen import LEAST_WIDTH, QUIET_S, screen, shared, waiting

LONG = "there is no image, which eye.see needs, " + "for all that comes after it, " * 20
TITLES = ["TROUBLE", "GOALS", "PLAN", "PARTS", "STREAMS", "TOLD"]


def view(**more: Any) -> dict[str, Any]:
    """What a host shows that has nothing."""
    machine: dict[str, Any] = {
        "batteries": [],
        "disk": None,
        "temperatures": [],
        "load": None,
        "warnings": [],
    }
    lists = ("payloads", "drives", "goals", "components", "streams", "told")
    return {
        "host": "rover",
        "state": "ready",
        "feedback": {"state": "ready"},
        "machine": machine,
        "warnings": [],
        "tree": {"name": "nondum"},
        **{name: [] for name in lists},
        **more,
    }


def step(number: int, state: str = "kept") -> dict[str, Any]:
    told = {"number": number, "schema": f"eye.see-{number}", "state": state, "progress": ""}
    return {"step": {**told, "started": 0.0, "ended": None, "waits_for": []}}


def full(count: int) -> dict[str, Any]:
    """What a host shows that has `count` of everything."""
    numbers = range(count)
    goal = {"text": "follow me", "state": "suspended", "holds": False, "reason": LONG}
    part = {"host": "rover", "state": "ready", "ready": True, "version": "1.0", "problem": ""}
    stream = {"flowing": True, "rate_hz": 9.53, "consumers": ["base", "eye.lens.odometry"]}
    return view(
        warnings=[f"warning {n}: {LONG}" for n in numbers],
        goals=[{**goal, "id": str(n)} for n in numbers],
        tree={"name": "nondum", "children": [{"children": [step(n) for n in numbers]}]},
        components=[{**part, "component": f"part-{n}"} for n in numbers],
        streams=[
            {**stream, "stream": f"rover__part-{n}__out", "component": f"part-{n}"} for n in numbers
        ],
        told=[{"when": 0.0, "text": f"{n} \x1b[2J\n{LONG}"} for n in numbers],
    )


def shown(seen: dict[str, Any], width: int | None = 80, height: int | None = 23) -> list[str]:
    return [click.unstyle(line) for line in screen(seen, width=width, height=height, wall_s=0.0)]


def titles(lines: list[str]) -> list[str]:
    return [line.split(" (")[0] for line in lines if line.split(" (")[0] in TITLES]


@given(st.integers(0, 30), st.integers(1, 200), st.integers(1, 80))
def test_whatever_there_is_fits_the_screen(count: int, width: int, height: int) -> None:
    lines = shown(full(count), width, height)
    assert len(lines) <= max(1, height)
    assert max(map(len, lines)) <= max(width, LEAST_WIDTH)
    assert "\x1b" not in "".join(lines)


@given(st.integers(0, 60), st.lists(st.integers(0, 40), max_size=8))
def test_lines_are_shared_so_that_no_section_goes_without_for_another(
    space: int, wanted: list[int]
) -> None:
    counts = shared(space, wanted)
    assert all(count <= most for count, most in zip(counts, wanted, strict=True))
    assert sum(count + 1 for count in counts if count) <= space
    cut = [count for count, most in zip(counts, wanted, strict=True) if count < most]
    assert all(count <= least + 2 for least in cut for count in counts)


def test_a_usual_screen_has_all_sections_of_a_host_with_much() -> None:
    assert titles(shown(full(9))) == TITLES
    assert titles(shown(full(9), 120, 39)) == TITLES


def test_what_was_told_last_and_what_is_wrong_first_are_kept() -> None:
    told = "\n".join(shown(full(9)))
    assert "8 \\x1b[2J" in told
    assert "0 \\x1b[2J" not in told
    assert "warning 0" in told
    assert "TOLD (" in told


def test_nothing_is_cut_where_nothing_is_drawn_over() -> None:
    lines = shown(full(9), None, None)
    assert sum(LONG.rstrip() in line for line in lines) >= 18
    assert titles(lines) == TITLES
    assert not any("of 9)" in line for line in lines)


def test_a_host_with_nothing_says_so(golden: Golden) -> None:
    lines = shown(view())
    assert titles(lines) == ["GOALS", "PARTS"]
    golden.check_line("nothing was asked for", "\n".join(lines))
    golden.check_line("nothing is plugged in", "\n".join(lines))


def test_parts_that_are_not_well_come_before_those_that_are() -> None:
    part = {"host": "rover", "ready": True, "version": "1", "problem": ""}
    rows = [
        {**part, "component": "base", "state": "ready"},
        {**part, "component": "head", "state": "waits for laser"},
        {**part, "component": "eye", "state": "quarantined", "ready": False, "problem": "HUNG it"},
        {**part, "component": "node", "state": "ready", "host": "mule"},
    ]
    lines = shown(view(components=rows))
    start = lines.index("PARTS") + 1
    assert [line.split() for line in lines[start : start + 3]] == [
        ["✗", "head", "1", "waits", "for", "laser"],
        ["✗", "eye", "1", "quarantined", "HUNG", "it"],
        ["✓", "base", "1,", "node@mule", "1"],
    ]


def test_names_are_short_and_rates_are_told() -> None:
    (line,) = (line for line in shown(full(1)) if "part-0.out" in line)
    assert line.split() == ["~", "part-0.out", "9.53/s", "→", "base,", "eye"]
    assert "rover__" not in "".join(shown(full(3)))


def test_a_host_that_has_gone_silent_is_not_called_ready() -> None:
    seen = view()
    at = {"width": 80, "height": 23, "wall_s": 0.0}
    assert ": ready " in click.unstyle(screen(seen, **at, quiet_s=QUIET_S - 1)[0])  # type: ignore[arg-type]  # one dict for both
    assert ": silent for 10 s " in click.unstyle(screen(seen, **at, quiet_s=QUIET_S)[0])  # type: ignore[arg-type]  # one dict for both


def test_while_a_host_is_waited_for_nothing_old_is_shown(golden: Golden) -> None:
    lines = waiting("rover", width=60, wall_s=0.0, since_s=0.0)
    timeless = re.sub(r"\d\d:\d\d:\d\d", "TIME", click.unstyle(lines[1]))
    golden.check("a host is waited for", timeless.strip())
    assert max(len(click.unstyle(line)) for line in lines) <= 60


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
def test_a_person_sees_what_changes_in_one_place(
    daemon: RunningHost, size: tuple[int, int]
) -> None:
    columns, lines = size
    command = ("--control", daemon.control, "watch")
    with terminal(*command, columns=columns, lines=lines) as person:
        person.until("nondum panther: ready", "✓ beacon 1.0", "q ends it")
        assert person.screen.is_other
        id = daemon.run("goal", "shine", "--json").ok().json["id"]
        seen = person.until(f"∞ {id} shine", "∞ 1 test-beacon.shine", "~ beacon.brightness")
        assert len(seen) <= lines
        assert person.screen.coloured
        assert not person.has_echo
        daemon.run("halt", "--now").ok()
        person.until(f"■ {id} shine  halted", "· beacon.brightness")
        person.press("q")
        assert person.ended() == 0
        assert not person.screen.is_other
        assert person.has_echo


def test_ctrl_c_ends_it_as_well_and_colour_is_left_out_where_unwanted(daemon: RunningHost) -> None:
    with terminal("--control", daemon.control, "watch", NO_COLOR="1") as person:
        person.until("✓ beacon 1.0")
        person.process.send_signal(signal.SIGINT)
        assert person.ended() == 0
        assert not person.screen.is_other
        assert not person.screen.coloured
        assert person.has_echo


def test_a_signal_leaves_the_terminal_as_it_was(daemon: RunningHost) -> None:
    with terminal("--control", daemon.control, "watch") as person:
        person.until("✓ beacon 1.0")
        person.process.terminate()
        assert person.ended() == 128 + signal.SIGTERM
        assert not person.screen.is_other
        assert person.has_echo


def test_a_terminal_that_gets_another_size_is_drawn_for_that(daemon: RunningHost) -> None:
    with terminal("--control", daemon.control, "watch", columns=60, lines=12) as person:
        person.until("nondum panther: ready")
        person.resize(100, 30)
        first = person.until("✓ beacon 1.0")[0]
        assert len(first) == 100


def test_a_host_that_is_started_again_is_shown_again(tmp_path: Path) -> None:
    with running(tmp_path, name="panther") as host:
        host.bring("beacon", Part("beacon", BEACON))
        with terminal("--control", host.control, "watch") as person:
            person.until("nondum panther: ready", "✓ beacon 1.0")
            host.kill()
            person.until("nondum panther ", "waiting for the host …", without="beacon")
            host.start()
            person.until("nondum panther: ready", "✓ beacon 1.0")
            person.press("Q")
            assert person.ended() == 0


def test_a_pipe_gets_it_once_and_machines_get_json(daemon: RunningHost, golden: Golden) -> None:
    lines = daemon.run("watch").ok().out.splitlines()
    assert lines[0].startswith("nondum panther: ready")
    timeless = re.sub(r"\d\d:\d\d:\d\d", "TIME", "\n".join(lines))
    golden.check_line("a component is here", timeless)
    told = daemon.run("watch", "--json").ok().json
    assert {"components", "streams", "plan", "tree", "machine"} < told.keys()


def test_a_terminal_that_cannot_be_drawn_over_gets_it_once(daemon: RunningHost) -> None:
    with terminal(
        "--control", daemon.control, "watch", columns=500, lines=200, TERM="dumb"
    ) as person:
        assert person.ended() == 0
        assert person.screen.lines[0].startswith("nondum panther: ready")


def test_without_a_daemon_it_says_so(tmp_path: Path) -> None:
    nondum("--control", tmp_path / "none.sock", "watch").refused(4, "HOST_UNREACHABLE")
