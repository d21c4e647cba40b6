"""Starts processes that are hosts, and talks with them."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

TOGETHER = 8
"""Hosts that start at the same time, or their self-tests would be late."""


@dataclass
class Child:
    """A process that reads commands, one a line; its name is that of its first host."""

    process: subprocess.Popen[str]
    name: str
    addresses: list[str] = field(default_factory=list)

    def order(self, do: str, **more: Any) -> None:
        self.say({"do": do, **more})

    def say(self, what: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(what) + "\n")
        self.process.stdin.flush()

    def answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        answer: dict[str, Any] = json.loads(self.process.stdout.readline())
        return answer


@contextlib.contextmanager
def children(kinds: list[tuple[str, Any]]) -> Iterator[list[Child]]:
    with contextlib.ExitStack() as stack:
        started = []
        for kind, config in kinds:
            command = [sys.executable, "-m", "benchmarks.fleet.host", kind]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            stack.enter_context(process)
            stack.callback(process.kill)
            started.append(Child(process, config[0]["name"] if kind != "router" else kind))
            started[-1].say(config)
            if len(started) % TOGETHER == 0 or len(started) == len(kinds):
                for one in started[-TOGETHER:]:
                    one.addresses = one.addresses or one.answer()["addresses"]
        yield started
