"""Starts processes that are hosts, and talks with them."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

TOGETHER = 8
"""Hosts that start at the same time, or their self-tests would be late."""


@dataclass
class Child:
    """A process that reads commands, one a line."""

    process: subprocess.Popen[str]
    name: str
    address: str = ""

    def order(self, do: str, **more: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps({"do": do, **more}) + "\n")
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
            command = [sys.executable, "-m", "benchmarks.fleet.host", kind, json.dumps(config)]
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
            stack.enter_context(process)
            stack.callback(process.kill)
            started.append(Child(process, config["name"] if kind != "router" else kind))
            if len(started) % TOGETHER == 0 or len(started) == len(kinds):
                for one in started[-TOGETHER:]:
                    one.address = one.address or one.answer()["address"] or "-"
        yield started
