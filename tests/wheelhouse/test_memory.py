"""Memory and GPU memory: what is free and not promised to others is there for one more payload."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.golden import Golden

from nondum.wheelhouse.format.manifest import Requires
from nondum.wheelhouse.payload import memory
from nondum.wheelhouse.payload.gpu import Gpu
from nondum.wheelhouse.payload.memory import Memory, Promised

MB = st.integers(0, 10_000)
PLENTY = 10**9


def told(needs: Requires, have: Memory) -> list[str]:
    return [str(problem) for problem in memory.problems(needs, have, "org.example.x")]


def test_memory_reserved_for_other_components_is_reported_with_a_fix(golden: Golden) -> None:
    needs = Requires(memory_mb=600, gpu_memory_mb=600)
    have = Memory(1000, Gpu(1000, 1000), Promised(700, 500, 450, ("a",), ("a", "b")))
    short, gpu_short = memory.problems(needs, have, "org.example.x")
    assert (short.code, short.need, short.have) == ("NO_MEMORY", "600 MB", "500 MB")
    golden.check("memory is promised to one", f"{short.message} → {short.fix}")
    assert (gpu_short.code, gpu_short.need, gpu_short.have) == (
        "NO_GPU_MEMORY",
        "600 MB",
        "550 MB",
    )
    golden.check("GPU memory is promised to two", f"{gpu_short.message} → {gpu_short.fix}")


def test_of_many_who_hold_it_some_are_told(golden: Golden) -> None:
    have = Memory(1000, promised=Promised(900, 900, holders=tuple("abcde")))
    (short,) = memory.problems(Requires(memory_mb=600), have, "org.example.x")
    golden.check("memory is promised to many", short.message)


def test_fix_names_no_components_where_none_holds_memory(golden: Golden) -> None:
    needs = Requires(memory_mb=2000, gpu_memory_mb=1)
    short, gpu_short = memory.problems(needs, Memory(1000), "org.example.x")
    golden.check("memory is short", f"{short.message} → {short.fix}")
    golden.check("GPU memory is short", f"{gpu_short.message} → {gpu_short.fix}")


def test_memory_in_use_is_not_counted_twice() -> None:
    assert told(Requires(memory_mb=500), Memory(500, promised=Promised(700, 0))) == []


@pytest.mark.parametrize(("kind", "codes"), [("", []), ("cuda", []), ("v3d", ["NO_GPU_KIND"])])
def test_gpu_of_another_kind_will_not_do(kind: str, codes: list[str]) -> None:
    have = Memory(PLENTY, Gpu(4000, 4000, kinds=("cuda", "opencl")))
    needs = Requires(gpu_memory_mb=1000, gpu_kind=kind)
    assert [problem.code for problem in memory.problems(needs, have, "org.example.x")] == codes


@pytest.mark.parametrize(("kind", "codes"), [("", ["NO_GPU_MEMORY"]), ("opencl", [])])
def test_gpu_that_has_opencl_only_is_taken_by_who_asks_for_that(
    kind: str, codes: list[str]
) -> None:
    have = Memory(PLENTY, Gpu(4000, 8000, is_shared=True, kinds=("opencl",)))
    needs = Requires(gpu_memory_mb=1000, gpu_kind=kind)
    assert [problem.code for problem in memory.problems(needs, have, "org.example.x")] == codes


def test_only_the_sum_of_all_gpu_memory_reservations_is_known() -> None:
    """What is free may be what others have not taken yet, and what they have taken is not free."""
    unused = Memory(PLENTY, Gpu(4000, 4000), Promised(gpu_memory_mb=3000))
    used = Memory(PLENTY, Gpu(1000, 4000), Promised(gpu_memory_mb=3000))
    for have in (unused, used):
        assert told(Requires(gpu_memory_mb=1000), have) == []
        assert told(Requires(gpu_memory_mb=1001), have) != []


BOARD = Memory(4000, Gpu(4000, 8000, is_shared=True))


@pytest.mark.parametrize(
    ("memory_mb", "gpu_mb", "codes"),
    [
        (2000, 2000, []),
        (2001, 2000, ["NO_GPU_MEMORY"]),
        (4001, 0, ["NO_MEMORY"]),
        (4001, 1, ["NO_MEMORY", "NO_GPU_MEMORY"]),
    ],
)
def test_a_gpu_that_shares_memory_has_it_from_the_payloads_own(
    memory_mb: int, gpu_mb: int, codes: list[str]
) -> None:
    found = memory.problems(Requires(memory_mb=memory_mb, gpu_memory_mb=gpu_mb), BOARD, "x")
    assert [problem.code for problem in found] == codes


def test_gpu_memory_that_is_shared_is_promised_out_of_the_systems() -> None:
    have = replace(BOARD, promised=Promised(1000, 0, 6000))
    assert told(Requires(memory_mb=1000), have) == []
    assert told(Requires(memory_mb=1001), have) != []


@given(free=MB, gpu_free=MB, gpu_used=MB, shared=st.booleans(), old=st.tuples(MB, MB), need=MB)
def test_an_upgrade_finds_what_the_release_before_it_leaves(
    free: int, gpu_free: int, gpu_used: int, shared: bool, old: tuple[int, int], need: int
) -> None:
    """Whatever fits beside the old one fits as well in its place, and nothing is made up."""
    gpu = Gpu(gpu_free, gpu_free + gpu_used, is_shared=shared)
    have = Memory(free, gpu)
    after = have.with_freed(*old)
    assert have.left_mb() <= after.left_mb() <= free + sum(old)
    assert have.gpu_left_mb(need) <= after.gpu_left_mb(need) <= gpu.total_mb


@given(free=MB, total=MB, gpu_total=MB, shared=st.booleans(), first=st.tuples(MB, MB), own=MB)
def test_what_was_promised_is_not_promised_again(
    free: int, total: int, gpu_total: int, shared: bool, first: tuple[int, int], own: int
) -> None:
    """Two that are let in one after the other fit together, before either has used anything."""
    free = min(free, total)
    system = Gpu(free, total, is_shared=True) if shared else Gpu(gpu_total, gpu_total)
    have = Memory(free, system)
    one = Requires(memory_mb=first[0], gpu_memory_mb=first[1])
    if told(one, have):
        return
    then = replace(have, promised=Promised(first[0], first[0], first[1]))
    gpu_left = then.gpu_left_mb(own)
    if shared:
        assert then.left_mb() + first[0] <= free
    else:
        assert then.left_mb() == free - first[0]
        assert gpu_left == gpu_total - first[1]


def test_looking_sees_this_machine() -> None:
    have = memory.look()
    all_mb = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") >> 20
    assert 0 < have.left_mb() <= all_mb
    assert have.promised == Promised()
