"""All connections are looked at when memory grows, and each in turn when it does not."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.transport.peers.connection_checks import GROWN_BYTES, LOOKS, Looks

CONNECTIONS = st.integers(0, 300).map(range)
MEMORY = st.integers(0, 1 << 40)


@given(connections=CONNECTIONS, memory=MEMORY, before=st.integers(0, 2 * LOOKS))
def test_each_has_its_turn_within_some_looks(connections: range, memory: int, before: int) -> None:
    looks = Looks()
    for _ in range(before):
        looks.due(connections, memory)
    seen = [one for _ in range(2 * LOOKS) for one in looks.due(connections, memory)]
    assert set(seen) == set(connections)


@given(connections=CONNECTIONS, memory=MEMORY)
def test_a_look_takes_a_few_only_while_memory_is_as_it_was(connections: range, memory: int) -> None:
    looks = Looks()
    for _ in range(LOOKS):
        assert len(looks.due(connections, memory)) <= 1 + len(connections) // LOOKS


@given(
    connections=CONNECTIONS,
    least=MEMORY,
    more=st.lists(st.integers(0, GROWN_BYTES - 1), max_size=5),
)
def test_all_are_looked_at_once_there_is_more_memory_than_there_was_at_least(
    connections: range, least: int, more: list[int]
) -> None:
    looks = Looks()
    for each in (0, *more):
        looks.due(connections, least + each)
    assert looks.due(connections, least + GROWN_BYTES) == connections
    assert len(looks.due(connections, least + GROWN_BYTES)) <= 1 + len(connections) // LOOKS
