"""The control socket: questions over a real socket, answered or refused in words."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import stat
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.descriptors import descriptors_left
from tests.kit.golden import Golden
from tests.kit.until import arrived, until_async

from nondum.host.control import protocol
from nondum.host.control.client import ControlClient
from nondum.host.control.server import MODE, ControlServer, Handing
from nondum.sdk.errors import (
    ConfigRefused,
    GoalRefused,
    HostUnreachable,
    NondumError,
    Problem,
    ProtocolViolation,
)

pytestmark = pytest.mark.anyio

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


async def echo(arguments: Mapping[str, Any]) -> Any:
    return dict(arguments)


REFUSAL = Problem("GOAL_UNKNOWN_WORDS", "no such goal", fix="see `nondum goals`")


async def refuse(arguments: Mapping[str, Any]) -> Any:
    raise GoalRefused(REFUSAL)


async def crash(arguments: Mapping[str, Any]) -> Any:
    raise RuntimeError("a fault of the daemon")


async def hand(arguments: Mapping[str, Any]) -> Handing:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours:
        ours.send(b"handed")
    return Handing(dict(arguments), theirs)


async def never(arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
    try:
        yield "begun"
        await asyncio.Event().wait()
    finally:
        arguments["ended"]()


async def stumble(arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
    yield "begun"
    raise GoalRefused(Problem("GOAL_UNKNOWN", "there is no such goal"))


async def count(arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
    for i in range(arguments["to"]):
        yield i


@asynccontextmanager
async def serving(
    path: Path, on_end: Callable[[], None] = lambda: None
) -> AsyncIterator[ControlServer]:
    server = ControlServer(
        path,
        {"echo": echo, "refuse": refuse, "crash": crash, "hand": hand},
        {"count": count, "stumble": stumble, "never": lambda _: never({"ended": on_end})},
    )
    await server.open()
    try:
        yield server
    finally:
        await server.close()


def ask(path: Path, verb: str, **arguments: Any) -> Any:
    with ControlClient(path) as client:
        return client.ask(verb, **arguments)


async def test_an_answer_comes_back(tmp_path: Path) -> None:
    async with serving(tmp_path / "control.sock"):
        answer = await asyncio.to_thread(ask, tmp_path / "control.sock", "echo", words="héllo")
    assert answer == {"words": "héllo"}


async def test_the_socket_is_private_from_its_first_moment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, seen, chmod = tmp_path / "control.sock", list[tuple[int, bool]](), os.chmod

    def look(*arguments: Any, **options: Any) -> None:
        with socket.socket(socket.AF_UNIX) as client:
            listens = client.connect_ex(str(path)) == 0
        seen.append((stat.S_IMODE(path.stat().st_mode), listens))
        chmod(*arguments, **options)

    monkeypatch.setattr(os, "chmod", look)  # the first thing that is done to it after `bind`
    before = os.umask(0)
    try:
        async with serving(path):
            assert stat.S_IMODE(path.stat().st_mode) == MODE
    finally:
        os.umask(before)
    assert seen == [(MODE, False)]


async def test_the_socket_is_the_groups_whatever_the_umask_is(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    before = os.umask(0o077)
    try:
        async with serving(path):
            assert stat.S_IMODE(path.stat().st_mode) == MODE
    finally:
        os.umask(before)


async def test_client_for_which_there_is_no_descriptor_is_logged_once_and_answered_later(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "control.sock"
    with socket.socket(socket.AF_UNIX) as client:
        async with serving(path):
            with descriptors_left(0):
                client.connect(str(path))
                await until_async("it is logged", lambda: bool(caplog.records))
            reader, writer = await asyncio.open_unix_connection(sock=client)
            writer.write(protocol.encode_request(protocol.Request("echo", {})))
            answer = await arrived("the answer", reader.readline())
            writer.close()
    assert protocol.decode_answer(answer) == ({}, ())
    assert [record.name for record in caplog.records] == ["nondum.host.control.shortage"]


async def test_other_fault_of_the_loop_is_logged_by_the_loop(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with serving(tmp_path / "control.sock"):
        fault = {"message": "a fault", "exception": OSError(errno.EMFILE, "too many")}
        asyncio.get_running_loop().call_exception_handler(fault)
    assert [record.name for record in caplog.records] == ["asyncio"]


async def test_a_refusal_keeps_its_words(tmp_path: Path) -> None:
    async with serving(tmp_path / "control.sock"):
        with pytest.raises(GoalRefused) as refused:
            await asyncio.to_thread(ask, tmp_path / "control.sock", "refuse")
    assert refused.value.problems == (REFUSAL,)


async def test_a_connection_comes_with_an_answer_and_the_next_question_is_answered(
    tmp_path: Path,
) -> None:
    def talk() -> tuple[Any, bytes, Any]:
        with ControlClient(tmp_path / "control.sock") as client:
            client.ask("echo", words="x" * 2**20)
            answer, connection = client.ask_for_connection("hand", words="y" * 2**17)
            with connection:
                return answer, connection.recv(100), client.ask("echo", still="here")

    async with serving(tmp_path / "control.sock"):
        answer, received, after = await asyncio.to_thread(talk)
    assert answer == {"words": "y" * 2**17}
    assert received == b"handed"
    assert after == {"still": "here"}


async def test_a_refused_connection_keeps_the_words_of_the_refusal(tmp_path: Path) -> None:
    def talk() -> Any:
        with ControlClient(tmp_path / "control.sock") as client:
            return client.ask_for_connection("refuse")

    async with serving(tmp_path / "control.sock"):
        with pytest.raises(GoalRefused, match="GOAL_UNKNOWN_WORDS"):
            await asyncio.to_thread(talk)


async def test_an_answer_that_lacks_its_connection_is_a_violation(tmp_path: Path) -> None:
    def talk() -> Any:
        with ControlClient(tmp_path / "control.sock") as client:
            return client.ask_for_connection("echo")

    async with serving(tmp_path / "control.sock"):
        with pytest.raises(ProtocolViolation, match="no connection"):
            await asyncio.to_thread(talk)


async def test_a_daemon_that_goes_before_a_connection_came_is_told(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "control.sock"))
        listener.listen()
        client = ControlClient(tmp_path / "control.sock")
        listener.accept()[0].close()
    with client, pytest.raises(HostUnreachable):
        client.ask_for_connection("hand")


async def test_an_unknown_verb_names_the_nearest(tmp_path: Path) -> None:
    async with serving(tmp_path / "control.sock"):
        with pytest.raises(NondumError) as unknown:
            await asyncio.to_thread(ask, tmp_path / "control.sock", "ecoh")
    assert "'echo'" in unknown.value.problems[0].fix


async def test_a_fault_of_the_daemon_is_told_and_survived(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    async with serving(path):
        with pytest.raises(NondumError, match="RuntimeError") as crashed:
            await asyncio.to_thread(ask, path, "crash")
        assert (crashed.value.code, crashed.value.problems[0].where) == ("INTERNAL", "daemon")
        assert await asyncio.to_thread(ask, path, "echo") == {}


async def test_following_yields_until_the_end(tmp_path: Path) -> None:
    def collect() -> list[int]:
        with ControlClient(tmp_path / "control.sock") as client:
            answers = client.follow("count", to=3)
            return [next(answers) for _ in range(3)]

    async with serving(tmp_path / "control.sock"):
        assert await asyncio.to_thread(collect) == [0, 1, 2]


async def test_following_ends_when_the_client_leaves(tmp_path: Path) -> None:
    ended = asyncio.Event()

    def glance() -> Any:
        with ControlClient(tmp_path / "control.sock") as client:
            return next(client.follow("never"))

    async with serving(tmp_path / "control.sock", ended.set):
        assert await asyncio.to_thread(glance) == "begun"
        await arrived("the end of following", ended.wait())


async def test_the_next_question_ends_following(tmp_path: Path) -> None:
    def talk() -> list[Any]:
        with ControlClient(tmp_path / "control.sock") as client:
            return [next(client.follow("never")), client.ask("echo", words="enough")]

    async with serving(tmp_path / "control.sock"):
        assert await asyncio.to_thread(talk) == ["begun", {"words": "enough"}]


async def test_a_refusal_ends_following_and_the_next_question_is_answered(tmp_path: Path) -> None:
    def talk() -> Any:
        with ControlClient(tmp_path / "control.sock") as client:
            with pytest.raises(GoalRefused, match="GOAL_UNKNOWN"):
                list(client.follow("stumble"))
            return client.ask("echo")

    async with serving(tmp_path / "control.sock"):
        assert await asyncio.to_thread(talk) == {}


async def test_a_daemon_that_goes_is_told_to_followers(tmp_path: Path) -> None:
    begun = asyncio.Event()
    loop = asyncio.get_running_loop()

    def follow() -> None:
        with ControlClient(tmp_path / "control.sock") as client:
            for _ in client.follow("never"):
                loop.call_soon_threadsafe(begun.set)

    async with serving(tmp_path / "control.sock") as server:
        following = asyncio.create_task(asyncio.to_thread(follow))
        await begun.wait()
        await server.close()
        with pytest.raises(HostUnreachable, match="hung up"):
            await following


async def test_a_client_that_never_reads_harms_no_other_client(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as deaf:
        async with serving(tmp_path / "control.sock"):
            deaf.connect(str(tmp_path / "control.sock"))
            flood = protocol.Request("count", {"to": 10_000_000})
            deaf.sendall(protocol.encode_request(flood))
            answer = await asyncio.to_thread(ask, tmp_path / "control.sock", "echo", still="here")
    assert answer == {"still": "here"}


async def test_an_endless_line_is_refused(tmp_path: Path) -> None:
    def talk() -> bytes:
        with socket.socket(socket.AF_UNIX) as raw:
            raw.connect(str(tmp_path / "control.sock"))
            with contextlib.suppress(OSError):  # it may hang up while we are still talking
                for _ in range(2 * protocol.LINE_LIMIT // 2**20 + 2):
                    raw.sendall(b"x" * 2**20)
            return raw.makefile("rb").readline()

    async with serving(tmp_path / "control.sock"):
        assert b"CONTROL_REQUEST" in await asyncio.to_thread(talk)
        assert await asyncio.to_thread(ask, tmp_path / "control.sock", "echo") == {}


async def test_the_socket_of_a_dead_daemon_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    async with serving(path):
        assert await asyncio.to_thread(ask, path, "echo") == {}


async def test_the_socket_of_a_living_daemon_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "control.sock"
    async with serving(path):
        with pytest.raises(ConfigRefused, match="CONTROL_IN_USE"):
            await ControlServer(path, {}, {}).open()
        assert await asyncio.to_thread(ask, path, "echo") == {}


async def test_a_path_that_is_no_place_for_a_socket_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigRefused, match=r"CONTROL_SOCKET .*too long"):
        await ControlServer(tmp_path / ("x" * 200), {}, {}).open()


async def test_garbage_is_refused_and_the_next_line_answered(tmp_path: Path) -> None:
    def talk() -> list[bytes]:
        with socket.socket(socket.AF_UNIX) as raw:
            raw.connect(str(tmp_path / "control.sock"))
            raw.sendall(b"\xff{not json\n" + protocol.encode_request(protocol.Request("echo")))
            lines = raw.makefile("rb")
            return [lines.readline(), lines.readline()]

    async with serving(tmp_path / "control.sock"):
        refused, answered = await asyncio.to_thread(talk)
    assert b"CONTROL_REQUEST" in refused
    assert answered == b'{"result":{}}\n'


async def test_only_owner_and_group_may_open_it(tmp_path: Path) -> None:
    async with serving(tmp_path / "control.sock"):
        assert stat.S_IMODE((tmp_path / "control.sock").stat().st_mode) == 0o660


def test_no_daemon_is_told_with_the_remedy(tmp_path: Path, golden: Golden) -> None:
    with pytest.raises(HostUnreachable) as unreachable:
        ControlClient(tmp_path / "missing.sock")
    (problem,) = unreachable.value.problems
    golden.check("no daemon answers", problem.fix)


@given(st.text(), st.dictionaries(st.text(), JSON))
def test_requests_survive_the_wire(verb: str, arguments: dict[str, Any]) -> None:
    request = protocol.Request(verb, arguments)
    assert protocol.decode_request(protocol.encode_request(request)) == request


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{",
        b"[" * 100_000,
        b"[]",
        b"{}",
        b'{"verb": 1}',
        b'{"verb": "status", "arguments": []}',
    ],
    ids=["nothing", "cut off", "too deep", "a list", "no verb", "a number", "no table"],
)
def test_what_is_no_request_is_a_violation(line: bytes) -> None:
    with pytest.raises(ProtocolViolation) as violation:
        protocol.decode_request(line)
    assert violation.value.code == "CONTROL_REQUEST"


@given(st.binary())
def test_any_bytes_are_a_request_or_a_violation(line: bytes) -> None:
    try:
        protocol.decode_request(line)
    except ProtocolViolation as error:
        assert error.code == "CONTROL_REQUEST"


@pytest.mark.parametrize(
    "line",
    [b"", b"hello\n", b"[]\n", b'{"problems":[{"no":"code"}]}\n', b'{"problems":[1]}\n'],
    ids=["nothing", "words", "list", "problem without code", "number"],
)
def test_answers_that_are_none_are_violations(line: bytes) -> None:
    with pytest.raises(ProtocolViolation, match="CONTROL_ANSWER"):
        protocol.decode_answer(line)
