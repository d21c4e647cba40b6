"""The helper as a process of root, asked by the user that it serves and by hostile ones."""

from __future__ import annotations

import encodings.ascii  # noqa: F401  # the users of these tests may not look where it is
import os
import pickle
import pwd
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import pytest
from tests.host.sandbox.helper.replies import code
from tests.kit.descriptors import descriptors_left
from tests.kit.disk_images import make_ext4
from tests.kit.golden import Golden
from tests.kit.loop_devices import attached
from tests.kit.until import until

from nondum.host.sandbox.cgroups import CgroupLimits, Cgroups
from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.sandbox.helper import HelperClient, client, drive_nodes, removals, requests
from nondum.host.sandbox.helper.client import PressesOfHelper
from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.host.sandbox.helper.disks import Disks
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.server import MOST_CHILDREN, Server, answer
from nondum.host.sandbox.helper.service import Service
from nondum.host.sandbox.helper.stop_key import EV_KEY, EVENT, PressesOfDevice
from nondum.sdk.errors import NondumError
from nondum.sdk.wire import (
    MAX_PACKET,
    Cancel,
    Event,
    Reply,
    Request,
    WireMessage,
    decode,
    encode,
)

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="the helper is root's")
SERVED = pwd.getpwnam("daemon")
STRANGER = pwd.getpwnam("nobody")
_R = TypeVar("_R")

REMOVED = (
    b"remove@/devices/usb1/1-2/1-2:1.0/hidraw/hidraw0\0ACTION=remove\0"
    b"DEVPATH=/devices/usb1/1-2/1-2:1.0/hidraw/hidraw0\0SUBSYSTEM=hidraw\0"
    b"MAJOR=240\0MINOR=3\0DEVNAME=hidraw0\0SEQNUM=4711\0"
)
"""What the kernel writes."""
START = 'export LISTEN_PID=$$ LISTEN_FDS=1; exec "$@"'


def asking(verb: str, body: dict[str, Any]) -> bytes:
    return encode(Request(requests.CALL, verb, body))


@dataclass
class Helper:
    """A running one, and how its users reach it."""

    socket: Path
    run: Path
    process: subprocess.Popen[bytes]

    @property
    def client(self) -> HelperClient:
        return HelperClient(self.socket)

    def is_well(self) -> bool:
        """Whether it still answers the user that it serves."""
        return isinstance(served(lambda: self.client.ask(requests.ListCgroups())), dict)


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder that every user can look into, as /run/nondum is."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.fixture
def helper(place: Path) -> Iterator[Helper]:
    """A helper that runs."""
    running = started(place, "-m", "nondum.host.sandbox.helper")
    yield running
    assert running.process.poll() is None, "it has ended"
    assert running.is_well()
    running.process.terminate()
    running.process.wait()


def started(place: Path, *python: str) -> Helper:
    """Start a helper as systemd would, by this Python; it also takes loop devices."""
    path = place / "helper.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(path))
        path.chmod(0o666)
        listening.listen(64)
        command = [sys.executable, *python, "--user", SERVED.pw_name]
        command += ["--run", str(place / "run"), "--allow-loop", "--idle-s", "600"]
        process = subprocess.Popen(
            ["sh", "-c", START, "sh", *command],
            preexec_fn=lambda: os.dup2(listening.fileno(), 3),
            pass_fds=(3,),
        )
    return Helper(path, place / "run", process)


def served(work: Callable[[], _R]) -> _R:
    """Do something as the user who is served."""
    return as_user(SERVED.pw_uid, work)


def as_user(uid: int, work: Callable[[], _R]) -> _R:
    """Do something in a process of a user; give or raise what it did."""
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.setgroups([])
            os.setresgid(uid, uid, uid)
            os.setresuid(uid, uid, uid)
            try:
                said: Any = work()
            except Exception as error:
                said = error
            os.write(write, pickle.dumps(said))
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as answers:
        said = pickle.loads(answers.read())
    os.waitpid(pid, 0)
    if isinstance(said, Exception):
        raise said
    result: _R = said
    return result


def raw(helper: Helper, *packets: bytes, fds: tuple[int, ...] = ()) -> str:
    """Send packets as the served user, with descriptors; the code that is answered, if any."""

    def ask() -> str:
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as asked:
            asked.settimeout(10)
            asked.connect(str(helper.socket))
            for packet in packets:
                socket.send_fds(asked, [packet], list(fds))
            return code(answered(asked))

    return served(ask)


def answered(asked: socket.socket) -> WireMessage:
    """What the helper answers, once it has begun; who is turned away is answered at once."""
    said = decode(asked.recv(MAX_PACKET))
    begun = Event(requests.HEARD, requests.CALL, {})
    return decode(asked.recv(MAX_PACKET)) if said == begun else said


def test_strangers_are_not_served(helper: Helper) -> None:
    with pytest.raises(NondumError) as refused:
        as_user(STRANGER.pw_uid, lambda: helper.client.ask(requests.ListCgroups()))
    assert refused.value.code == "HELPER_REFUSED"


@pytest.mark.parametrize(
    "packet",
    [
        pytest.param(b"\xff" * 300, id="garbage"),
        pytest.param(b"\x91" * 1000, id="deep"),
        pytest.param(b"x" * 60_000, id="long"),
        pytest.param(asking("Unmount", {"drive": "../..", "use": "read"}), id="path"),
        pytest.param(asking("Mount", {"device": "sda", "diskseq": 1}), id="short"),
        pytest.param(encode(Cancel(1)), id="no request"),
    ],
)
def test_nonsense_is_refused_in_words(helper: Helper, packet: bytes) -> None:
    assert raw(helper, packet) == "HELPER_REFUSED"


def test_descriptors_are_refused_and_not_kept(helper: Helper) -> None:
    read, write = os.pipe()
    assert raw(helper, requests.encode(requests.ListCgroups()), fds=(write,)) == "HELPER_REFUSED"
    os.close(write)
    assert os.read(read, 1) == b"", "the helper holds no copy"
    os.close(read)


def test_silent_connections_keep_no_client_out(helper: Helper) -> None:
    idle = []
    for _ in range(MOST_CHILDREN // 2):
        silent = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        silent.connect(str(helper.socket))
        idle.append(silent)
    assert helper.is_well()
    for silent in idle:
        silent.close()


def test_so_much_is_done_at_once_and_no_more(helper: Helper) -> None:
    def crowd() -> str:
        silent = [
            socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(MOST_CHILDREN)
        ]
        for one in silent:
            one.connect(str(helper.socket))
        try:
            helper.client.ask(requests.ListCgroups())
        except NondumError as error:
            return error.code
        finally:
            for one in silent:
                one.close()
        return ""

    assert served(crowd) == "HELPER_BUSY"


def test_flood_is_answered_or_turned_away(helper: Helper) -> None:
    def flood() -> list[str]:
        asked = []
        for _ in range(3 * MOST_CHILDREN):
            one = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            one.settimeout(10)
            try:
                one.connect(str(helper.socket))
            except BlockingIOError:  # as many wait as may
                one.close()
                continue
            asked.append(one)
        said = []
        for one in asked:
            try:
                one.send(requests.encode(requests.ListCgroups()))
                said.append(code(answered(one)))
            except OSError:
                said.append("hung up")
        return said

    assert set(served(flood)) <= {"", "HELPER_BUSY", "hung up"}

    def serves() -> bool:
        try:
            return helper.is_well()
        except NondumError:  # the last of them are still being served
            return False

    until("the helper serves again", serves)


def test_helper_forks_as_a_process_of_one_thread(helper: Helper) -> None:
    assert helper.is_well()
    status = Path(f"/proc/{helper.process.pid}/status").read_text(encoding="ascii")
    assert "\nThreads:\t1\n" in status


def test_helper_that_is_told_to_end_as_it_forks_ends(place: Path) -> None:
    """Exceptions in callbacks of a fork are dropped, also those of a signal handler."""
    helper = started(
        place,
        "-c",
        "import os, signal\n"
        "from nondum.host.sandbox.helper.__main__ import main\n"
        "told_to_end = lambda: os.kill(os.getpid(), signal.SIGTERM)\n"
        "os.register_at_fork(after_in_parent=told_to_end)\n"
        "main()",
    )
    assert helper.is_well(), "the child that was forked answers"
    assert helper.process.wait() == 0


def test_helper_that_gets_no_more_processes_says_so_and_goes_on(place: Path) -> None:
    helper = started(
        place,
        "-c",
        "import errno\n"
        "from nondum.host.sandbox.levels import refusals\n"
        "from nondum.host.sandbox.levels.filters import Rule\n"
        "from nondum.host.sandbox.helper.__main__ import main\n"
        "from nondum.host.sandbox.inside import kernel\n"
        "calls = ('fork', 'vfork', 'clone', 'clone3')\n"
        "rules = tuple(Rule(call, errno.EAGAIN) for call in calls)\n"
        "kernel.filter_calls(refusals.filter_of({'all': rules}, refusals.machine()))\n"
        "main()",
    )
    for _ in range(2):
        with pytest.raises(NondumError) as refused:
            served(lambda: helper.client.ask(requests.ListCgroups()))
        assert refused.value.code == "HELPER_BUSY"
    helper.process.terminate()
    assert helper.process.wait() == 0


@pytest.fixture
def drive(tmp_path: Path) -> Iterator[Path]:
    """The node of a loop device with a file on it."""
    content = tmp_path / "content"
    content.mkdir()
    (content / "word").write_text("hello")
    make_ext4(content, tmp_path / "drive.img")
    with attached(tmp_path / "drive.img") as node:
        yield node


def name_of(node: Path) -> str:
    with node.open("rb") as device:
        return drive_nodes.drive_name(node.name, drive_nodes.diskseq(device.fileno()))


def test_drive_is_mounted_where_the_helper_says_and_let_go(helper: Helper, drive: Path) -> None:
    name, nowhere = name_of(drive), Path("/etc")
    at = served(lambda: helper.client.mount(drive, nowhere, "ext4", name, "read"))
    assert at == helper.run / "mounts" / name
    assert served(lambda: (at / "word").read_text()) == "hello"
    flags = os.statvfs(at).f_flag
    assert all(flags & f for f in (os.ST_RDONLY, os.ST_NOSUID, os.ST_NODEV, os.ST_NOEXEC))
    other = served(lambda: helper.client.mount(drive, nowhere, "", name, "handover"))
    assert other.is_mount()
    with pytest.raises(NondumError) as refused:
        served(lambda: helper.client.mount(drive, nowhere, "ext4", name, "read"))
    assert "mounted already" in str(refused.value)
    served(lambda: helper.client.unmount(nowhere, name, "read"))
    assert not at.exists()
    served(lambda: helper.client.unmount_all(nowhere))
    assert not other.exists()


def test_other_insertion_and_fixed_disks_are_not_mounted(helper: Helper, drive: Path) -> None:
    for device, number in ((drive.name, 1), ("vda", None), ("sda1", 3)):
        request = requests.Mount(device, number, "ext4", "read")
        assert raw(helper, requests.encode(request)) == "HELPER_REFUSED"
    assert not (helper.run / "mounts").exists() or not os.listdir(helper.run / "mounts")  # noqa: PTH208


def test_file_system_that_is_none_leaves_no_folder(helper: Helper, drive: Path) -> None:
    name = name_of(drive)
    for filesystem in ("vfat", "proc", "overlay"):
        with pytest.raises(NondumError) as refused:
            served(lambda fs=filesystem: helper.client.mount(drive, drive, fs, name, "read"))  # type: ignore[misc]  # bound early
        assert refused.value.code in ("FS_ERROR", "FS_UNSUPPORTED")
    assert not os.listdir(helper.run / "mounts")  # noqa: PTH208


def test_folder_that_became_a_link_is_not_followed(helper: Helper, drive: Path) -> None:
    """Only root could put one there; should it, nothing is mounted elsewhere."""
    name, elsewhere = name_of(drive), helper.run.parent / "elsewhere"
    elsewhere.mkdir()
    (helper.run / "mounts").mkdir(parents=True)
    (helper.run / "mounts" / name).symlink_to(elsewhere)
    with pytest.raises(NondumError):
        served(lambda: helper.client.mount(drive, drive, "ext4", name, "read"))
    assert not elsewhere.is_mount()


def test_cgroups_hold_processes_of_the_served_user_only(helper: Helper) -> None:
    sleeper = subprocess.Popen(["sleep", "60"], user=SERVED.pw_uid)
    somebody = subprocess.Popen(["sleep", "60"], user=STRANGER.pw_uid)

    def cgroup() -> tuple[int, ...]:
        cgroups = Cgroups(helper.client.cgroups())
        assert cgroups.holds
        made = cgroups.make("lamp", CgroupLimits(memory_mb=64, tasks=8))
        made.add(sleeper.pid)
        for pid in (somebody.pid, os.getppid(), 1):
            with pytest.raises(OSError, match="HELPER_REFUSED"):
                made.add(pid)
        held = made.pids()
        assert made.usage().tasks in (0, 1)
        assert made.end()
        cgroups.sweep()
        return held

    assert served(cgroup) == (sleeper.pid,)
    assert sleeper.wait(5) == -signal.SIGKILL
    assert somebody.poll() is None
    somebody.kill()
    somebody.wait()


def test_helper_ends_when_no_request_comes(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        command = [sys.executable, "-m", "nondum.host.sandbox.helper", "--user", SERVED.pw_name]
        done = subprocess.run(
            ["sh", "-c", START, "sh", *command, "--idle-s", "0.1", "--run", str(tmp_path)],
            preexec_fn=lambda: os.dup2(listening.fileno(), 3),
            pass_fds=(3,),
            timeout=20,
            check=False,
        )
    assert done.returncode == 0


def no_key() -> PressesOfDevice:
    raise requests.refused("there is none")


def test_only_the_key_that_root_names_is_listened_to(helper: Helper, golden: Golden) -> None:
    with pytest.raises(NondumError) as refused:
        served(lambda: helper.client.stop_key(Path("/dev/input/event0"), 1))
    assert refused.value.code == "HELPER_REFUSED"
    golden.check("no stop key is named", refused.value.problems[0].message)


def test_presses_of_the_stop_key_are_told_until_it_is_gone() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    device, keyboard = os.pipe2(os.O_NONBLOCK)
    nodes, lamps = Nodes(Path("/nowhere"), 1), Lamps((), Path("/nowhere"))
    service = Service(
        *(1, Path("/nowhere"), Disks(), nodes, NoTree(), lambda: lamps),
        lambda: PressesOfDevice(device, 119, is_down=True),
    )
    with ours, theirs:
        ours.send(requests.encode(requests.ListenToStopKey()))
        told: list[Reply] = []
        serving = threading.Thread(target=lambda: told.append(answer(theirs, service)))
        serving.start()
        assert decode(ours.recv(100)) == Event("listening", 1, {"down": True})
        os.write(keyboard, EVENT.pack(0, 0, EV_KEY, 119, 1))
        assert decode(ours.recv(100)) == Event("pressed", 1, {"times": 1})
        os.close(keyboard)
        serving.join()
    assert [code(reply) for reply in told] == ["HELPER_FAILED"]


@pytest.mark.parametrize("said", [b"", encode(Reply(1, {})), b"nonsense"])
def test_helper_that_listens_no_more_is_noticed(said: bytes) -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.settimeout(0)
    with ours, theirs:
        presses = PressesOfHelper(ours, is_down=False)
        assert presses.read() == 0
        theirs.send(encode(Event("pressed", 1, {"times": 2})))
        assert presses.read() == 2
        theirs.send(said) if said else theirs.close()
        with pytest.raises(ConnectionResetError):
            presses.read()


def test_nodes_go_when_the_kernel_tells_that_their_device_has_gone(tmp_path: Path) -> None:
    hidraw, sys = "devices/usb1/1-2/1-2:1.0/hidraw/hidraw0", tmp_path / "sys"
    (sys / hidraw).mkdir(parents=True)
    (sys / "dev/char").mkdir(parents=True)
    (sys / "dev/char/240:3").symlink_to(sys / hidraw)
    nodes = Nodes(tmp_path / "run", SERVED.pw_uid, sys=sys)
    mine = nodes.put("eye", "line", 240, 3)
    lamps = Lamps((), tmp_path / "lamps.json")
    service = Service(
        SERVED.pw_uid, tmp_path / "m", Disks(), nodes, NoTree(), lambda: lamps, no_key
    )
    told, kernel = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ending, _ = os.pipe()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening, told, kernel:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        server = threading.Thread(target=Server(listening, service, ending, told, 0.05).run)
        server.start()
        kernel.send(REMOVED)
        server.join()  # once there is no node, it ends when no request comes
    assert not mine.exists()


@pytest.mark.parametrize(
    "other",
    [
        REMOVED.replace(b"remove", b"add"),
        REMOVED.replace(b"=hidraw", b"=block"),
        REMOVED.replace(b"=240", b"=x"),
        REMOVED.partition(b"MINOR")[0],
        b"libudev\0\xfe\xed\xca\xfe",
        b"",
    ],
    ids=["added", "a disk", "no number", "no node", "udev's", "nothing"],
)
def test_other_messages_are_of_no_device_that_has_gone(other: bytes) -> None:
    assert removals.removed(REMOVED) == (240, 3)
    assert removals.removed(other) is None


def test_kernel_lets_the_helper_listen() -> None:
    with removals.listen() as uevents:
        assert uevents.getsockname()[1] == 1


def test_helper_is_started_by_its_socket_only() -> None:
    command = [sys.executable, "-m", "nondum.host.sandbox.helper"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={})
    assert done.returncode == 1
    assert "nondum-helper.socket" in done.stderr or "nondum" in done.stderr


def test_missing_helper_is_told(tmp_path: Path) -> None:
    with pytest.raises(NondumError) as silent:
        HelperClient(tmp_path / "none").ask(requests.ListCgroups())
    assert silent.value.code == "HELPER_SILENT"
    assert "systemctl" in silent.value.problems[0].fix


def test_helper_that_cannot_be_asked_for_want_of_a_descriptor_is_told(tmp_path: Path) -> None:
    client = HelperClient(tmp_path / "none")
    with descriptors_left(0):
        with pytest.raises(NondumError) as silent:
            client.ask(requests.ListCgroups())
        client.unmount(tmp_path, "sda1-3", "read")
    assert silent.value.code == "HELPER_SILENT"


def test_helper_that_hangs_up_is_told(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        hanging_up = threading.Thread(target=lambda: listening.accept()[0].close())
        hanging_up.start()
        with pytest.raises(NondumError) as silent:
            HelperClient(tmp_path / "s").ask(requests.ListCgroups())
        hanging_up.join()
    assert silent.value.code == "HELPER_SILENT"


@pytest.mark.parametrize("has_begun", [True, False])
def test_helper_is_waited_for_until_it_has_begun_and_then_until_it_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_begun: bool
) -> None:
    """A machine that is slow to start it does not make it one that hangs."""
    monkeypatch.setattr(client, "WAIT_S" if has_begun else "START_S", 0.01)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()

        def begin() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(MAX_PACKET)
                connection.send(encode(Event(requests.HEARD, requests.CALL, {})))
                connection.recv(MAX_PACKET)

        beginning = threading.Thread(target=begin)
        if has_begun:
            beginning.start()
        with pytest.raises(NondumError) as silent:
            HelperClient(tmp_path / "s").ask(requests.ListCgroups())
        if has_begun:
            beginning.join()
    assert silent.value.code == "HELPER_SILENT"


def test_helper_that_says_something_else_is_told(tmp_path: Path) -> None:
    def tell() -> None:
        connection, _ = listening.accept()
        with connection:
            connection.recv(MAX_PACKET)
            connection.send(encode(Event("pressed", requests.CALL, {"times": 1})))

    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        telling = threading.Thread(target=tell)
        telling.start()
        with pytest.raises(NondumError) as silent:
            HelperClient(tmp_path / "s").ask(requests.ListCgroups())
        telling.join()
    assert silent.value.code == "HELPER_SILENT"
