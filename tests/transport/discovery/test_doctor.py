"""What keeps hosts from finding each other is named, with what to do about it."""

from __future__ import annotations

import asyncio
import ipaddress
import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from demo.namespaces import Machine, Network
from tests.kit.command_line import command
from tests.transport.discovery.hosts import Host, here, seeking

from nondum.transport.discovery.doctor import Result, judge_interface, judge_used, try_tcp, try_udp
from nondum.transport.discovery.interfaces import Flags, Interface, looked_on

ADDRESS = (ipaddress.ip_interface("10.77.0.1/24"),)
ON = Flags.UP | Flags.RUNNING | Flags.MULTICAST


@pytest.mark.parametrize(
    ("interface", "result", "told"),
    [
        (Interface("eth0", 2, ON, ADDRESS), Result.OK, "as 10.77.0.1"),
        (Interface("eth0", 2, ON & ~Flags.RUNNING, ADDRESS), Result.WARN, "no link"),
        (Interface("eth0", 2, ON), Result.WARN, "no address"),
        (Interface("eth0", 2, Flags.MULTICAST, ADDRESS), Result.OK, "switched off"),
        (Interface("tun0", 2, Flags.UP | Flags.RUNNING, ADDRESS), Result.WARN, "no multicast"),
    ],
    ids=["good", "cable out", "no DHCP", "off", "tunnel"],
)
def test_an_interface_is_judged_by_its_state(
    interface: Interface, result: Result, told: str
) -> None:
    found = judge_interface(interface, is_used=interface in looked_on([interface]))
    assert (found.result, told in found.detail) == (result, True)
    assert (found.fix == "") == (result is Result.OK)


def test_bridges_for_containers_are_used_only_without_another_interface() -> None:
    docker = Interface("docker0", 3, ON, ADDRESS)
    assert looked_on([docker, Interface("eth0", 2, ON, ADDRESS)])[0].name == "eth0"
    assert looked_on([docker]) == (docker,)
    assert "containers" in judge_interface(docker, is_used=False).detail


def test_without_any_network_only_this_machine_is_left() -> None:
    lo = Interface("lo", 1, Flags.UP | Flags.RUNNING | Flags.LOOPBACK, ADDRESS)
    assert looked_on([lo]) == (lo,)
    assert judge_used([lo]).result is judge_used([]).result is Result.BAD


class TestPorts:
    def test_a_free_port_is_fine(self) -> None:
        port = here("rover").port
        assert (try_tcp(port).result, try_udp(port).result) == (Result.OK, Result.OK)

    def test_another_program_is_in_the_way(self) -> None:
        port = here("rover").port
        with (
            socket.create_server(("127.0.0.1", port)),
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        ):
            other.bind(("127.0.0.1", port))
            for found in (try_tcp(port), try_udp(port)):
                assert found.result is Result.BAD
                assert "peers.listen" in found.fix

    @pytest.mark.anyio
    async def test_the_daemon_itself_is_not(self) -> None:
        rover = here("rover")
        async with seeking(rover, multicast=False):
            found = await asyncio.to_thread(try_udp, rover.port)
        assert (found.result, "rover" in found.detail) == (Result.OK, True)


@pytest.mark.daemon
class TestMachines:
    @pytest.fixture
    def network(self) -> Iterator[Network]:
        with Network() as network:
            yield network

    def test_a_machine_on_a_network_is_well_with_and_without_a_daemon(
        self, network: Network
    ) -> None:
        (machine,) = network.lan("rover")
        code, found = examined(machine)
        assert (code, bad(found)) == (0, [])
        assert {"IPv4 multicast", "IPv6 multicast"} <= {one["check"] for one in found}
        Host(machine)
        code, found = examined(machine)
        assert (code, bad(found)) == (0, [])
        assert any("the daemon of rover" in one["detail"] for one in found)

    def test_a_machine_without_a_network_is_not(self, network: Network) -> None:
        code, found = examined(network.machine("rover"))
        assert (code, bad(found)) == (3, ["network"])

    def test_a_program_that_has_multicast_dns_for_itself_is_told(self, network: Network) -> None:
        (machine,) = network.lan("rover")
        hog = machine.start(sys.executable, "-c", HOG, stdout=subprocess.PIPE)
        assert hog.stdout is not None
        hog.stdout.readline()
        code, found = examined(machine)
        assert (code, bad(found)) == (3, ["IPv4 multicast", "IPv6 multicast"])

    def test_too_few_memberships_are_told(self, network: Network) -> None:
        machine, switch = network.machine("rover"), network.switch()
        for _ in range(2):
            network.plug(machine, switch)
        machine.set("net.ipv4.igmp_max_memberships", 1)
        code, found = examined(machine)
        assert (code, bad(found)) == (3, ["memberships"])


HOG = """
import socket
hog = socket.socket(socket.AF_INET6, socket.SOCK_DGRAM)
hog.bind(("", 5353))
print("mine", flush=True)
hog.recv(1)
"""


def examined(machine: Machine) -> tuple[int, list[dict[str, Any]]]:
    """What the command says on a machine: its exit code and findings."""
    words = machine.command(*command("doctor", "network", "--json"))
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.returncode, json.loads(done.stdout)["findings"]


def bad(found: list[dict[str, Any]]) -> list[str]:
    """The checks that keep hosts from being found."""
    return [one["check"] for one in found if one["result"] == "bad"]
