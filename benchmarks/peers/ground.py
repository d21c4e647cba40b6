"""Where the hosts that are measured run: each on a separate machine, or all on this one."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

from demo.namespaces import Machine, NamespacesUnavailable, Network

NAMES = ("first", "second", "third")


@dataclass(frozen=True)
class Ground:
    """Places for three hosts."""

    described: str
    listen: str
    machines: tuple[Machine, ...] = ()
    """None where all hosts are on this machine."""

    def command(self, number: int, *words: str) -> list[str]:
        """What runs a command at a place."""
        return self.machines[number].command(*words) if self.machines else list(words)

    @contextlib.contextmanager
    def unplugged(self, number: int) -> Iterator[None]:
        """Without the cable of a machine."""
        cable = self.machines[number].cables[0]
        cable.pull()
        try:
            yield
        finally:
            cable.put_back()


LOOPBACK = Ground("all on one machine, by loopback", "tcp://127.0.0.1:0")


@contextlib.contextmanager
def ground() -> Iterator[Ground]:
    """Machines on one switch, as network namespaces of this one, where it may have them."""
    with contextlib.ExitStack() as stack:
        try:
            machines = stack.enter_context(Network()).lan(*NAMES)
        except NamespacesUnavailable:
            yield LOOPBACK
        else:
            told = "each on a separate machine (network namespaces on one switch)"
            yield Ground(told, "tcp://*:7410", machines)
