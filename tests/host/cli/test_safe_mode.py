"""A daemon in safe mode says so wherever it is asked, and leaves it when it is told to."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

from tests.host.cli.daemon import (
    BEACON,
    BEACON_ID,
    Daemon,
    command,
    killed,
    nondum,
    quiet_environment,
    running,
)
from tests.kit.payloads import Part

from nondum.host.lifecycle.safe_mode import DEATHS


def test_after_so_many_deaths_payloads_of_drives_are_left_alone(tmp_path: Path) -> None:
    """Until a person says otherwise; deaths that are asked for do not count."""
    with killed(tmp_path) as daemon:
        daemon.plug(BEACON_ID, Part("beacon", BEACON))
        daemon.until_state(BEACON_ID, "active")
    (tmp_path / "state/deaths").write_text(f"{DEATHS}\n", encoding="ascii")
    with running(tmp_path) as daemon:
        view = daemon.until(lambda view: any(row["problems"] for row in view["drives"]))
        assert (view["safe_mode"], view["state"][:9]) == ("initial", "safe mode")
        assert view["components"] == []
        (row,) = view["payloads"]
        assert (row["state"], row["codes"]) == ("quarantined", ["SAFE_MODE"])
        shown = " ".join(daemon.run("status").ok().out.split())
        assert (
            f"warning: SAFE_MODE payloads of drives and other hosts are left alone: {DEATHS}"
            in (shown)
        )
        assert "SafeModeEntered" in daemon.run("journal", "--limit", "1000").ok().out
        assert "safe mode is left" in daemon.run("host", "resume").ok().out
        daemon.until_state(BEACON_ID, "active")
        assert daemon.run("status", "--json").json["safe_mode"] == "off"
        daemon.run("host", "resume").refused(1, "SAFE_MODE_OFF")
    assert not (tmp_path / "state/deaths").exists()


def test_a_person_asks_for_it_as_the_host_is_started(tmp_path: Path) -> None:
    with running(tmp_path):
        pass
    process = subprocess.Popen(
        command("host", "run", "--user", "--config", tmp_path / "host.toml", "--safe=nothing"),
        stderr=subprocess.PIPE,
        text=True,
        env=quiet_environment(),
    )
    daemon = Daemon(tmp_path, process)
    assert process.stderr is not None
    with process:
        try:
            assert any("listens at" in line for line in process.stderr)
            view = daemon.until(lambda view: view["safe_mode"] != "off")
            assert view["safe_mode"] == "nothing"
            assert "a person asked for it" in " ".join(view["warnings"])
        finally:
            process.send_signal(signal.SIGTERM)
    nondum("host", "run", "--user", "--safe=most").refused(2, "'initial', 'nothing'")
