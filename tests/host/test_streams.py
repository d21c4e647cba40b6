"""Which optional input is fed by which stream: pure, whatever order things come in."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.streams import Socket, Source, optional_wires
from nondum.transport import Wire

NAMES = st.sampled_from(["a", "b", "c"])
TYPES = st.sampled_from(["pose", "depth"])
STREAMS = st.sampled_from(["s1", "s2", "s3"])
SOURCES = st.lists(st.builds(Source, STREAMS, TYPES, NAMES), unique_by=lambda s: s.stream)
SOCKETS = st.lists(st.builds(Socket, NAMES, st.just("u"), NAMES, TYPES), unique=True)


def test_first_stream_by_name_wins() -> None:
    socket = Socket("arm", "gripper", "odometry", "pose")
    flowing = [Source("z", "pose", "base"), Source("y", "pose", "cam"), Source("a", "depth", "cam")]
    assert list(optional_wires([socket], flowing)) == [
        Wire("y", "pose", "cam", "arm", "gripper", "odometry")
    ]


def test_component_does_not_feed_itself() -> None:
    socket = Socket("base", "wheels", "odometry", "pose")
    assert not list(optional_wires([socket], [Source("s", "pose", "base")]))


@given(SOCKETS, SOURCES)
def test_order_does_not_matter(sockets: list[Socket], sources: list[Source]) -> None:
    turned = set(optional_wires(reversed(sockets), reversed(sources)))
    assert set(optional_wires(sockets, sources)) == turned


@given(SOCKETS, SOURCES)
def test_each_input_has_at_most_one_fitting_stream(
    sockets: list[Socket], sources: list[Source]
) -> None:
    wires = list(optional_wires(sockets, sources))
    fed = [(wire.consumer, wire.unit, wire.slot, wire.type) for wire in wires]
    assert len(fed) == len(set(fed))
    for wire in wires:
        assert Source(wire.stream, wire.type, wire.producer) in sources
        assert wire.producer != wire.consumer
