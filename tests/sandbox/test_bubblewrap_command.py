"""How bubblewrap is called: which namespaces a worker has, and what of the host is there."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.sandbox.inside import mounts
from nondum.host.sandbox.levels.bubblewrap import (
    INSIDE,
    OUTSIDE,
    PLACE_OF_INSIDE,
    PROTECTED,
    SEALED,
    Ground,
    command,
)

SEEN = Path("/srv/nondum/venvs")
FLAGS = (
    *("--unshare-user", "--unshare-pid", "--as-pid-1", "--unshare-ipc", "--unshare-uts"),
    *("--unshare-net", "--unshare-cgroup-try"),
)


def called(*permissions: str) -> list[str]:
    ground = Ground(Path("/usr/bin/python3"), (SEEN,), frozenset(permissions), nodes=("/dev",))
    return command("/usr/bin/bwrap", ground, 3)


def value(words: list[str], flag: str) -> str:
    return words[words.index(flag) + 1]


def binds(words: list[str], flag: str) -> set[tuple[str, str]]:
    return {(words[i + 1], words[i + 2]) for i, word in enumerate(words) if word == flag}


@pytest.mark.parametrize("flag", FLAGS)
def test_sandbox_has_its_own_namespaces(flag: str) -> None:
    assert called().count(flag) == 1


def test_network_is_the_hosts_only_by_permission() -> None:
    assert set(FLAGS) - set(called("network")) == {"--unshare-net"}


def test_settings_of_the_network_are_there_by_permission() -> None:
    always = binds(called(), "--ro-bind-try")
    assert ("/etc/ld.so.cache", "/etc/ld.so.cache") in always
    more = binds(called("network"), "--ro-bind-try") - always
    assert ("/etc/resolv.conf", "/etc/resolv.conf") in more


def test_worker_does_not_know_the_host_name() -> None:
    assert value(called(), "--hostname") == "worker"


def test_interpreter_takes_nothing_from_its_environment() -> None:
    words = called()
    assert words[words.index("--") + 2 :][:4] == ["-I", "-S", "-B", "-u"]


def test_what_root_could_set_is_sealed_and_the_sandbox_itself_protected() -> None:
    assert set(SEALED) == {
        f"/proc/{name}" for name in ("sys", "sysrq-trigger", "irq", "bus", "fs", "acpi")
    }
    assert set(PROTECTED) == {"/", "/dev", mounts.DEVICES}


@pytest.mark.parametrize("permissions", [(), ("network",), ("gpu",)])
def test_nothing_of_the_host_can_be_written_but_what_it_stands_on(
    permissions: tuple[str, ...],
) -> None:
    words = called(*permissions)
    assert binds(words, "--bind") == {(str(SEEN), f"{OUTSIDE}{SEEN}")}
    assert binds(words, "--dev-bind") == {("/dev", f"{OUTSIDE}/dev")}
    assert (str(INSIDE), str(PLACE_OF_INSIDE)) in binds(words, "--ro-bind")
    assert not {word for word in words if word.startswith("--bind-")}
