"""Pairing, trust and keys as people type them, against real control sockets."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import pty
import re
import stat
from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from tests.host.peers.hints import Network
from tests.kit.command_line import Ran, clean_environment, command, nondum
from tests.kit.golden import Golden

from nondum.host.control.arguments import Arguments
from nondum.host.control.server import ControlServer
from nondum.host.peers import trust_orders
from nondum.host.peers.pairing_requests import PairingRequests
from nondum.host.peers.trust_orders import TrustOrders
from nondum.host.peers.trust_store import PeerTrustStore
from nondum.transport.peers import HostKeys, PeerKey, Trust, fingerprint
from nondum.transport.peers.public_file import parse_host

pytestmark = pytest.mark.anyio

PATIENCE_S = 60.0
CODE = re.compile(r"code  (\d{3} \d{3})")


@dataclass(frozen=True)
class Host:
    """The peer part of a daemon, behind its own control socket."""

    trust_store: PeerTrustStore
    control: Path
    known: dict[PeerKey, str]

    async def run(self, *arguments: str | Path) -> Ran:
        return await asyncio.to_thread(nondum, "--control", self.control, "peers", *arguments)

    @contextlib.asynccontextmanager
    async def running(self, *arguments: str) -> AsyncIterator[Typing]:
        """Run a command in a terminal, where a person types."""
        ours, theirs = pty.openpty()
        process = await asyncio.create_subprocess_exec(
            *command("--control", self.control, "peers", *arguments),
            stdin=theirs,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            env=clean_environment() | {"PYTHONUNBUFFERED": "1"},
        )
        os.close(theirs)
        try:
            yield Typing(process, ours)
        finally:
            if process.returncode is None:
                process.kill()
            await process.communicate()
            os.close(ours)


@dataclass
class Typing:
    """A command that asks its person."""

    process: asyncio.subprocess.Process
    terminal: int
    shown: str = ""

    async def shows(self, words: str | re.Pattern[str]) -> str:
        """Wait until it shows that; what it has shown since the last time stays."""
        assert self.process.stdout is not None
        async with asyncio.timeout(PATIENCE_S):
            while not (found := re.search(words, self.shown)):
                some = await self.process.stdout.read(4096)
                assert some, self.shown
                self.shown += some.decode()
        return found.group(found.re.groups)

    def types(self, words: str) -> None:
        os.write(self.terminal, f"{words}\n".encode())

    async def ends(self) -> int:
        assert self.process.stdout is not None
        async with asyncio.timeout(PATIENCE_S):
            self.shown += (await self.process.stdout.read()).decode()
            return await self.process.wait()


@contextlib.asynccontextmanager
async def host(root: Path, name: str, network: Network) -> AsyncIterator[Host]:
    folder = root / name
    trust_store = await PeerTrustStore.open(folder / "peers", name)
    requests = PairingRequests(
        trust_store, announce=network.tells(trust_store), candidates=network.all
    )
    known: dict[PeerKey, str] = {}
    orders = TrustOrders(trust_store, requests, lambda: known)
    answering = {n: _parsing(v) for n, v in trust_orders.answering(orders).items()}
    following = {n: _parsing(v) for n, v in trust_orders.following(orders).items()}
    server = ControlServer(folder / "control.sock", answering, following)
    await server.open()
    try:
        yield Host(trust_store, folder / "control.sock", known)
    finally:
        await server.close()


def _parsing(verb: Any) -> Any:
    return lambda given: verb(Arguments(given))


@pytest.fixture
async def rover(tmp_path: Path) -> AsyncIterator[Host]:
    async with host(tmp_path, "rover", Network()) as found:
        yield found


@pytest.fixture
async def both(tmp_path: Path) -> AsyncIterator[tuple[Host, Host]]:
    network = Network()
    async with host(tmp_path, "rover", network) as rover, host(tmp_path, "base", network) as base:
        yield rover, base


async def test_two_people_pair_their_hosts(both: tuple[Host, Host], golden: Golden) -> None:
    rover, base = both
    async with rover.running("pair") as here, base.running("pair") as there:
        code = await here.shows(CODE)
        assert await there.shows(CODE) == code
        await here.shows(r"Does base show the same code\? \[y/N\]: ")
        await there.shows("Does rover show the same code")
        assert fingerprint(base.trust_store.key) in here.shown
        here.types("y")
        await here.shows("waiting for the person at base")
        there.types("yes")
        assert (await here.ends(), await there.ends()) == (0, 0)
        golden.check_line("paired", here.shown, key=fingerprint(base.trust_store.key))
    assert base.trust_store.trust.paired == {rover.trust_store.key: "rover"}
    assert rover.trust_store.trust.paired == {base.trust_store.key: "base"}


@pytest.mark.parametrize("answer", ["n", "", "yess", "123456"])
async def test_anything_but_yes_is_no(both: tuple[Host, Host], answer: str, golden: Golden) -> None:
    rover, base = both
    async with rover.running("pair") as here, base.running("pair") as there:
        await here.shows("same code")
        await there.shows("same code")
        here.types(answer)
        assert (await here.ends(), await there.ends()) == (1, 1)
        assert "error: PAIRING_REFUSED" in here.shown
        assert "error: PAIRING_REFUSED rover: " in there.shown
        golden.check_line("the other person said no", there.shown)
    assert rover.trust_store.trust == base.trust_store.trust == Trust()


async def test_person_who_leaves_takes_the_question_back(both: tuple[Host, Host]) -> None:
    rover, base = both
    async with base.running("pair") as there:
        async with rover.running("pair") as here:
            await here.shows("same code")
            await there.shows("same code")
            here.types("y")
            await here.shows("waiting for the person")
        await there.shows("warning: PAIRING_OVER")
        async with rover.running("pair", "base") as again:
            code = await again.shows(CODE)
            there.shown = there.shown.partition("warning")[2]
            assert await there.shows(CODE) == code


async def test_scripts_say_yes_by_the_code(both: tuple[Host, Host]) -> None:
    rover, base = both
    async with base.running("pair") as there:
        opened = asyncio.create_task(rover.run("pair", "--json"))
        code = await there.shows(CODE)
        await there.shows("same code")
        wrong = f"{(int(code.replace(' ', '')) + 1) % 10**6:06d}"
        (await rover.run("pair", "--yes-code", wrong)).refused(1, "PAIRING_CODE")
        there.types("y")
        await there.shows("waiting for the person at rover")
        said = (await rover.run("pair", "--yes-code", code, "--json")).ok().json
        assert (said["step"], said["name"]) == ("agreed", "base")
        rows = [json.loads(line) for line in (await opened).ok().out.splitlines()]
        assert (rows[0]["step"], rows[-1]["step"]) == ("waiting", "agreed")
        assert code in {row["code"] for row in rows}
        assert await there.ends() == 0


async def test_yes_without_a_window_is_refused(rover: Host, golden: Golden) -> None:
    (await rover.run("pair", "--yes-code", "123 456")).refused(1, "PAIRING_ORDER")
    ran = (await rover.run("pair", "base", "--yes-code", "123 456")).refused(2, "--yes-code")
    golden.check_line("a host is named with a code", ran.err)


async def test_trust_is_listed_by_fingerprint(rover: Host, golden: Golden) -> None:
    empty = (await rover.run("trust")).ok().out
    golden.check_line("this host", empty, key=fingerprint(rover.trust_store.key))
    golden.check_line("no host is trusted", empty)
    base, lost = HostKeys.generate().public, HostKeys.generate().public
    await rover.trust_store.pair(base, "base")
    await rover.trust_store.revoke(lost, "stolen (old)")
    lines = [line.split() for line in (await rover.run("trust")).ok().out.splitlines()]
    assert ["paired", "base", fingerprint(base), "-"] in lines
    assert ["revoked", "-", fingerprint(lost), "stolen", "(old)"] in lines
    view = (await rover.run("trust", "--json")).ok().json
    assert view["paired"] == [{"name": "base", "fingerprint": fingerprint(base), "key": base}]
    assert str(rover.trust_store.identity().keys) not in json.dumps(view)


async def test_host_is_revoked_by_name(rover: Host, golden: Golden) -> None:
    base = HostKeys.generate().public
    await rover.trust_store.pair(base, "base")
    ran = await rover.run("revoke", "base", "--why", "stolen in the field")
    golden.check("a key is revoked", ran.ok().out, key=fingerprint(base))
    assert rover.trust_store.trust == Trust(revoked={base: "stolen in the field (base)"})
    undone = await rover.run("forget", fingerprint(base).lower())
    golden.check_line("a revocation is forgotten", undone.ok().out, key=fingerprint(base))
    assert rover.trust_store.trust == Trust()


async def test_host_that_a_fleet_let_in_is_revoked_by_name(rover: Host) -> None:
    base = HostKeys.generate().public
    rover.known[base] = "base"
    (await rover.run("revoke", "base", "--why", "sold")).ok()
    assert rover.trust_store.trust.revoked == {base: "sold (base)"}


async def test_host_that_was_never_met_is_revoked_by_its_key(rover: Host) -> None:
    base = HostKeys.generate().public
    (await rover.run("revoke", base, "--why", "stolen")).ok()
    assert rover.trust_store.trust.revoked == {base: "stolen"}


async def test_name_of_two_hosts_is_told_apart_by_fingerprint(rover: Host) -> None:
    old, new = HostKeys.generate().public, HostKeys.generate().public
    await rover.trust_store.pair(old, "base")
    await rover.trust_store.pair(new, "base")
    (await rover.run("revoke", "base", "--why", "old")).refused(1, fingerprint(old))
    (await rover.run("forget", fingerprint(old))).ok()
    assert rover.trust_store.trust.paired == {new: "base"}


async def test_unknown_host_and_own_key_are_refused(rover: Host) -> None:
    (await rover.run("revoke", "ghost", "--why", "x")).refused(1, "PEER_UNKNOWN")
    (await rover.run("forget", "ghost")).refused(1, "none")
    (await rover.run("revoke", rover.trust_store.key, "--why", "x")).refused(1, "KEY_OWN")
    (await rover.run("revoke", "ghost")).refused(2, "--why")


async def test_fleet_is_made_carried_and_trusted(
    rover: Host, tmp_path: Path, golden: Golden
) -> None:
    """As an integrator does it: an owner without a daemon, a drive, and a host."""
    drawer, drive = tmp_path / "survey", tmp_path / "usb" / "nondum-peers"
    public, certificate = drawer / "fleet.pub", drive / "certificate"
    made = await asyncio.to_thread(nondum, "keys", "fleet", "new", drawer, "--json")
    fleet = made.ok().json
    assert stat.S_IMODE((drawer / "fleet.key").stat().st_mode) == 0o600
    key = (await rover.run("key", "-o", tmp_path / "rover.pub")).ok().out
    assert f"fingerprint {fingerprint(rover.trust_store.key)}\n" in key
    assert parse_host((tmp_path / "rover.pub").read_text()) == rover.trust_store.host
    signing = (
        "keys",
        "fleet",
        "sign",
        tmp_path / "rover.pub",
        "--fleet",
        drawer,
        "-o",
        certificate,
    )
    signed = await asyncio.to_thread(nondum, *signing, "--days", "30")
    assert (
        f"{certificate}  rover  {fingerprint(rover.trust_store.key)}  until 20" in signed.ok().out
    )
    certified = await rover.run("certify", certificate)
    assert certified.code == 0
    assert "warning: FLEET_UNTRUSTED" in certified.err
    assert rover.trust_store.trust == Trust()
    trusted = (await rover.run("trust-fleet", public)).ok().out
    golden.check("a fleet is trusted", trusted, key=fleet["fingerprint"])
    shown = (await rover.run("trust")).ok().out
    assert "certified by survey until 20" in shown
    held = rover.trust_store.certificate
    assert held is not None
    rover.trust_store.trust.admit(rover.trust_store.key, held.to_bytes(), datetime.now(UTC))
    assert held.not_after - datetime.now(UTC) > timedelta(days=29)
    (await rover.run("forget", "survey")).ok()
    assert rover.trust_store.trust == Trust()


async def test_fleet_may_be_called_something_else_here(rover: Host, tmp_path: Path) -> None:
    nondum("keys", "fleet", "new", tmp_path / "f", "--name", "survey").ok()
    public = tmp_path / "f" / "fleet.pub"
    (await rover.run("trust-fleet", public, "--name", "theirs")).ok()
    assert list(rover.trust_store.trust.fleets.values()) == ["theirs"]
    (await rover.run("trust-fleet", public, "--name", "Not A Name")).refused(1, "HOST_NAME")


async def test_refusals_of_files_name_them(rover: Host, tmp_path: Path) -> None:
    bad = tmp_path / "bad.file"
    bad.write_bytes(b"\xffno certificate\n")
    (await rover.run("certify", bad)).refused(1, "CERTIFICATE_MALFORMED").refused(1, str(bad))
    (await rover.run("trust-fleet", bad)).refused(1, "FILE_MALFORMED").refused(1, str(bad))
    (await rover.run("certify", tmp_path / "none")).refused(2, "does not exist")


async def test_certificate_of_another_host_is_refused(rover: Host, tmp_path: Path) -> None:
    nondum("keys", "fleet", "new", tmp_path / "survey").ok()
    certificate = tmp_path / "certificate"
    other = HostKeys.generate().public
    signing = ("keys", "fleet", "sign", other, "--host", "rover", "--fleet", tmp_path / "survey")
    nondum(*signing, "-o", certificate).ok()
    (await rover.run("certify", certificate)).refused(1, "CERTIFICATE_KEY")


def test_fleet_is_not_made_over_another(tmp_path: Path) -> None:
    nondum("keys", "fleet", "new", tmp_path / "survey").ok()
    before = (tmp_path / "survey" / "fleet.key").read_bytes()
    nondum("keys", "fleet", "new", tmp_path / "survey").refused(1, "FLEET_EXISTS")
    assert (tmp_path / "survey" / "fleet.key").read_bytes() == before


def test_wrong_use_of_fleets_is_told(tmp_path: Path) -> None:
    key = HostKeys.generate().public
    nondum("keys", "fleet", "new", tmp_path / "Not A Name").refused(1, "HOST_NAME")
    nondum("keys", "fleet", "sign", key, "--fleet", tmp_path).refused(2, "--host")
    nowhere = ("keys", "fleet", "sign", key, "--host", "rover", "--fleet", tmp_path)
    nondum(*nowhere, "-o", tmp_path / "c").refused(1, "fleet.key")
    nondum("keys", "fleet", "new", tmp_path / "survey").ok()
    signing = ("keys", "fleet", "sign", "--fleet", tmp_path / "survey", "-o", tmp_path / "c")
    nondum(*signing, "not a key", "--host", "rover").refused(1, "KEY_MALFORMED")
    nondum(*signing, key, "--host", "Rover").refused(1, "HOST_NAME")
    nondum(*signing, key, "--host", "rover", "--days", "0").refused(2, "--days")
    (tmp_path / "survey" / "fleet.key").chmod(0o644)
    nondum(*signing, key, "--host", "rover").refused(1, "FILE_OPEN_TO_OTHERS")
    assert not (tmp_path / "c").exists()
