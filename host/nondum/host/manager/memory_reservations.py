"""Memory that is reserved for the payloads of this host, so that no two count on the same.

What a payload's manifest asks for is reserved when it is let in, until nothing of it runs any
more. What it uses by now is not free anyway; the rest is kept for it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any

from nondum.host.core.keyed_queues import in_thread
from nondum.host.manager.headroom import Needs, used_mb, why_not_beside
from nondum.wheelhouse.payload.gpu import Gpu
from nondum.wheelhouse.payload.memory import Memory, Promised, free_memory_mb

NOTHING = Needs()


class MemoryReservations:
    """Payload key → what is reserved for it; `pids_of` tells which processes are a payload's."""

    def __init__(self, pids_of: Callable[[str], Collection[int]]) -> None:
        self._pids_of = pids_of
        self._made: dict[str, Needs] = {}
        self._gpu: Gpu | None = None

    def make(self, payload: str, needs: Needs) -> None:
        """Reserve what a payload needs, instead of what was reserved for it before."""
        self._made[payload] = needs

    def give_up(self, payload: str) -> None:
        """Give up what is reserved for a payload, if anything is."""
        self._made.pop(payload, None)

    def saw_gpu(self, gpu: Gpu | None) -> None:
        """Remember the GPU as a child saw it: a daemon does not look itself."""
        self._gpu = gpu

    @property
    def gpu_mb(self) -> int:
        """GPU memory that there is in all, as far as it was seen."""
        return self._gpu.total_mb if self._gpu is not None else 0

    async def headroom(self, payload: str, beside: str) -> dict[str, Any]:
        """The memory that the jobs `copy` and `install` may count on: what other payloads were
        promised, and what becomes free when the release `beside` stops."""
        used = await self._used_mb((*self._made, beside))
        return {
            "promised": asdict(total(self._needs_of_all_but(payload, beside), used)),
            "freed_mb": used[beside],
            "freed_gpu_mb": self._made.get(beside, NOTHING).gpu_memory_mb,
        }

    async def why_not_beside(self, payload: str, beside: str) -> str:
        """Why a payload cannot run beside a release of it that goes on meanwhile; "": it can.

        That one's GPU memory stays its own, since it is not known how much it uses.
        """
        used = await self._used_mb((*self._made, beside))
        promised = total(self._needs_of_all_but(payload, beside), used)
        old_gpu_mb = self._made.get(beside, NOTHING).gpu_memory_mb
        promised = replace(promised, gpu_memory_mb=promised.gpu_memory_mb + old_gpu_mb)
        have = Memory(free_memory_mb(), self._gpu, promised)
        return why_not_beside(self._made[payload], used[beside], have)

    def _needs_of_all_but(self, *payloads: str) -> dict[str, Needs]:
        return {key: needs for key, needs in self._made.items() if key not in payloads}

    async def _used_mb(self, payloads: Iterable[str]) -> dict[str, int]:
        pids = {payload: self._pids_of(payload) for payload in payloads}
        return await in_thread(lambda: {key: used_mb(found) for key, found in pids.items()})


def total(made: Mapping[str, Needs], used_mb: Mapping[str, int]) -> Promised:
    """Promises together; `used_mb` is what the workers of each payload use now.

    >>> made = {"1": Needs("a", memory_mb=500), "2": Needs("b", memory_mb=100, gpu_memory_mb=50)}
    >>> total(made, {"1": 200, "2": 300})
    Promised(memory_mb=600, unused_mb=300, gpu_memory_mb=50, holders=('a',), gpu_holders=('b',))
    """
    unused = {key: max(0, n.memory_mb - used_mb.get(key, 0)) for key, n in made.items()}
    gpu = {key: needs.gpu_memory_mb for key, needs in made.items()}
    return Promised(
        memory_mb=sum(needs.memory_mb for needs in made.values()),
        unused_mb=sum(unused.values()),
        gpu_memory_mb=sum(gpu.values()),
        holders=_holders(made, unused),
        gpu_holders=_holders(made, gpu),
    )


def _holders(made: Mapping[str, Needs], held_mb: Mapping[str, int]) -> tuple[str, ...]:
    """Who holds some of it, most first."""
    most_first = sorted(held_mb, key=lambda key: (-held_mb[key], key))
    return tuple(dict.fromkeys(made[key].payload_id for key in most_first if held_mb[key]))
