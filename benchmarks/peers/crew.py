"""The hosts of one measurement: separate processes, which trust each other."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.peers.ground import NAMES, Ground

from nondum.transport.peers import HostKeys

ROOT = Path(__file__).parents[2]
PATIENCE_S = 15.0
Told = dict[str, Any]


class NotSeen(Exception):
    """An event has not come within `PATIENCE_S`."""


class Host:
    """A process of `benchmarks.peers.member`, and all that it has told."""

    def __init__(self, name: str, command: Sequence[str]) -> None:
        self.name = name
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, text=True)
        self._told: list[Told] = []
        self._has_news = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Of its process."""
        return self._process.pid

    def order(self, do: str) -> None:
        """Have it do something."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{do}\n")
        self._process.stdin.flush()

    def find(self, event: str, peer: Host | None = None, *, after_s: float = 0.0) -> Told:
        """The first such event after a moment; waits for it. Raises `NotSeen`."""

        def found() -> Told | None:
            for told in self._told:
                is_it = (told["event"], told.get("peer")) == (event, peer and peer.name)
                if is_it and told["at_s"] >= after_s:
                    return told
            return None

        with self._has_news:
            told = self._has_news.wait_for(found, PATIENCE_S)
        if told is None:
            raise NotSeen(f"{self.name}: {event}")
        return told

    def end(self) -> None:
        """Kill it, if it runs still."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with self._has_news:
                self._told.append(json.loads(line))
                self._has_news.notify()


@contextlib.contextmanager
def crew(ground: Ground, count: int) -> Iterator[tuple[Host, ...]]:
    """Start `count` processes of hosts, each of which knows the keys of the others only."""
    keys = {name: HostKeys.generate() for name in NAMES[:count]}
    trusted = {one.public: name for name, one in keys.items()}
    with contextlib.ExitStack() as stack:
        hosts = []
        for number, (name, own) in enumerate(keys.items()):
            config = {
                "name": name,
                "public": own.public,
                "secret": own.secret,
                "trusted": trusted,
                "listen": ground.listen,
            }
            words = (sys.executable, "-m", "benchmarks.peers.member", json.dumps(config))
            host = Host(name, ground.command(number, *words))
            stack.callback(host.end)
            hosts.append(host)
        for host in hosts:
            host.find("ready")
        yield tuple(hosts)
