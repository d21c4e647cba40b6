"""Hosts that the tests of one module share: nothing of one test is left for the next."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any, Generic, Self, TypeVar

from tests.kit.running_host import RunningHost
from tests.kit.until import until

T = TypeVar("T", bound=Iterable[object])


class Shared(Generic[T]):
    """Hosts that run from the first test that wants them. Use it as a context."""

    def __init__(self, start: Callable[[], AbstractContextManager[T]]) -> None:
        """`start` makes hosts, and what belongs to them; again, after something was left behind."""
        self._start = start
        self._running = ExitStack()
        self._lent: T | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    @contextmanager
    def lent(self) -> Iterator[T]:
        """Lend the hosts to one test, which is wrong if anything is left of it afterwards."""
        lent = self._lent = self._lent or self._running.enter_context(self._start())
        hosts = [host for host in lent if isinstance(host, RunningHost)]
        before = [host.holdings() for host in hosts]
        is_clean = False
        try:
            yield lent
            for host in hosts:
                host.clear()
            for host, found in zip(hosts, before, strict=True):
                until_nothing_is_left(host, found)
                host.forget()
            is_clean = True
        finally:
            if not is_clean:
                self.stop()

    def stop(self) -> None:
        """Stop the hosts."""
        self._lent = None
        self._running.close()


def until_nothing_is_left(host: RunningHost, before: Mapping[str, Any]) -> None:
    """Wait until a host has what it had, and no more. Raises `TooLate` with each difference."""

    def differences() -> list[str]:
        after = host.holdings()
        # What it warned of may have been put right, as that no trust was read yet.
        gone = before["warnings"] - after["warnings"]
        after["warnings"] |= gone
        different = [key for key in before if before[key] != after[key]]
        return [f"{key}: {before[key]} → {after[key]}" for key in different]

    def evidence() -> str:
        return "\n".join(("a test has left something behind", *differences()))

    until(f"{host.name} is as it was", lambda: not differences(), evidence=evidence)
