"""Hosts on machines of their own, all on one switch, and what tests do with them."""

from __future__ import annotations

import itertools
import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from demo.namespaces import Cable, Machine, Network, Switch

from nondum.sdk.wire import Body
from nondum.transport.peers import HostKeys, PeerKey

PATIENCE_S = 30.0
PORT = 7410
FAILURES = {"PEER_LOST", "PEER_DOWN", "PEER_BUSY", "DEADLINE", "ANSWER_FORGOTTEN"}
"""What calls may fail with while links break."""

Told = dict[str, Any]
Catalogues = Mapping[str, Mapping[str, Body]]


class Member:
    """One host: a process of `tests.lab.faults.member`, which may be killed and started again."""

    def __init__(self, machine: Machine, keys: HostKeys, config: Told) -> None:
        self.name = machine.name
        self.machine, self.keys = machine, keys
        self.config = config
        self._ids = itertools.count(1)
        self._process: subprocess.Popen[str] | None = None
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
        """Start it, and wait until it listens; its epoch."""
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        config = json.dumps({**self.config, **changes})
        self._process = self.machine.python("tests.lab.faults.member", config, **pipes)
        self._told = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        return int(self.next("started")["epoch"])

    def kill(self) -> None:
        """End it without a word."""
        assert self._process is not None
        self._process.kill()
        self._see_end()

    def leave(self) -> None:
        """Have it say goodbye and end."""
        assert self._process is not None
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._see_end()

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
        told = self.order(do, **arguments).get(timeout=PATIENCE_S)
        assert "error" not in told, told["error"]
        return told

    def call(self, other: Member, method: str, **args: Any) -> Told:
        """Have it call another host: `answer` or `failure`."""
        return self.ask("call", peer=other.name, method=method, args=args, deadline_s=10)

    def weight_kb(self) -> int:
        """Memory that it has filled: its share (PSS) of what is no file's."""
        lines = Path(f"/proc/{self.pid}/smaps_rollup").read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("Pss_Anon:"))

    def descriptors(self) -> int:
        """Files and sockets that it has open."""
        return len(os.listdir(f"/proc/{self.pid}/fd"))  # noqa: PTH208  # links that may be gone

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


class Crew:
    """Hosts that trust each other and look for each other."""

    def __init__(self, network: Network, work: Path, names: Sequence[str], seed: int) -> None:
        self.work, self.seed = work, seed
        self.log = work / "calls"
        self.network = network
        self.switch: Switch = network.switch()
        keys = {name: HostKeys.generate() for name in names}
        paired = {one.public: name for name, one in keys.items()}
        self.members = [self._member(name, keys[name], paired) for name in names]

    def __iter__(self) -> Iterator[Member]:
        return iter(self.members)

    def start(self) -> None:
        """Start all, and wait until all see each other."""
        for member in self:
            member.start()
        self.all_see({member.name: {} for member in self})

    def all_see(self, catalogues: Catalogues, *, by: Sequence[Member] = ()) -> None:
        """Wait until all hosts (or those given) see exactly the others of these catalogues."""
        answers = [
            member.order(
                "see", catalogues={k: v for k, v in catalogues.items() if k != member.name}
            )
            for member in by or self.members
        ]
        for answer in answers:
            told = answer.get(timeout=PATIENCE_S)
            assert "error" not in told, told["error"]

    def live(self, *, change_s: float, ask_s: float) -> None:
        """Have all change their catalogues and call each other."""
        for member in self:
            member.ask("live", change_s=change_s, ask_s=ask_s)

    def rest(self) -> None:
        """Let all come to rest: everybody knows what everybody published last, and all work is
        done, none of it twice."""
        began_s = time.monotonic()
        self.all_see({name: told["published"] for name, told in self._all("still").items()})
        note(f"alike after {time.monotonic() - began_s:.2f} s")
        told = self._all("rest")
        self._all("idle")
        works = Counter(self.log.read_text(encoding="utf-8").splitlines())
        check(works, [piece for one in told.values() for piece in one["answered"]])
        for name, one in told.items():
            note(f"{name}: {len(one['answered'])} answered, {one['failed']}")
            assert one["failed"].keys() <= FAILURES, one["failed"]

    def _all(self, do: str) -> dict[str, Told]:
        answers = {member.name: member.order(do) for member in self}
        return {name: answer.get(timeout=PATIENCE_S) for name, answer in answers.items()}

    def _member(self, name: str, keys: HostKeys, paired: Mapping[PeerKey, str]) -> Member:
        machine = self.network.machine(name)
        self.network.plug(machine, self.switch)
        config = {
            "name": name,
            "public": keys.public,
            "secret": keys.secret,
            "certificate": "",
            "paired": {key: other for key, other in paired.items() if key != keys.public},
            "fleets": [],
            "port": PORT,
            "discover": True,
            "static": [],
            "skew_s": 0,
            "seed": f"{self.seed} {name}",
            "log": str(self.log),
        }
        return Member(machine, keys, config)


def note(text: str) -> None:
    """Tell a figure: pytest shows it with -s, and when the test fails."""
    sys.stdout.write(f"{text}\n")


def check(works: Counter[str], answered: Sequence[str]) -> None:
    """Of what was written down: nothing was done twice, nothing runs on, and what was answered was
    done."""
    begun = {line.removeprefix("begin ") for line in works if line.startswith("begin ")}
    ended = {line.removeprefix("end ") for line in works if line.startswith("end ")}
    assert [line for line, times in works.items() if times > 1] == []
    assert begun == ended, begun ^ ended
    assert set(answered) <= begun


@contextmanager
def crew(work: Path, *names: str, seed: int) -> Iterator[Crew]:
    """Hosts on one switch that all see each other."""
    with Network() as network:
        made = Crew(network, work, names, seed)
        made.start()
        yield made
        broken = [f"{member.name}: {what}" for member in made for what in member.broken]
        assert not broken, "\n".join(broken)


def until(holds: Callable[[], bool]) -> None:
    """Wait for what nobody tells: the machine's own state."""
    pause = threading.Event()
    for _ in range(int(PATIENCE_S / 0.05)):
        if holds():
            return
        pause.wait(0.05)
    raise AssertionError("it did not come about")
