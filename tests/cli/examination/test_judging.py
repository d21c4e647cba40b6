"""What the doctor makes of what it sees: what is bad, what is doubtful, and what to do about it."""

from __future__ import annotations

import errno
import os
import socket
from datetime import timedelta
from pathlib import Path

import pytest
from tests.kit.signing import Key, signed, trust_of

from nondum.cli.examination import account, beliefs, clock, daemon, drives, machine, space
from nondum.cli.examination.examination import examine
from nondum.cli.examination.finding import Finding, Result
from nondum.host.config.effective import Asked
from nondum.host.config.host_config import HostConfig, InstallSection
from nondum.host.config.parsing import parse
from nondum.host.sources.drives.disk_report import Disk, Owner
from nondum.wheelhouse.trust.judging import EARLIEST

ROOT, MALLORY = Key("root"), Key("mallory")
FULL = ("cpuset", "cpu", "io", "memory", "pids")
TODAY = EARLIEST + timedelta(days=1)
TODAY_S = TODAY.timestamp()
CARDS = " 0 [Loopback       ]: Loopback - Loopback\n                      Loopback 1\n"


@pytest.mark.parametrize(
    ("finding", "result", "words"),
    [
        (machine.judge_cgroups(FULL), "ok", "memory, pids, cpu"),
        (machine.judge_cgroups(("cpu", "pids")), "warn", "cgroup_enable=memory"),
        (machine.judge_cgroups(("memory",)), "warn", "without pids, cpu"),
        (machine.judge_cgroups(None), "warn", "unified_cgroup_hierarchy"),
        (machine.judge_udev(is_there=True, is_wanted=True), "ok", "it runs"),
        (machine.judge_udev(is_there=False, is_wanted=True), "bad", "systemd-udevd"),
        (machine.judge_udev(is_there=False, is_wanted=False), "ok", "devices.udev"),
        (machine.judge_usb(("usb1", "1-0:1.0", "1-1"), is_wanted=True), "ok", "1 things"),
        (machine.judge_usb((), is_wanted=True), "warn", "no USB bus"),
        (machine.judge_sound(CARDS), "ok", "Loopback"),
        (machine.judge_sound("--- no soundcards ---\n"), "warn", "no sound card"),
        (account.judge_service_user(is_there=True), "ok", "nondum"),
        (account.judge_service_user(is_there=False), "warn", "systemd-sysusers"),
        (account.judge_groups(0, (), account.USEFUL), "ok", "root"),
        (account.judge_groups(1000, ("video",), ("video", "dialout")), "warn", "dialout"),
        (account.judge_groups(1000, ("video",), ("video",)), "ok", "all groups"),
        (daemon.judge_helper("", 1000), "ok", "reached"),
        (daemon.judge_helper("Permission denied", 1000), "ok", "daemon's user alone"),
        (daemon.judge_helper("No such file or directory", 1000), "bad", "nondum-helper.socket"),
        (daemon.judge_helper("Connection refused", 0), "ok", "root"),
        (space.judge_free(64, 64, 4096), "bad", "no payload is installed"),
        (space.judge_free(900, 64, 4096), "warn", "quota_mb"),
        (space.judge_free(9000, 64, 4096), "ok", "9000 MB are free"),
        (drives.judge(Disk("sda", 9, True, Owner.DRIVE, "")), "ok", "read as a drive"),
        (drives.judge(Disk("sda", 9, True, Owner.NONE, "has partitions")), "ok", "partitions"),
        (drives.judge(Disk("sda", 9, True, Owner.HOST, "it is /srv")), "ok", "alone: it is /srv"),
        (drives.judge(Disk("sda", 9, True, Owner.SOMEBODY, "at /mnt")), "warn", "at /mnt unmount"),
        (
            clock.judge(0.0, is_kept=False, is_synchronised=False),
            "bad",
            "CLOCK_UNSURE it says 1970-01-01",
        ),
        (clock.judge(TODAY_S, is_kept=False, is_synchronised=False), "warn", "battery"),
        (clock.judge(TODAY_S, is_kept=True, is_synchronised=None), "warn", "timesyncd"),
        (clock.judge(TODAY_S, is_kept=False, is_synchronised=True), "ok", f"{TODAY:%F}"),
        (beliefs.judge_planners(("native",)), "ok", "native"),
        (beliefs.judge_planners(()), "bad", "no goal has a plan"),
    ],
)
def test_what_is_seen_is_judged(finding: Finding, result: str, words: str) -> None:
    assert finding.result.value == result
    assert words in f"{finding.detail} {finding.fix}"
    assert bool(finding.fix) == (finding.result is not Result.OK), "what is to be done?"


def test_trust_file_is_looked_into(tmp_path: Path) -> None:
    file = tmp_path / "trust.toml"
    assert beliefs.trust(file, allow_unsigned=False).result is Result.BAD
    assert beliefs.trust(file, allow_unsigned=True).result is Result.WARN
    file.write_text("nonsense", encoding="utf-8")
    found = beliefs.trust(file, allow_unsigned=False)
    assert (found.result, "TRUST_TOML" in found.detail) == (Result.BAD, True)


@pytest.mark.parametrize(
    ("signer", "result", "told"),
    [
        (None, Result.OK, "unsigned, placed by"),
        (ROOT, Result.OK, "signed by its roots"),
        (MALLORY, Result.BAD, "TRUST_SIGNATURE"),
    ],
)
def test_who_vouches_for_the_trust_file_is_told(
    tmp_path: Path, signer: Key | None, result: Result, told: str
) -> None:
    file = tmp_path / "trust.toml"
    given = signed(trust_of(roots=[ROOT]), *([signer] if signer is not None else []))
    file.write_bytes(given.data)
    file.chmod(0o644)
    if given.signature is not None:
        file.with_name("trust.toml.sig").write_bytes(given.signature)
    found = beliefs.trust(file, allow_unsigned=False)
    assert found.result is result
    assert told in found.detail


def test_service_that_is_not_started_at_boot_is_told(tmp_path: Path) -> None:
    link = tmp_path / "nondum.service"
    assert daemon.judge_service(is_systemd=True, link=link).result is Result.WARN
    assert daemon.judge_service(is_systemd=False, link=link).result is Result.OK
    link.symlink_to("/nowhere")
    assert daemon.judge_service(is_systemd=True, link=link).result is Result.OK


def test_disk_and_folder_of_the_configuration_are_looked_at(tmp_path: Path) -> None:
    config = parse(f'[host]\nstate = "{tmp_path}/not/yet"\n', "x", HostConfig())
    assert [finding.check for finding in space.examine(config)] == ["state", "disk"]
    huge = parse(f'[host]\nstate = "{tmp_path}"\n[install]\nreserve_mb = 999999999\n', "x", config)
    assert huge.install != InstallSection()
    assert [finding.result for finding in space.examine(huge)][1] is Result.BAD


def test_helper_that_listens_is_reached(tmp_path: Path) -> None:
    path = tmp_path / "helper.sock"
    assert os.strerror(errno.ENOENT) in daemon._reached(path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        listener.bind(str(path))
        listener.listen()
        assert daemon._reached(path) == ""


def test_everything_is_looked_at_even_where_the_configuration_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "host.toml"
    file.write_text("[hots]\n[drvies]\n", encoding="utf-8")
    found = list(examine(Asked(is_user=True, file=file)))
    wrong = [finding for finding in found if finding.check == "config"]
    assert [finding.result for finding in wrong] == [Result.BAD, Result.BAD]
    assert {"user", "daemon", "cgroups", "udev", "confinement", "disk", "clock", "trust"} <= {
        finding.check for finding in found
    }
