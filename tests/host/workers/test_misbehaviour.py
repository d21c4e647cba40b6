"""Workers that crash, hang, disobey, flood and lie: each ends itself only, with its code."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
from dataclasses import replace

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.guest import do, guest_spec, plugin
from tests.kit.processes import is_alive, until_gone
from tests.kit.until import arrived, until
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.behaviours import BehaviourEstablished
from nondum.host.core.events.workers import (
    ConditionEnded,
    WorkerExited,
    WorkerFailed,
    WorkerFaulted,
    WorkerLogged,
    WorkerReady,
    WorkerStable,
)
from nondum.host.workers.call import Call
from nondum.host.workers.spec import Limits
from nondum.host.workers.supervision import RESTARTS, WINDOW_S
from nondum.planning.execute.running import RunState
from nondum.sdk.description import Condition

pytestmark = pytest.mark.anyio

LINK = '''
def link():
    """What a hostile plugin does not get by its context."""
    for name in os.listdir("/proc/self/fd"):
        try:
            found = socket.socket(fileno=os.dup(int(name)))
        except OSError:
            continue
        if found.family == socket.AF_UNIX and found.type == socket.SOCK_SEQPACKET:
            return found
'''


async def guest(
    tested: WorkersUnderTest, body: str, more: str = "", limits: Limits | None = None
) -> None:
    await tested.workers.start(guest_spec(tested, body, LINK + more, limits=limits))


async def exits_with(tested: WorkersUnderTest, body: str, code: str) -> None:
    """What a behaviour does ends its worker for this reason."""
    await guest(tested, body)
    call = do(tested)
    await is_replaced(tested, call, code)


async def is_replaced(tested: WorkersUnderTest, call: Call, code: str) -> None:
    """The worker ends for this reason, its call fails, and another worker takes its place."""
    exited = await tested.until(WorkerExited)
    assert exited.reason.startswith(code), exited.reason
    assert await call.ended() is RunState.FAILED
    assert code in call.reason
    await tested.until_ready(2)


async def test_exit_fails_the_call_and_is_repaired(tested: WorkersUnderTest) -> None:
    await exits_with(tested, "os._exit(7)", "WORKER_EXITED")


async def test_killed_worker_is_replaced(tested: WorkersUnderTest) -> None:
    await guest(tested, "await asyncio.Event().wait()")
    os.kill(tested.workers.pids()["guest"], signal.SIGKILL)
    exited = await tested.until(WorkerExited)
    assert "SIGKILL" in exited.reason


async def test_blocked_loop_is_a_hang(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    await guest(tested, "print('blocks', flush=True)\ntime.sleep(3600)")
    call = do(tested)
    await tested.until(WorkerLogged, lambda line: line.message == "blocks")
    await clock.advance(tested.timing.silence_s)
    await is_replaced(tested, call, "WORKER_HUNG")


async def test_hang_is_told_with_the_line_that_holds_up_the_loop(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    await guest(tested, "time.sleep(3600)")
    call = do(tested)
    line = plugin("time.sleep(3600)", LINK).splitlines().index("    time.sleep(3600)") + 1
    dumped = f'guest_plugin.py", line {line} in do'
    await tested.until(WorkerLogged, lambda said: dumped in said.message)
    await tested.until(WorkerLogged, lambda said: "sdk/worker.py" in said.message)
    await clock.advance(tested.timing.silence_s)
    assert await call.ended() is RunState.FAILED
    assert call.reason.startswith("WORKER_HUNG")
    assert f"do, guest_plugin.py:{line}" in call.reason
    exited = await tested.until(WorkerExited)
    assert exited.problem is not None
    assert exited.problem.code == "WORKER_HUNG"


CONDITION = """
from nondum.sdk import condition

@condition("place", predicates=("position-known",))
async def place(ctx):
    {body}
"""
PLACE = Condition("place", ("position-known",))


async def watcher(tested: WorkersUnderTest, body: str) -> None:
    await tested.start("guest", CONDITION.replace("{body}", body), conditions=(PLACE,))


async def test_condition_that_raises_is_told_with_its_line(tested: WorkersUnderTest) -> None:
    """Also where the error is raised in the SDK, for what the author wrote."""
    await watcher(tested, "ctx.know('elsewhere', ctx.host)")
    told = await tested.until(ConditionEnded)
    (problem,) = told.problems
    assert (told.component, told.condition, problem.code) == ("guest", "place", "CONDITION_RAISED")
    assert problem.where == "place of guest (guest_plugin.py:6)"
    assert "ValueError" in problem.message
    assert tested.workers.dead_conditions("guest", "0" * 16) == (problem,)
    assert not tested.told(WorkerExited)


async def test_mistake_that_ends_a_condition_is_told_as_that_end_alone(
    tested: WorkersUnderTest,
) -> None:
    wrong = "ctx.know('position-known', ctx.host, value=Pose(Header(), (1.0, 2.0)))"
    body = f"""from nondum.sdk import Header, Pose
    try:
        {wrong}
    except Exception:
        pass
    {wrong}"""
    await watcher(tested, body)
    await tested.until(ConditionEnded)
    told = [problem.where for event in tested.told(WorkerFaulted) for problem in event.problems]
    assert told == ["guest (guest_plugin.py:8)", "guest (guest_plugin.py:11)"]
    (ended,) = tested.workers.dead_conditions("guest", "0" * 16)
    assert ended.where == "place of guest (guest_plugin.py:11)"
    assert [fault.where for fault in tested.workers.faults("guest")] == told[:1]


EARLY = """
from nondum.sdk import hookimpl

@hookimpl
async def start(ctx):
    told = {"condition": "place", "problem": {"message": "early"}}
    ctx._workplace.tell("condition-ended", told, None)
"""


async def test_condition_that_ends_early_is_told_once_the_worker_is_known_to_run(
    tested: WorkersUnderTest,
) -> None:
    source = CONDITION.replace("{body}", "await ctx.sleep(3600)") + EARLY
    await tested.start("guest", source, conditions=(PLACE,))
    kinds = [type(event) for event in tested.events]
    assert ConditionEnded in kinds[kinds.index(WorkerReady) :]


async def test_end_of_a_condition_that_the_plugin_has_not_breaks_the_protocol(
    tested: WorkersUnderTest,
) -> None:
    sends = (
        "from nondum.sdk.wire import Event, encode\n"
        "link().send(encode(Event('condition-ended', None, {'condition': 'x', 'problem': "
        "{'message': 'y'}})))\nawait asyncio.Event().wait()"
    )
    await exits_with(tested, sends, "PROTO_VIOLATION")


async def test_what_ended_a_worker_is_past_once_the_next_one_has_lived_for_a_while(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    tested.workers.timing = replace(tested.timing, missed=1_000_000)
    await guest(tested, "pass")
    os.kill(tested.workers.pids()["guest"], signal.SIGKILL)
    await tested.until_ready(2)
    await clock.advance(WINDOW_S * 0.9)
    assert not tested.told(WorkerStable)
    await clock.advance(WINDOW_S * 0.2)
    await tested.until(WorkerStable)


async def test_worker_that_shows_signs_of_life_does_not_hang(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    """However long it lives; the signs are what it says."""
    tested.workers.timing = replace(tested.timing, settle_beats=1)
    await guest(tested, "pass")
    for _ in range(2):
        await arrived("a sign of life", tested.workers.watched("guest", "0" * 16))
        await clock.advance(tested.timing.silence_s * 0.9)
    assert "guest" in tested.workers.pids()
    assert not tested.told(WorkerExited)


async def test_stopped_process_is_a_hang(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    await guest(tested, "pass")
    pid = tested.workers.pids()["guest"]
    os.kill(pid, signal.SIGSTOP)
    await clock.advance(tested.timing.silence_s)
    exited = await tested.until(WorkerExited)
    assert exited.reason.startswith("WORKER_HUNG")
    assert not is_alive(pid)


async def test_closed_link_ends_the_worker(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    """After a while in which it may end by itself."""
    body = "link().shutdown(socket.SHUT_RDWR)\nawait asyncio.to_thread(time.sleep, 3600)"
    await guest(tested, body)
    do(tested)
    await clock.advance_until(tested.until(WorkerExited))


async def test_worker_that_crashed_is_restarted_after_a_growing_delay(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    tested.workers.timing = replace(tested.timing, backoff_s=1.0)
    await guest(tested, "pass")
    for crash, delay_s in enumerate((1.0, 2.0, 4.0), start=1):
        os.kill(tested.workers.pids()["guest"], signal.SIGKILL)
        await tested.until_exited(crash)
        await clock.advance(delay_s * 0.9)
        assert not tested.workers.pids()
        await clock.advance(delay_s * 0.1)
        await tested.until_ready(1 + crash)


async def test_crash_loop_ends_in_quarantine(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass")
    for starts in range(1, 2 + RESTARTS):
        await tested.until_ready(starts)
        os.kill(tested.workers.pids()["guest"], signal.SIGKILL)
    failed = await tested.until(WorkerFailed)
    assert [p.code for p in failed.problems] == ["WORKER_CRASH_LOOP", "WORKER_EXITED"]
    assert len(tested.told(WorkerReady)) == 1 + RESTARTS
    assert not tested.workers.pids()


async def test_quarantined_component_may_try_again(tested: WorkersUnderTest) -> None:
    crash = "import pathlib\nif pathlib.Path('bad').exists(): os._exit(9)"
    await guest(tested, "open('bad', 'w').close(); os._exit(9)", crash)
    do(tested)
    await tested.until(WorkerFailed)
    await tested.workers.restart("guest")
    assert len(tested.told(WorkerFailed)) == 2
    (tested.folder / "guest/scratch/bad").unlink()
    await tested.workers.restart("guest")
    assert list(tested.workers.pids()) == ["guest"]


async def test_behaviour_that_does_not_halt_costs_its_worker(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    body = (
        "await ctx.established()\n"
        "while True:\n"
        "    try:\n"
        "        await asyncio.sleep(60)\n"
        "    except asyncio.CancelledError:\n"
        "        pass"
    )
    await guest(tested, body)
    pid = tested.workers.pids()["guest"]
    call = do(tested)
    await tested.until(BehaviourEstablished)
    call.halt()
    await clock.advance(tested.timing.halt_s * 0.9)
    assert is_alive(pid)
    await clock.advance(tested.timing.halt_s * 0.1 + tested.timing.term_s)
    assert await call.ended() is RunState.HALTED
    assert not is_alive(pid)
    assert (await tested.until(WorkerExited)).reason.startswith("HALT_OVERDUE")
    await tested.until_ready(2)


async def test_behaviour_that_halted_while_the_host_stood_still_costs_nothing(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    body = (
        "await ctx.established()\n"
        "try:\n"
        "    await asyncio.sleep(60)\n"
        "finally:\n"
        "    answered = pathlib.Path('answered').touch\n"
        "    asyncio.get_running_loop().call_later(0.05, answered)"
    )
    await guest(tested, body, "import pathlib")
    call = do(tested)
    await tested.until(BehaviourEstablished)
    call.halt()
    until("it has answered", (tested.folder / "guest/scratch/answered").exists)
    await clock.stand_still(tested.timing.halt_s)
    assert await call.ended() is RunState.HALTED
    again = do(tested)
    await tested.until(BehaviourEstablished, lambda event: event.call_id == again.id)


async def test_stop_ends_what_ignores_everything(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    """Within its grace, of which it has most for its own `stop`."""
    stubborn = (
        "@hookimpl\n"
        "async def start(ctx):\n"
        "    signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "@hookimpl\n"
        "async def stop(ctx):\n"
        "    print('stops', flush=True)\n"
        "    time.sleep(3600)"
    )
    await guest(tested, "pass", stubborn)
    pid = tested.workers.pids()["guest"]
    stopping = asyncio.create_task(tested.workers.stop("guest", grace_s=1.0))
    await tested.until(WorkerLogged, lambda line: line.message == "stops")
    await clock.advance(0.6)
    assert is_alive(pid)
    await clock.advance(0.4)
    await stopping
    assert not is_alive(pid)
    assert not tested.told(WorkerExited), "an expected end is no crash"


async def test_worker_has_ended_once_it_is_said_to_have_stopped(
    tested: WorkersUnderTest, clock: VirtualClock
) -> None:
    """The kernel takes a while over much memory; who asks next may want the same device."""
    heavy = (
        "@hookimpl\n"
        "async def start(ctx):\n"
        "    signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "    globals()['ballast'] = bytearray(b'x' * 800_000_000)\n"
        "@hookimpl\n"
        "async def stop(ctx):\n"
        "    time.sleep(3600)"
    )
    await guest(tested, "pass", heavy)
    pid = tested.workers.pids()["guest"]
    stopping = asyncio.create_task(tested.workers.stop("guest", grace_s=1.0))
    await clock.advance(1.0)
    await stopping
    assert not is_alive(pid)


async def test_stop_hook_leaves_things_safe(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass", "@hookimpl\nasync def stop(ctx):\n    open('safe', 'w').close()")
    await tested.workers.stop("guest")
    assert (tested.folder / "guest/scratch/safe").exists()


CHILD = "import os, time; print('child', os.getpid(), flush=True); time.sleep(3600)"
DOUBLE_FORK = f"""
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        os.execv(sys.executable, [sys.executable, "-c", {CHILD!r}])
    os._exit(0)
await asyncio.Event().wait()
"""


@pytest.mark.parametrize("end", ["stop", "crash"])
@pytest.mark.parametrize(
    "body",
    [
        pytest.param(
            f"subprocess.Popen([sys.executable, '-c', {CHILD!r}])\nawait asyncio.Event().wait()",
            id="child",
        ),
        pytest.param(DOUBLE_FORK, id="double fork"),
    ],
)
async def test_children_go_with_their_worker(tested: WorkersUnderTest, body: str, end: str) -> None:
    await guest(tested, body)
    pid = tested.workers.pids()["guest"]
    do(tested)
    said = await tested.until(WorkerLogged, lambda line: line.message.startswith("child"))
    child = tested.pid("guest", said.message.split()[1])
    assert is_alive(child)
    if end == "stop":
        await tested.workers.stop("guest")
    else:
        os.kill(pid, signal.SIGKILL)
        await tested.until(WorkerExited)
    await until_gone(child)


async def test_flood_of_output_is_bounded(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    body = (
        "for _ in range(40):\n    os.write(1, b'x' * 60_000 + b'\\n')\n    await asyncio.sleep(0)"
    )
    await guest(tested, body)
    call = do(tested)
    assert await clock.advance_until(call.ended()) is RunState.SUCCEEDED
    await tested.workers.stop("guest")
    assert any(line.startswith("LOG_DROPPED") for line in tested.lines("guest"))
    assert sum(map(len, tested.lines("guest"))) < 1_000_000
    assert not tested.told(WorkerExited)


async def test_control_characters_do_not_reach_terminals(tested: WorkersUnderTest) -> None:
    await guest(tested, r"print('\x1b[2Jhello')")
    await do(tested).ended()
    await tested.until(WorkerLogged, lambda line: "hello" in line.message)
    assert r"\x1b[2Jhello" in tested.lines("guest")


@pytest.mark.parametrize(
    ("body", "code"),
    [
        pytest.param("link().send(os.urandom(200))", "PROTO_VIOLATION", id="garbage"),
        pytest.param(
            "s = link(); s.setblocking(True)\ns.send(b'x' * 100_000)", "PROTO_VIOLATION", id="long"
        ),
        pytest.param(
            "from nondum.sdk import wire\nlink().send(wire.encode(wire.Reply(9999, {})))",
            "PROTO_VIOLATION",
            id="unexpected answer",
        ),
        pytest.param(
            "from nondum.sdk import wire\nlink().send(wire.encode(wire.Request(1, 'mount', {})))",
            "PROTO_VIOLATION",
            id="request",
        ),
        pytest.param(
            "ctx._workplace.tell('boast', {}, None)", "PROTO_VIOLATION", id="unknown event"
        ),
        pytest.param(
            "ctx._workplace.tell('know', {'predicate': 3}, None)", "PROTO_VIOLATION", id="no fact"
        ),
        pytest.param(
            "body = {'stream': 'rover__other__frames', 'flowing': True}\n"
            "ctx._workplace.tell('flow', body, None)",
            "RESULT_INVALID",
            id="stream of somebody else",
        ),
        pytest.param(
            "s = link(); s.setblocking(True)\n"
            "from nondum.sdk import wire\n"
            "packet = wire.encode(wire.Cancel(1))\n"
            "for _ in range(100_000): s.send(packet)",
            "BACKPRESSURE",
            id="flood",
        ),
    ],
)
async def test_protocol_is_enforced(tested: WorkersUnderTest, body: str, code: str) -> None:
    await exits_with(tested, f"{body}\nawait asyncio.sleep(60)", code)


async def test_other_workers_never_notice(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    await tested.workers.start(guest_spec(tested, "pass", name="good"))
    await guest(tested, "while True: os.write(1, b'y' * 4096)")
    do(tested)
    for _ in range(20):
        await clock.advance(0.1)  # a little more of the flood is read
        call = do(tested, "good")
        assert await call.ended() is RunState.SUCCEEDED
    assert "good" in tested.workers.pids()


async def test_memory_hog_hurts_itself_only(tested: WorkersUnderTest) -> None:
    await guest(tested, "bytearray(1 << 30)", limits=Limits(memory_mb=256))
    call = do(tested)
    assert await call.ended() is RunState.FAILED
    assert "MemoryError" in call.reason


async def test_descriptors_run_out_for_the_leaker_only(tested: WorkersUnderTest) -> None:
    await guest(
        tested, "kept = [open('/dev/null') for _ in range(500)]", "", Limits(descriptors=64)
    )
    call = do(tested)
    assert await call.ended() is RunState.FAILED
    assert os.strerror(errno.EMFILE) in call.reason


async def test_nothing_is_inherited(
    tested: WorkersUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "of the host")
    body = (
        "assert 'SECRET' not in os.environ, os.environ\n"
        "assert os.environ['OMP_NUM_THREADS'] == '1'\n"
        "assert os.readlink('/proc/self/fd/0') == '/dev/null'\n"
        "assert os.getsid(0) == os.getpid() == os.getpgid(0)\n"
        "assert os.getcwd() == str(ctx.scratch)\n"
        "assert 'NoNewPrivs:\\t1' in open('/proc/self/status').read()\n"
        "assert sys.flags.isolated and sys.flags.no_site and 'site' not in sys.modules\n"
        "paths = [f'/proc/self/fd/{n}' for n in os.listdir('/proc/self/fd')]\n"
        "kinds = sorted(os.readlink(p).split(':')[0] for p in paths if os.path.exists(p))\n"
        # Its three standard files; the link; two sockets and the poller of its event loop.
        "own = ['/dev/null', 'anon_inode', 'pipe', 'pipe', 'socket', 'socket', 'socket']\n"
        "assert kinds == own, kinds"
    )
    await guest(tested, body)
    call = do(tested)
    assert await call.ended() is RunState.SUCCEEDED, call.reason
