"""Which optional input is fed by which stream: pure, whatever order things come in."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.workers.optional_inputs import (
    Choice,
    Socket,
    Source,
    choose,
    sockets_of,
    sources_of,
)
from nondum.sdk.description import Fragment, Input, Output, PluginDescription, Unit
from nondum.transport import Wire

NAMES = st.sampled_from(["a", "b", "c"])
TYPES = st.sampled_from(["pose", "depth"])
KINDS = st.sampled_from(["base", "camera"])
STREAMS = st.sampled_from(["s1", "s2", "s3"])
SOURCES = st.lists(
    st.builds(Source, STREAMS, TYPES, NAMES, KINDS.map(lambda kind: frozenset({kind}))),
    unique_by=lambda s: s.stream,
)
SOCKETS = st.lists(
    st.builds(Socket, NAMES, st.just("u"), NAMES, TYPES, st.just("") | KINDS),
    unique_by=lambda s: s.name,
)
CONNECTED = st.dictionaries(st.builds("{}.u.{}".format, NAMES, NAMES), STREAMS)

GPS = PluginDescription(
    "gps", "1", units=(Unit("receiver", "sensor", outputs=(Output("fix", "pose"),)),)
)
"""What the trial's author wrote: a pose, but not of the base."""


def source(stream: str, component: str = "cam", *of: str, type_: str = "pose") -> Source:
    return Source(stream, type_, component, frozenset(of))


def chosen(socket: Socket, *sources: Source, connected: str = "") -> Choice:
    said = {socket.name: connected} if connected else {}
    (choice,) = choose([socket], sources, said)
    return choice


def test_first_stream_by_name_wins_where_anything_of_the_type_will_do() -> None:
    socket = Socket("arm", "gripper", "odometry", "pose")
    flowing = source("z", "base"), source("y"), source("a", type_="depth")
    choice = chosen(socket, *flowing)
    assert choice.wire == Wire("y", "pose", "cam", "arm", "gripper", "odometry")
    assert choice.is_ambiguous
    assert choice.problem().code == "INPUT_AMBIGUOUS"
    assert choice.problem().have == "y, z"


def test_component_does_not_feed_itself() -> None:
    socket = Socket("base", "wheels", "odometry", "pose")
    assert chosen(socket, source("s", "base")).wire is None
    assert chosen(socket, source("s", "base"), connected="s").wire is None


def test_input_of_something_takes_nothing_else() -> None:
    socket = Socket("eye", "camera", "odometry", "pose", of="base")
    fix, odometry = source("a-fix", "gps", "sensor"), source("odometry", "base", "base")
    assert chosen(socket, fix).source is None
    assert chosen(socket, fix, odometry).source is odometry
    assert not chosen(socket, fix, odometry).is_ambiguous


def test_person_decides_whatever_a_stream_is_of() -> None:
    socket = Socket("eye", "camera", "odometry", "pose", of="base")
    fix, odometry = source("a-fix", "gps", "sensor"), source("odometry", "base", "base")
    choice = chosen(socket, fix, odometry, connected="a-fix")
    assert choice.source is fix
    assert not choice.is_ambiguous


def test_connected_stream_that_does_not_flow_is_waited_for() -> None:
    socket = Socket("eye", "camera", "odometry", "pose", of="base")
    assert chosen(socket, source("odometry", "base", "base"), connected="gone").source is None


def test_unit_of_a_type_of_its_own_is_of_all_that_this_is() -> None:
    text = "(define (domain mower) (:types mower - tracked-base tracked-base - base))"
    unit = Unit("deck", "mower", outputs=(Output("odometry", "pose"),))
    plugin = PluginDescription("mower", "1", units=(unit,), fragments=(Fragment("d", text),))
    (odometry,) = sources_of("robot", "mower", plugin)
    assert {"mower", "tracked-base", "base"} <= odometry.of
    socket = Socket("eye", "camera", "odometry", "pose", of="base")
    assert chosen(socket, odometry).source is odometry


def test_fragment_that_cannot_be_read_says_nothing_of_types() -> None:
    unit = Unit("deck", "mower", outputs=(Output("odometry", "pose"),))
    plugin = PluginDescription("mower", "1", units=(unit,), fragments=(Fragment("d", "((("),))
    (odometry,) = sources_of("robot", "mower", plugin)
    assert "mower" in odometry.of
    assert "base" not in odometry.of


def test_output_may_tell_of_another_unit_than_its_own() -> None:
    unit = Unit("eye", "camera", outputs=(Output("odometry", "pose", of="base"),))
    (odometry,) = sources_of("robot", "vo", PluginDescription("vo", "1", units=(unit,)))
    assert "base" in odometry.of
    assert "camera" not in odometry.of


def test_description_of_before_has_inputs_of_anything() -> None:
    said = PluginDescription("old", "1", units=(Unit("u", "camera", inputs=(Input("i", "pose"),)),))
    plain = said.to_dict()
    assert "of" not in plain["units"][0]["inputs"][0]
    old = PluginDescription.parse(plain, where="old")
    (socket,) = sockets_of("old", old)
    assert socket.of == ""
    assert chosen(socket, *sources_of("robot", "gps", GPS)).source is not None


@given(SOCKETS, SOURCES, CONNECTED)
def test_order_does_not_matter(
    sockets: list[Socket], sources: list[Source], connected: dict[str, str]
) -> None:
    turned = choose(reversed(sockets), reversed(sources), connected)
    assert choose(sockets, sources, connected) == turned


@given(SOCKETS, SOURCES, CONNECTED)
def test_each_input_has_at_most_one_fitting_stream(
    sockets: list[Socket], sources: list[Source], connected: dict[str, str]
) -> None:
    choices = choose(sockets, sources, connected)
    assert sorted(c.socket.name for c in choices) == sorted(s.name for s in sockets)
    for choice in choices:
        found, said = choice.source, connected.get(choice.socket.name)
        assert choice.chosen == (said or "")
        if found is not None:
            assert found in sources
            assert choice.socket.takes(found)
            assert choice.socket.fits(found) if said is None else found.stream == said
