"""Bad payloads as a person meets them: one clear error with its code, and all else goes on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.robot import nondum
from tests.daemon.plugins import scribe, talker
from tests.host.lifecycle.bad_payloads import BAD, EXITS_LATER, WAYS, Bad, bare
from tests.kit.payloads import make_payload
from tests.kit.running_host import READY_S, Row, RunningHost, running
from tests.kit.shared import until_nothing_is_left

pytestmark = pytest.mark.daemon

ONE_OF_EACH_PHASE = {"toml", "flipped-byte", "dependency", "import", "exit"}
"""What is refused when it is read, verified, installed, probed and started. All others come to
a host's lifecycle in tests/host/lifecycle, which is quicker."""
IMPATIENT = "[workers]\nstartup_s = 2.0\n"
"""For a host without healthy workers, which may take longer than that."""
HEALTHY = ("talker", "scribe")


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningHost]:
    """A host at work, on which one bad payload after the other is tried."""
    with running(tmp_path_factory.mktemp("bad")) as host:
        host.bring("talk", talker())
        host.bring("write", scribe())
        host.until_goal(host.want("(written spot)"), "holds")
        yield host


@pytest.fixture
def healthy_go_on(host: RunningHost) -> Iterator[None]:
    """What is healthy works on as if nothing had happened, and nothing bad stays when pulled."""
    traces, workers, steps = host.traces(), healthy(host), host.view["plan"]["steps"]
    known = len(host.journal("scribe"))
    yield
    assert healthy(host) == workers
    assert host.view["plan"]["steps"] == steps
    assert len(host.journal("scribe")) == known
    host.pull("bad")
    host.until("gone", lambda view: bad_one(view) is None)
    assert host.traces() == traces


@pytest.mark.usefixtures("healthy_go_on")
@pytest.mark.parametrize(
    "bad", [bad for bad in WAYS if bad.id in ONE_OF_EACH_PHASE], ids=lambda bad: bad.id
)
def test_bad_payload_is_told_with_its_code(host: RunningHost, bad: Bad, tmp_path: Path) -> None:
    told, known = host.told_number(), len(host.journal(BAD))
    bad.write(tmp_path / "bad")
    host.plug(tmp_path / "bad")
    row = host.until("judged", judged, timeout_s=READY_S)
    assert host.until_told(f": {bad.code} ", since=told).startswith(BAD)
    assert (row["state"], set(row["codes"])) == (bad.step.value, {bad.code})
    assert host.view["state"] == "ready, with problems"
    assert set(row["problems"]) == set(host.ask("why")["problems"])
    (entry,) = (e for e in host.journal(BAD)[known:] if e["problems"])
    assert {problem["code"] for problem in entry["problems"]} == {bad.code}
    assert host.component("bad") is None


def test_plugin_that_hangs_when_it_starts_is_given_up(tmp_path: Path) -> None:
    (bad,) = (bad for bad in WAYS if bad.id == "hang-at-start")
    bad.write(tmp_path / "bad")
    with running(tmp_path / "host", more=IMPATIENT) as host:
        before = host.holdings()
        host.plug(tmp_path / "bad")
        row = host.until("judged", judged, timeout_s=READY_S)
        assert (row["state"], row["codes"]) == (bad.step.value, [bad.code])
        host.until_told(f": {bad.code} ")
        host.clear()
        until_nothing_is_left(host, before)


@pytest.mark.usefixtures("healthy_go_on")
def test_plugin_that_ends_again_and_again_is_quarantined(host: RunningHost, tmp_path: Path) -> None:
    make_payload(tmp_path / "bad", bare(EXITS_LATER), payload_id=BAD)
    host.plug(tmp_path / "bad")
    row = host.until_component("bad", "quarantined")
    assert row["problem"].startswith("WORKER_CRASH_LOOP")
    assert "WORKER_CRASH_LOOP" in str(host.ask("why")["problems"])
    assert "WORKER_CRASH_LOOP" in str(host.journal("bad"))


@pytest.mark.usefixtures("healthy_go_on")
def test_command_line_shows_what_is_wrong(host: RunningHost, tmp_path: Path) -> None:
    make_payload(
        tmp_path / "bad", bare(""), payload_id=BAD, requires='python = ">=3.99"', release=2
    )
    host.plug(tmp_path / "bad")
    host.until("judged", judged, timeout_s=READY_S)
    for command in (["status"], ["why"], ["journal", "--subject", BAD]):
        assert "PYTHON_VERSION" in nondum("--control", host.control, *command)


def judged(view: Row) -> Row | None:
    """The bad payload, once the host is done with it."""
    found = bad_one(view)
    return found if found and found["state"] in ("refused", "quarantined") else None


def bad_one(view: Row) -> Row | None:
    """The bad payload."""
    return next((row for row in view["payloads"] if row["payload"] == BAD), None)


def healthy(host: RunningHost) -> list[Row]:
    """The healthy components, with their processes."""
    return [row for row in host.components() if row["component"] in HEALTHY]
