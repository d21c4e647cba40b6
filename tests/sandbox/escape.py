"""A hostile plugin: tries what a worker must not be able to do, and reports what it could.

A separate child makes each attempt, which succeeded if it returns anything but None: what was
reached. One that returns `judge` succeeded if the test, on the host, finds it so (`baits.JUDGES`).
`bait` (a setting) says what there is to be reached on the host. It stands by itself: its text is
the only module of a wheel.
"""

from __future__ import annotations

import ctypes
import fcntl
import json
import mmap
import os
import pty
import resource
import signal
import socket
import stat
import struct
import termios
import time
from collections.abc import Callable, Iterator
from typing import Any

from nondum.sdk import Context, hookimpl

Bait = dict[str, Any]
Attempt = Callable[[Bait], Any]

LIBC = ctypes.CDLL(None, use_errno=True)
ATTEMPT_S = 10
MEGABYTE = 1024 * 1024
IS_ARM = os.uname().machine == "aarch64"
ATTEMPTS: dict[str, Attempt] = {}


def attempt(function: Attempt) -> Attempt:
    ATTEMPTS[function.__name__.replace("_", " ")] = function
    return function


def call(x86_64: int, aarch64: int, *arguments: Any) -> int:
    """A system call; raises what it fails with: EPERM or ENOSYS, if it is refused altogether."""
    ctypes.set_errno(0)
    given = [ctypes.c_long(a) if isinstance(a, int) else a for a in arguments]
    result: int = LIBC.syscall(ctypes.c_long(aarch64 if IS_ARM else x86_64), *given)
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def reaches_kernel(x86_64: int, aarch64: int, *arguments: Any) -> str:
    """Whether a call with useless arguments gets past who may make it."""
    try:
        return f"returned {call(x86_64, aarch64, *arguments)}"
    except OSError as error:
        if error.errno in (1, 13, 28, 38):  # the last but one: a limit of namespaces
            raise
        return f"judged by the kernel: {error.strerror}"


@attempt
def read_a_file_of_the_host(bait: Bait) -> Any:
    return open(bait["secret"]).read()


@attempt
def write_a_file_of_the_host(bait: Bait) -> Any:
    path = os.path.join(bait["folder"], "written")
    open(path, "w").close()
    return {"judge": ["exists", path]}


@attempt
def read_another_payload(bait: Bait) -> Any:
    return open(bait["other_code"]).read()


@attempt
def read_the_scratch_of_another(bait: Bait) -> Any:
    return open(bait["other_scratch"]).read()


@attempt
def see_what_init_sees(bait: Bait) -> Any:
    return os.listdir("/.host/dev") or None


@attempt
def write_to_the_system(bait: Bait) -> Any:
    return written("/usr/nondum-escape")


@attempt
def write_to_the_root(bait: Bait) -> Any:
    return written("/nondum-escape")


@attempt
def write_to_dev(bait: Bait) -> Any:
    return written("/dev/nondum-escape")


@attempt
def write_among_its_devices(bait: Bait) -> Any:
    return written("/dev/nondum/nondum-escape")


@attempt
def change_its_own_code(bait: Bait) -> Any:
    return written(os.path.join(os.path.dirname(os.path.abspath(__file__)), "escape"))


@attempt
def leave_something_in_tmp(bait: Bait) -> Any:
    path = os.path.join(bait["tmp"], "left")
    open(path, "w").close()
    return {"judge": ["exists", path]}


@attempt
def make_a_device_node(bait: Bait) -> Any:
    path = os.path.join(os.getcwd(), "node")
    os.mknod(path, 0o600 | 0o020000, os.makedev(1, 3))
    os.close(os.open(path, os.O_RDWR))
    os.unlink(path)
    return "a node that it made and that opens"


@attempt
def open_a_device_node_that_lies_there(bait: Bait) -> Any:
    os.close(os.open("node-of-before", os.O_RDONLY))
    return "a node in its scratch folder"


@attempt
def leave_a_set_id_file(bait: Bait) -> Any:
    """For any user of the host to run, in any of the ways to make one."""
    path = os.path.join(os.getcwd(), "set-id")
    for way in (_by_chmod, _by_open, _without_a_name, _by_mknod, _by_newer_calls):
        try:
            way(path, 0o6755)
            return {"judge": ["is set-id", path]}
        except OSError as error:
            last = error
            if os.path.exists(path):
                os.unlink(path)
    raise last


def _by_chmod(path: str, mode: int) -> None:
    os.close(os.open(path, os.O_CREAT | os.O_WRONLY, 0o600))
    os.chmod(path, mode)


def _by_open(path: str, mode: int) -> None:
    os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))


def _without_a_name(path: str, mode: int) -> None:
    nameless = os.open(".", os.O_TMPFILE | os.O_WRONLY, mode)
    os.link(f"/proc/self/fd/{nameless}", path, follow_symlinks=True)


def _by_mknod(path: str, mode: int) -> None:
    os.mknod(path, stat.S_IFREG | mode)


def _by_newer_calls(path: str, mode: int) -> None:
    how = struct.pack("=QQQ", os.O_CREAT | os.O_WRONLY, mode, 0)
    call(437, 437, -100, path.encode(), how, len(how))


@attempt
def change_the_mode_of_a_file_of_the_host(bait: Bait) -> Any:
    os.chmod(bait["victim"], 0o666)
    return {"judge": ["has mode", bait["victim"], 0o666]}


@attempt
def change_the_mode_of_its_code(bait: Bait) -> Any:
    os.fchmod(os.open(os.path.abspath(__file__), os.O_RDONLY), 0o666)
    return {"judge": ["has mode", os.path.abspath(__file__), 0o666]}


@attempt
def change_the_mode_of_a_device_of_the_host(bait: Bait) -> Any:
    """Of one that is there at every level."""
    os.chmod("/dev/full", bait["mode"])
    return {"judge": ["has mode", "/dev/full", bait["mode"]]}


@attempt
def change_the_time_of_a_file_of_the_host(bait: Bait) -> Any:
    os.utime(bait["victim"], (1, 1))
    return {"judge": ["was read", bait["victim"], 1]}


@attempt
def set_an_attribute_of_a_file_of_the_host(bait: Bait) -> Any:
    os.setxattr(bait["victim"], "user.nondum", b"escape")
    return {"judge": ["has attribute", bait["victim"], "user.nondum"]}


@attempt
def open_a_file_of_the_host_neither_to_read_nor_to_write(bait: Bait) -> Any:
    os.close(os.open(bait["victim"], os.O_ACCMODE))
    return bait["victim"]


@attempt
def truncate_a_file_of_the_host(bait: Bait) -> Any:
    try:
        os.truncate(bait["victim"], 0)
    except OSError:
        os.close(os.open(bait["victim"], os.O_ACCMODE | os.O_TRUNC))
    return {"judge": ["is empty", bait["victim"]]}


@attempt
def slow_a_process_of_the_host_down(bait: Bait) -> Any:
    if not is_bait(bait):
        return None
    pid = bait["pid"]
    for way in (
        lambda: os.sched_setscheduler(pid, os.SCHED_IDLE, os.sched_param(0)),
        lambda: os.sched_setaffinity(pid, {min(os.sched_getaffinity(pid))}),
        lambda: os.setpriority(os.PRIO_PROCESS, pid, 19),
        lambda: os.setpriority(os.PRIO_USER, 0, os.getpriority(os.PRIO_USER, 0)),
        lambda: call(251, 30, 1, pid, 3 << 13),  # ioprio_set: idle
    ):
        try:
            way()
            return f"process {pid}"
        except OSError as error:
            last = error
    raise last


def written(path: str) -> str:
    os.close(os.open(path, os.O_CREAT | os.O_WRONLY))
    os.unlink(path)
    return path


@attempt
def connect_by_tcp(bait: Bait) -> Any:
    socket.create_connection(("127.0.0.1", bait["port"]), 2).close()
    return f"port {bait['port']}"


@attempt
def see_network_interfaces(bait: Bait) -> Any:
    found = [name for _, name in socket.if_nameindex() if name != "lo"]
    return found or None


@attempt
def connect_to_a_path(bait: Bait) -> Any:
    with socket.socket(socket.AF_UNIX) as s:
        s.connect(bait["path_socket"])
    return bait["path_socket"]


@attempt
def connect_to_an_abstract_name(bait: Bait) -> Any:
    with socket.socket(socket.AF_UNIX) as s:
        s.connect("\0" + bait["abstract_socket"])
    return bait["abstract_socket"]


@attempt
def send_a_datagram_to_a_path(bait: Bait) -> Any:
    socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)[0].sendto(b"x", bait["path_datagrams"])
    return bait["path_datagrams"]


@attempt
def send_a_datagram_to_an_abstract_name(bait: Bait) -> Any:
    pair = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    pair[0].sendto(b"x", "\0" + bait["abstract_datagrams"])
    return bait["abstract_datagrams"]


@attempt
def make_an_exotic_pair(bait: Bait) -> Any:
    """A family's own code, and a module that it is in, is reached even if it makes no pairs."""
    for family in (2, 17, 29, 30, 38, 40, 41, 43):  # internet, packet, can, tipc, …
        try:
            socket.socketpair(family, socket.SOCK_DGRAM)
            return f"family {family}"
        except OSError as error:
            last = error
            if error.errno not in (1, 97):  # EPERM, EAFNOSUPPORT
                return f"family {family}: {error.strerror}"
    raise last


@attempt
def make_an_exotic_socket(bait: Bait) -> Any:
    for family in (38, 40, 41, 29, 30, 43):  # alg, vsock, kcm, can, tipc, smc
        for kind in (socket.SOCK_SEQPACKET, socket.SOCK_STREAM, socket.SOCK_DGRAM):
            try:
                socket.socket(family, kind).close()
                return f"family {family}"
            except OSError as error:
                last = error
    raise last


@attempt
def see_a_process_of_the_host(bait: Bait) -> Any:
    return open(f"/proc/{bait['pid']}/cmdline").read()[:40] if is_bait(bait) else None


@attempt
def read_the_environment_of_the_host(bait: Bait) -> Any:
    found = open(f"/proc/{bait['pid']}/environ").read()
    return "environ" if bait["token"] in found else None


@attempt
def read_the_memory_of_the_host(bait: Bait) -> Any:
    if not is_bait(bait):
        return None
    with open(f"/proc/{bait['pid']}/mem", "rb") as memory:
        return str(memory)


@attempt
def signal_the_host(bait: Bait) -> Any:
    if not is_bait(bait):
        return None
    os.kill(bait["pid"], 0)
    return bait["pid"]


@attempt
def look_into_init(bait: Bait) -> Any:
    if bait["pid"] and os.path.exists(f"/proc/{bait['pid']}"):
        return None  # it is not in a sandbox
    return open("/proc/1/environ").read()[:20]


@attempt
def trace_a_child(bait: Bait) -> Any:
    child = os.fork()
    if child == 0:
        time.sleep(ATTEMPT_S)
        os._exit(0)
    try:
        return reaches_kernel(101, 117, 16, child, 0, 0)  # PTRACE_ATTACH
    finally:
        os.kill(child, signal.SIGKILL)


@attempt
def read_memory_of_another_process(bait: Bait) -> Any:
    buffer = ctypes.create_string_buffer(8)
    vector = struct.pack("PN", ctypes.addressof(buffer), 8)
    call(310, 270, os.getppid(), vector, 1, vector, 1, 0)
    return "process_vm_readv"


@attempt
def limit_another_process(bait: Bait) -> Any:
    call(302, 261, os.getppid(), 7, None, ctypes.create_string_buffer(16))
    return "prlimit"


def is_bait(bait: Bait) -> bool:
    found = f"/proc/{bait['pid']}/cmdline"
    return os.path.exists(found) and bait["token"] in open(found).read()


@attempt
def attach_to_shared_memory(bait: Bait) -> Any:
    LIBC.shmat.restype = ctypes.c_void_p
    identifier = LIBC.shmget(bait["shared_key"], 0, 0)
    if identifier < 0:
        raise OSError(ctypes.get_errno(), "shmget")
    return f"segment {identifier}"


@attempt
def know_the_host_name(bait: Bait) -> Any:
    return socket.gethostname() if socket.gethostname() == bait["host_name"] else None


@attempt
def know_its_control_group(bait: Bait) -> Any:
    found = [line for line in open("/proc/self/cgroup").read().split() if bait["cgroup"] in line]
    return found if bait["cgroup"] and found else None


@attempt
def make_a_user_namespace(bait: Bait) -> Any:
    return reaches_kernel(272, 97, 0x10000000)


@attempt
def call_unshare_at_all(bait: Bait) -> Any:
    return reaches_kernel(272, 97, 0x400)  # CLONE_FILES needs no privilege


@attempt
def clone_into_a_namespace(bait: Bait) -> Any:
    pid = call(56, 220, 0x10000000 | signal.SIGCHLD, 0, 0, 0, 0)
    if pid == 0:
        os._exit(0)
    return "clone"


@attempt
def mount_something(bait: Bait) -> Any:
    os.makedirs("mounted", exist_ok=True)
    call(165, 40, b"tmpfs", b"mounted", b"tmpfs", 0, b"size=4k")
    call(166, 39, b"mounted", 2)
    return "tmpfs"


@attempt
def open_a_mount_tree(bait: Bait) -> Any:
    return reaches_kernel(428, 428, -100, b"/", 0)


@attempt
def hold_capabilities(bait: Bait) -> Any:
    lines = dict(line.split(":\t", 1) for line in open("/proc/self/status") if ":\t" in line)
    held = int(lines["CapEff"], 16) | int(lines["CapPrm"], 16)
    return hex(held) if held else None


@attempt
def gain_privileges(bait: Bait) -> Any:
    lines = dict(line.split(":\t", 1) for line in open("/proc/self/status") if ":\t" in line)
    return None if lines["NoNewPrivs"].strip() == "1" else "no_new_privs is not set"


@attempt
def read_the_environment_it_was_started_with(bait: Bait) -> Any:
    return "a token" if bait["token"] in open("/proc/self/environ").read() else None


@attempt
def be_in_the_session_of_the_host(bait: Bait) -> Any:
    return bait["session"] if os.getsid(0) == bait["session"] else None


@attempt
def be_root(bait: Bait) -> Any:
    return "user 0" if os.getuid() == 0 else os.setuid(0)


@attempt
def rename_the_host(bait: Bait) -> Any:
    socket.sethostname(socket.gethostname())
    return "sethostname"


@attempt
def use_keyrings(bait: Bait) -> Any:
    return reaches_kernel(250, 219, 0, -3, 0)  # KEYCTL_GET_KEYRING_ID


@attempt
def load_a_bpf_program(bait: Bait) -> Any:
    return reaches_kernel(321, 280, 9999, None, 0)


@attempt
def measure_performance(bait: Bait) -> Any:
    attributes = struct.pack("=IIQQQQQ", 1, 112, 0, 0, 0, 0, 0b1100001) + bytes(64)
    return reaches_kernel(298, 241, attributes[:112].ljust(112, b"\0"), 0, -1, -1, 0)


@attempt
def handle_page_faults(bait: Bait) -> Any:
    return reaches_kernel(323, 282, 1)  # UFFD_USER_MODE_ONLY


@attempt
def use_io_uring(bait: Bait) -> Any:
    return reaches_kernel(425, 425, 1, ctypes.create_string_buffer(120))


@attempt
def name_files_by_handle(bait: Bait) -> Any:
    handle = struct.pack("=II", 128, 0) + bytes(128)
    return reaches_kernel(303, 264, -100, b"/", handle, ctypes.create_string_buffer(8), 0)


@attempt
def change_personality(bait: Bait) -> Any:
    return reaches_kernel(135, 92, 0x0040000)  # ADDR_NO_RANDOMIZE


@attempt
def load_a_kernel_module(bait: Bait) -> Any:
    return reaches_kernel(175, 105, None, 0, b"")


@attempt
def read_the_kernel_log(bait: Bait) -> Any:
    return reaches_kernel(103, 116, 3, ctypes.create_string_buffer(512), 512)


@attempt
def type_into_a_terminal(bait: Bait) -> Any:
    _, terminal = pty.openpty()
    os.setsid()
    fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)
    fcntl.ioctl(terminal, termios.TIOCSTI, b"x")
    return "TIOCSTI"


@attempt
def write_a_setting_of_the_kernel(bait: Bait) -> Any:
    for setting in ("/proc/sys/kernel/core_pattern", "/proc/sys/vm/overcommit_memory"):
        with open(setting, "r+") as file:
            return str(file.name)


@attempt
def open_a_disk(bait: Bait) -> Any:
    for name in ("vda", "sda", "nvme0n1", "loop0", "loop1"):
        try:
            os.close(os.open(f"/dev/{name}", os.O_RDONLY))
            return name
        except OSError as error:
            last = error
    raise last


@attempt
def open_the_memory_device(bait: Bait) -> Any:
    os.close(os.open("/dev/kmsg", os.O_RDONLY))
    return "kmsg"


@attempt
def open_a_device_of_another(bait: Bait) -> Any:
    os.close(os.open(bait["terminal"], os.O_RDWR | os.O_NOCTTY))
    return bait["terminal"]


@attempt
def take_all_instances_of_inotify(bait: Bait) -> Any:
    """The kernel counts them by user, and lets one have 128."""
    taken = 0
    while LIBC.inotify_init() >= 0:
        taken += 1
    return taken if taken > bait["few_inotify_instances"] else None


@attempt
def fork_without_end(bait: Bait) -> Any:
    children = []
    try:
        for _ in range(300):
            pid = os.fork()
            if pid == 0:
                time.sleep(ATTEMPT_S)
                os._exit(0)
            children.append(pid)
        return f"{len(children)} processes"
    finally:
        for pid in children:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


@attempt
def take_all_memory(bait: Bait) -> Any:
    try:
        return f"{len(bytearray(512 * MEGABYTE)) // MEGABYTE} MB"
    except MemoryError as error:
        raise OSError(12, "out of memory") from error


@attempt
def take_all_memory_as_shared_memory(bait: Bait) -> Any:
    return f"{held(mmap.mmap(-1, MEGABYTE) for _ in range(512))} MB"


@attempt
def take_all_memory_as_files_in_memory(bait: Bait) -> Any:
    """Each smaller than the largest file, and in all fewer files than it may open."""
    return f"{held(in_memory(16 * MEGABYTE) for _ in range(32))} MB"


def held(maps: Iterator[mmap.mmap]) -> int:
    """Megabytes, once each page was written to."""
    kept = []
    for each in maps:
        kept.append(each)
        for at in range(0, len(each), MEGABYTE):
            each[at : at + MEGABYTE] = bytes(MEGABYTE)
    return sum(map(len, kept)) // MEGABYTE


def in_memory(size: int) -> mmap.mmap:
    descriptor = os.memfd_create("escape")
    os.ftruncate(descriptor, size)
    try:
        return mmap.mmap(descriptor, size)
    finally:
        os.close(descriptor)


@attempt
def open_files_without_end(bait: Bait) -> Any:
    kept = [os.open("/dev/null", os.O_RDONLY) for _ in range(200)]
    return f"{len(kept)} descriptors"


@attempt
def write_a_huge_file(bait: Bait) -> Any:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    return filled("huge", 24, 24)


@attempt
def fill_tmp(bait: Bait) -> Any:
    return filled("/tmp/nondum-escape-fill", 80)


@attempt
def fill_shared_memory(bait: Bait) -> Any:
    return filled("/dev/shm/nondum-escape-fill", 80)


@attempt
def dump_core(bait: Bait) -> Any:
    return "a limit above 0" if resource.getrlimit(resource.RLIMIT_CORE)[1] else None


def filled(path: str, megabytes: int, per_file: int = 8) -> str:
    paths = [f"{path}-{number}" for number in range(-(-megabytes // per_file))]
    try:
        for each in paths:
            with open(each, "wb", buffering=0) as file:
                for _ in range(per_file):
                    if file.write(bytes(MEGABYTE)) < MEGABYTE:
                        raise OSError(28, "no space left")
        return f"{megabytes} MB"
    finally:
        for each in filter(os.path.exists, paths):
            os.unlink(each)


@attempt
def truncate_its_own_code(bait: Bait) -> Any:
    """The last attempt: there is no more of it, then."""
    os.close(os.open(os.path.abspath(__file__), os.O_RDONLY | os.O_TRUNC))
    return {"judge": ["is empty", os.path.abspath(__file__)]}


def tried(name: str, bait: Bait) -> dict[str, Any]:
    """What one attempt, made by a child, came to."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(ATTEMPT_S)
        try:
            found = ATTEMPTS[name](bait)
            said = {"could": found is not None, "what": str(found or "nothing there")}
            if isinstance(found, dict):  # the host's word counts
                said.update(found)
        except BaseException as error:
            said = {"could": False, "what": f"{type(error).__name__}: {error}"}
        os.write(write_end, json.dumps(said).encode()[:4000])
        os._exit(0)
    os.close(write_end)
    heard = b""
    while part := os.read(read_end, 4096):
        heard += part
    os.close(read_end)
    _, status = os.waitpid(child, 0)
    if not heard:
        return {"could": False, "what": f"ended with status {status}"}
    answer: dict[str, Any] = json.loads(heard)
    return answer


@hookimpl
def start(ctx: Context) -> None:
    bait = json.loads(ctx.settings["bait"])
    for name in bait["attempts"] or list(ATTEMPTS):
        print("tried", json.dumps({"name": name, **tried(name, bait)}), flush=True)
    print("tried all", flush=True)
