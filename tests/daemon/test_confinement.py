"""A host without bubblewrap restricts its workers, and takes no payload that demands more."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from demo.robot import View
from tests.daemon.plugins import talker
from tests.kit.running_host import READY_S, Row, RunningHost, payload, running

pytestmark = pytest.mark.daemon


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningHost]:
    """A host that finds no bubblewrap."""
    folder = tmp_path_factory.mktemp("host")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", str(folder))
        with running(folder) as host:
            yield host


def test_status_names_the_level_and_what_a_higher_one_takes(host: RunningHost) -> None:
    confinement = host.ask("status")["confinement"]
    assert confinement["level"] == "restricted"
    (missing,) = confinement["missing"]
    assert (missing["level"], missing["available"]) == ("sandboxed", False)
    assert missing["fix"] == "apt install bubblewrap"


@pytest.mark.parametrize("demand", ['"restricted"', "1", '"none"', "0"])
def test_payload_that_demands_no_more_is_at_work_there(host: RunningHost, demand: str) -> None:
    host.bring("talker", talker(), requires=f"confinement = {demand}")
    assert host.until_component("talker", "ready")["confinement"] == "restricted"
    host.clear()
    host.forget()


@pytest.mark.parametrize("demand", ['"sandboxed"', "3", "2"])
def test_payload_that_demands_more_is_refused(host: RunningHost, demand: str) -> None:
    host.plug(host.drive("talker", talker(), requires=f"confinement = {demand}"))
    row = host.until("a refusal", _refused, timeout_s=READY_S)
    assert row["codes"] == ["CONFINEMENT"]
    host.clear()
    host.forget()


def _refused(view: View) -> Row | None:
    row = payload(view, "talker")
    return row if row is not None and row["state"] == "refused" else None
