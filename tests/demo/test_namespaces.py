"""Machines and switches made of namespaces behave as real ones, and leave nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.namespaces import ROOT, Cable, Machine, Network

pytestmark = pytest.mark.daemon

LISTEN = """
import socket
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
    sock.bind(("", 9))
    print("listening", flush=True)
    while True:
        data, sender = sock.recvfrom(100)
        sock.sendto(data, sender)
"""
ASK = """
import socket, sys
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
    sock.settimeout(0.1)
    for _ in range(int(sys.argv[2])):
        try:
            sock.sendto(b"hello", (sys.argv[1], 9))
            sock.recv(100)
            sys.exit(0)
        except OSError:
            pass
    sys.exit(1)
"""
STAND_FOR_A_MACHINE = """
import fcntl, os, struct, sys
IFF_TAP, IFF_NO_PI, TUNSETIFF = 0x2, 0x1000, 0x400454CA
tap = os.open("/dev/net/tun", os.O_RDWR)
fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH22x", sys.argv[1].encode(), IFF_TAP | IFF_NO_PI))
print("plugged in", flush=True)
while b"hello" not in os.read(tap, 2000):
    pass
"""
CALL = """
import socket, sys
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    sock.sendto(b"hello", ("10.77.0.255", 9))
"""
A_WHILE, LONG = "5", "100"
"""How often is asked, ten times a second: a machine that was cut off forgets it in a second."""
MADE = """
import sys
from demo.namespaces import Network
network = Network().__enter__()
network.lan("rover", "base")[0].start("sleep", "1000")
print("made", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def network() -> Iterator[Network]:
    with Network() as network:
        yield network


def echoing(machine: Machine) -> Cable:
    """Have a machine answer; its first cable."""
    process = machine.start(sys.executable, "-c", LISTEN, stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    return machine.cables[0]


def reaches(machine: Machine, cable: Cable) -> bool:
    return machine.start(sys.executable, "-c", ASK, cable.address, LONG).wait() == 0


def is_cut_off(machine: Machine, cable: Cable) -> bool:
    return machine.start(sys.executable, "-c", ASK, cable.address, A_WHILE).wait() == 1


def left() -> list[str]:
    listed = subprocess.run(["ip", "netns", "list"], capture_output=True, text=True, check=True)
    return [line for line in listed.stdout.splitlines() if line.startswith("nondum-")]


def test_machines_on_one_switch_reach_each_other_until_a_cable_is_pulled(network: Network) -> None:
    rover, base = network.lan("rover", "base")
    cable = echoing(base)
    assert reaches(rover, cable)
    cable.pull()
    assert is_cut_off(rover, cable)
    assert "NO-CARRIER" in base.ip("link", "show", cable.interface)
    cable.put_back()
    assert reaches(rover, cable)


@pytest.mark.parametrize("lose", [Cable.lose_sent, Cable.lose_received])
def test_one_way_loses_everything_until_it_is_healed(network: Network, lose: object) -> None:
    rover, base = network.lan("rover", "base")
    cable = echoing(base)
    assert callable(lose)
    lose(cable)
    assert is_cut_off(rover, cable)
    assert "state UP" in base.ip("link", "show", cable.interface)
    cable.heal()
    assert reaches(rover, cable)


def test_halves_of_a_switch_are_apart_and_no_link_goes_down(network: Network) -> None:
    rover, base, camp = network.lan("rover", "base", "camp")
    cable = echoing(base)
    network.switches[0].split([cable, camp.cables[0]])
    assert is_cut_off(rover, cable)
    assert reaches(camp, cable)
    assert "state UP" in base.ip("link", "show", cable.interface)
    network.switches[0].join()
    assert reaches(rover, cable)


def test_two_switches_are_two_networks(network: Network) -> None:
    (rover,), (base,) = network.lan("rover"), network.lan("base")
    cable = echoing(base)
    assert cable.address == "10.77.1.1"
    assert is_cut_off(rover, cable)
    network.plug(rover, network.switches[1])
    assert reaches(rover, cable)


def test_nothing_is_left_behind_and_the_own_network_untouched() -> None:
    before = Path("/proc/net/dev").read_text(encoding="ascii").count("\n")
    with Network() as network:
        (rover,) = network.lan("rover")
        process = rover.start("sh", "-c", "echo there; sleep 1000", stdout=subprocess.PIPE)
        assert process.stdout is not None
        assert process.stdout.readline() == b"there\n"
        assert Path("/proc/net/dev").read_text(encoding="ascii").count("\n") == before
    assert process.returncode == -signal.SIGKILL
    assert not [name for name in left() if f"-{os.getpid()}-" in name]


def test_what_a_killed_process_has_left_is_removed_by_the_next() -> None:
    words = [sys.executable, "-c", MADE]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, cwd=ROOT, stdin=pipe, stdout=pipe) as killed:
        assert killed.stdout is not None
        killed.stdout.readline()
        # While it lives: once it is dead, the next process that makes a network removes them.
        assert len([name for name in left() if f"-{killed.pid}-" in name]) == 3
        killed.kill()
    with Network():
        assert not [name for name in left() if f"-{killed.pid}-" in name]


def test_program_that_stands_for_a_machine_receives_broadcasts(network: Network) -> None:
    switch, rover = network.switch(), network.machine("rover")
    network.plug(rover, switch)
    switch.add_tap("tap1")
    where = ("ip", "netns", "exec", switch.namespace)
    command = [*where, sys.executable, "-c", STAND_FOR_A_MACHINE, "tap1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as emulator:
        assert emulator.stdout is not None
        assert emulator.stdout.readline() == b"plugged in\n"
        while emulator.poll() is None:  # bridges learn in their own time
            rover.run(sys.executable, "-c", CALL)
    assert emulator.returncode == 0
