"""A daemon in safe mode says so wherever it is asked, and leaves it when it is told to."""

from __future__ import annotations

import re
from pathlib import Path

from demo.robot import View
from tests.kit.beacon import BEACON
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import DAEMON, running

from nondum.host.lifecycle.safe_mode import DEATHS


def test_after_so_many_deaths_payloads_of_drives_are_left_alone(
    tmp_path: Path, golden: Golden
) -> None:
    """Until a person says otherwise; deaths that are asked for do not count."""

    def with_problems(view: View) -> View | None:
        return view if any(row["problems"] for row in view["drives"]) else None

    with running(tmp_path) as host:
        host.bring("beacon", Part("beacon", BEACON))
        host.kill()
        (host.state / "deaths").write_text(f"{DEATHS}\n", encoding="ascii")
        host.start()
        view = host.until("the drive has problems", with_problems)
        assert (view["safe_mode"], view["state"][:9]) == ("initial", "safe mode")
        assert view["components"] == []
        (row,) = view["payloads"]
        assert (row["state"], row["codes"]) == ("quarantined", ["SAFE_MODE"])
        shown = " ".join(host.run("status").ok().out.split())
        assert re.search(rf"warning: SAFE_MODE .*\b{DEATHS}\b", shown)
        assert "SafeModeEntered" in host.run("journal", "--limit", "1000").ok().out
        golden.check_line("safe mode is left", host.run("host", "resume").ok().out)
        host.until(
            "the beacon is active",
            lambda view: [row["state"] for row in view["payloads"]] == ["active"],
        )
        assert host.run("status", "--json").json["safe_mode"] == "off"
        host.run("host", "resume").refused(1, "SAFE_MODE_OFF")
        golden.check_line("nothing to resume", host.run("host", "resume", "--all").ok().out)
    assert not (host.state / "deaths").exists()


def test_a_person_asks_for_it_as_the_host_is_started(tmp_path: Path, golden: Golden) -> None:
    def safe(view: View) -> View | None:
        return view if view["safe_mode"] != "off" else None

    with running(tmp_path, program=(*DAEMON, "--safe=nothing")) as host:
        view = host.until("safe mode", safe)
        assert view["safe_mode"] == "nothing"
        golden.check_line("a person asked for safe mode", "\n".join(view["warnings"]))
    nondum("host", "run", "--user", "--safe=most").refused(2, "'initial', 'nothing'")
