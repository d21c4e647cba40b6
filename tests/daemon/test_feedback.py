"""A host without a screen: its states reach an integrator's program, and what fails is told."""

from __future__ import annotations

import json
import sys
import sysconfig
from pathlib import Path
from typing import Any

from tests.daemon.neighbours import BEACON, UNCONFINED
from tests.kit.payloads import Part
from tests.kit.running_host import COMMAND, READY_S, RunningHost, running
from tests.kit.until import until


def hook(work: Path, text: str) -> Path:
    """A program that is told the host's states."""
    path = work / "hook"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def feedback(*lines: str) -> str:
    return "\n".join((UNCONFINED, "[feedback]", *lines, ""))


def without(distribution: str, work: Path) -> tuple[str, ...]:
    """The program of a daemon in this environment, but for one distribution."""
    installed, folder = Path(sysconfig.get_path("purelib")), work / "site-packages"
    folder.mkdir()
    for path in installed.iterdir():
        if distribution not in path.name:
            (folder / path.name).symlink_to(path)
    main = f"""
import sys
sys.path[sys.path.index({str(installed)!r})] = {str(folder)!r}
from nondum.cli import main
sys.exit(main())
"""
    return (sys.executable, "-c", main, "host", "run", "--user")


def until_warned(host: RunningHost, words: str) -> None:
    def found(view: Any) -> bool:
        return any(words in warning for warning in view["warnings"])

    host.until(f"warned: {words}", found, timeout_s=READY_S)


def test_a_program_is_told_how_a_payload_fares(tmp_path: Path) -> None:
    told = tmp_path / "told"
    more = feedback(f'hook = ["{hook(tmp_path, f"cat >> {told}")}"]', "hook_deadline_s = 600")
    source = BEACON.replace("LAMP", "light").replace("LOST", "stop")
    with running(tmp_path, more=more, program=COMMAND) as host:
        host.bring("beacon", Part("beacon", source.replace("LOG", str(tmp_path / "log"))))
        host.until("safe", lambda v: v["feedback"]["state"] == "safe-to-remove", timeout_s=READY_S)
        host.drive("wrong", manifest="no toml")
        host.plug(tmp_path / "drives/wrong")
        host.until("refused", lambda v: v["feedback"]["state"] == "refused", timeout_s=READY_S)
        until("the program is told", lambda: "refused" in told.read_text())
    states = [json.loads(line) for line in told.read_text().splitlines()]
    assert states[-1]["state"] == "refused"
    assert (states[-1]["code"], states[-1]["payload"]) == ("MANIFEST_TOML", "org.example.wrong")
    assert "working" in [state["state"] for state in states]


def test_what_cannot_be_shown_is_told_in_every_status(tmp_path: Path) -> None:
    broken = hook(tmp_path, "exit 7")
    more = feedback(f'hook = ["{broken}"]', 'lamps = ["no-such-lamp"]', 'player = ["/no/player"]')
    with running(tmp_path, more=more) as host:
        for words in ("ended with status 7", "LAMP_MISSING no-such-lamp", "SOUND_FAILED"):
            until_warned(host, words)
        hook(tmp_path, "exit 0")
        host.drive("wrong", manifest="no toml")
        host.plug(tmp_path / "drives/wrong")
        host.until(
            "the hook works again",
            lambda view: not any("status 7" in warning for warning in view["warnings"]),
            timeout_s=READY_S,
        )
        assert host.log.count("LAMP_MISSING") == 1


def test_lamps_and_sounds_that_lack_their_extension_are_told_in_every_status(
    tmp_path: Path,
) -> None:
    more = feedback('lamps = ["ACT"]', 'player = ["/no/player"]')
    with running(tmp_path, more=more, program=without("nondum_host_lamps", tmp_path)) as host:
        for key in ("lamps", "player"):
            until_warned(host, f"EXTENSION_MISSING feedback.{key}")


def test_what_was_told_of_a_drive_that_is_pulled_is_not_shown_any_more(tmp_path: Path) -> None:
    told = "drive photos carries no payload"
    (tmp_path / "drives/photos").mkdir(parents=True)
    with running(tmp_path) as host:
        host.plug(tmp_path / "drives/photos")
        host.until_told(told)
        assert told in host.run("status").ok().out
        host.pull("photos")
        host.until("it is over", lambda v: any(r["over"] for r in v["told"] if r["text"] == told))
        assert told not in host.run("status").ok().out
