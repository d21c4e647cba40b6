"""A payload that cannot run where it is plugged in runs on a peer that can, for as long."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from tests.lab.neighbours import beacon, free_port, until_peer, until_shared, written
from tests.lab.running_host import DAEMON, RunningHost

pytestmark = pytest.mark.lab

OTHER_MACHINE = ("setarch", "linux32", *DAEMON)
"""A daemon that the kernel tells that it is on a 32-bit machine: wheels for this one do not fit."""


@contextmanager
def hosts(
    work: Path, *names: str, other_machines: Sequence[str] = (), more: str = ""
) -> Iterator[list[RunningHost]]:
    """Peers in development mode; some think that they are other machines."""
    ports = {name: free_port() for name in names}
    with ExitStack() as stack:
        made = []
        for name in names:
            others = [f"127.0.0.1:{port}" for other, port in ports.items() if other != name]
            (work / name).mkdir(parents=True)
            host = RunningHost(
                work / name,
                name=name,
                more=f"[peers]\nenabled = true\ndevelopment = true\ndiscover = false\n{more}\n"
                f'listen = ["tcp://127.0.0.1:{ports[name]}"]\nstatic = {others}\n',
                program=OTHER_MACHINE if name in other_machines else DAEMON,
            )
            stack.callback(host.stop)
            host.start()
            made.append(host)
        for host in made:
            for other in names:
                if other != host.name:
                    until_peer(host, other)
        yield made


def test_what_does_not_fit_here_runs_on_a_peer(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with hosts(tmp_path, "rover", "mule", other_machines=["rover"]) as (rover, mule):
        slot = rover.plug(rover.drive("light", beacon(log)))
        mule.until_step("light", "active")
        until_shared(rover, "beacon@mule")
        rover.until_told("org.example.light runs on mule, not here: needs wheels for")
        mule.until_told("org.example.light runs here for rover")
        given = rover.ask("goal", words="blink")
        rover.until_goal(given["id"], "reached")
        assert written(log) == ["blink"]
        rover.pull(slot)
        mule.until_gone("light")
        rover.until_gone("light")
        assert not list((mule.state / "placed").iterdir())
        assert not list((rover.state / "handover").iterdir())
