"""A host on another machine, as tests see it."""

from __future__ import annotations

import itertools
import json
import os
import queue
import subprocess
import threading
from pathlib import Path
from typing import Any

from demo.namespaces import Cable, Machine
from tests.kit.fork_server import Forked
from tests.kit.on_machine import started
from tests.kit.until import PATIENCE_S, until

from nondum.transport.peers import HostKeys

PORT = 7410

Told = dict[str, Any]


class Member:
    """One host: a process of `tests.daemon.peer_faults.member`; it can be killed and restarted."""

    def __init__(self, machine: Machine, keys: HostKeys, config: Told) -> None:
        self.name = machine.name
        self.machine, self.keys = machine, keys
        self.config = config
        self.epoch = 0
        """Of the life that it has now."""
        self.killed: set[int] = set()
        """Epochs of those that it has lost without a word."""
        self._ids = itertools.count(1)
        self._process: Forked | None = None
        self._told: queue.SimpleQueue[Told] = queue.SimpleQueue()
        self._answers: dict[int, queue.SimpleQueue[Told]] = {}
        self._reader: threading.Thread | None = None
        self.broken: list[str] = []
        """What went wrong in it that no fault of others may bring about."""

    @property
    def cable(self) -> Cable:
        return self.machine.cables[0]

    @property
    def address(self) -> str:
        return f"tcp://{self.cable.address}:{PORT}"

    @property
    def pid(self) -> int:
        assert self._process is not None
        return self._process.pid

    def start(self, **changes: Any) -> int:
        """Start it, `changes` being of its configuration, and wait until it listens; its epoch."""
        self.launch(**changes)
        return self.await_start()

    def launch(self, **changes: Any) -> None:
        """Start its process, `changes` being of its configuration."""
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        config = json.dumps({**self.config, **changes})
        self._process = started(self.machine, "tests.daemon.peer_faults.member", config, **pipes)
        self.forget()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def await_start(self) -> int:
        """Wait until it listens; its epoch."""
        self.epoch = int(self.next("started")["epoch"])
        return self.epoch

    def kill(self) -> None:
        """End it without a word."""
        assert self._process is not None
        self.killed.add(self.epoch)
        self._process.kill()
        self._see_end()

    def leave(self) -> None:
        """Have it say goodbye and end."""
        self.order("leave")
        self._see_end()

    def forget(self) -> None:
        """What it told until now is of no interest."""
        self._told = queue.SimpleQueue()

    def next(self, event: str, **wanted: Any) -> Told:
        """Wait for an event with these values; others before it are dropped."""
        while True:
            told = self._told.get(timeout=PATIENCE_S)
            assert told["event"] != "ended", f"{self.name} has ended"
            if told["event"] == event and wanted.items() <= told.items():
                return told

    def meets(self, other: Member) -> Told:
        """Wait until another host is there."""
        return self.next("up", peer=other.name)

    def loses(self, other: Member) -> Told:
        """Wait until another host is not there any more."""
        return self.next("lost", peer=other.name)

    def order(self, do: str, **arguments: Any) -> queue.SimpleQueue[Told]:
        """Have it do something; where the answer will be."""
        number = next(self._ids)
        answer = self._answers[number] = queue.SimpleQueue()
        assert self._process is not None
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"id": number, "do": do, **arguments}) + "\n")
        self._process.stdin.flush()
        return answer

    def ask(self, do: str, **arguments: Any) -> Told:
        """Have it do something, and wait for the answer."""
        return taken(self.order(do, **arguments))

    def call(self, other: Member, method: str, **args: Any) -> Told:
        """Have it call another host: `answer` or `failure`."""
        return self.ask("call", peer=other.name, method=method, args=args, deadline_s=10)

    def weight_kb(self) -> int:
        """Memory that it has filled: its share (PSS) of what is no file's."""
        lines = Path(f"/proc/{self.pid}/smaps_rollup").read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("Pss_Anon:"))

    def forget_peak(self) -> None:
        """Have `peak_kb` begin again, at what it has now (proc(5), clear_refs)."""
        Path(f"/proc/{self.pid}/clear_refs").write_text("5", encoding="ascii")

    def peak_kb(self) -> int:
        """The most memory that it had at any moment (resident set)."""
        lines = Path(f"/proc/{self.pid}/status").read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))

    def descriptors(self) -> int:
        """Files and sockets that it has open."""
        return len(os.listdir(f"/proc/{self.pid}/fd"))  # noqa: PTH208  # links that may be gone

    def closes(self, most: int) -> None:
        """Wait until it has no more descriptors open than that."""
        until(
            f"{self.name}: at most {most} descriptors",
            lambda: self.descriptors() <= most,
            evidence=self.descriptors,
        )

    def _read(self) -> None:
        assert self._process is not None
        assert self._process.stdout is not None
        for line in self._process.stdout:
            told = json.loads(line)
            if told["event"] == "done":
                self._answers.pop(told["id"]).put(told)
            elif told["event"] == "broken":
                self.broken.append(told["what"])
            else:
                self._told.put(told)
        self._told.put({"event": "ended"})

    def _see_end(self) -> None:
        assert self._process is not None
        assert self._reader is not None
        self._process.wait(PATIENCE_S)
        self._reader.join()


def taken(answer: queue.SimpleQueue[Told]) -> Told:
    """Wait for the answer to an order."""
    told = answer.get(timeout=PATIENCE_S)
    assert "error" not in told, told["error"]
    return told
