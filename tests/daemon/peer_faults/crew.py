"""Hosts, one on each machine, all on one switch, and what tests do with them."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

from demo.namespaces import Network, Switch
from tests.daemon.peer_faults.remote import PORT, Member, Told, taken

from nondum.sdk.wire import Body
from nondum.transport.peers import HostKeys
from nondum.transport.peers.certificate import issue, new_fleet

Catalogues = Mapping[str, Mapping[str, Body]]

FAILURES = {"PEER_LOST", "PEER_DOWN", "PEER_BUSY", "DEADLINE", "ANSWER_FORGOTTEN"}
"""What calls may fail with while links break."""


class Crew:
    """Hosts that trust each other and look for each other."""

    def __init__(self, network: Network, work: Path, trust: Trusting, seed: int) -> None:
        self.network, self.seed = network, seed
        self.log = work / "calls"
        self.log.mkdir()
        self.switch: Switch = network.switch()
        self._trust = trust
        self.members = [self.add(name, keys) for name, keys in trust.keys.items()]

    def __iter__(self) -> Iterator[Member]:
        return iter(self.members)

    @property
    def fleet_secret(self) -> bytes:
        """What certifies hosts of the fleet; empty where hosts are paired."""
        return self._trust.secret

    def add(self, machine: str, keys: HostKeys, *, name: str = "") -> Member:
        """A host on a machine more, not started yet; it is no member that `all` would mean."""
        made = self.network.machine(machine)
        self.network.plug(made, self.switch)
        name = name or machine
        config = {
            "name": name,
            "public": keys.public,
            "secret": keys.secret,
            "port": PORT,
            "discover": True,
            "static": [],
            "skew_s": 0,
            "seed": f"{self.seed} {machine}",
            "log": str(self.log),
            **self._trust.config(name, keys),
        }
        return Member(made, keys, config)

    def start(self) -> None:
        """Start all, and wait until all see each other."""
        for member in self:
            member.launch()
        for member in self:
            member.await_start()
        self.all_see({member.name: {} for member in self})

    def all_see(self, catalogues: Catalogues, *, by: Sequence[Member] = ()) -> None:
        """Wait until all hosts (or those given) see exactly the others of these catalogues."""
        answers = []
        for member in by or self.members:
            others = {name: entries for name, entries in catalogues.items() if name != member.name}
            answers.append(member.order("see", catalogues=others))
        for answer in answers:
            taken(answer)

    def all_meet(self, *parts: Sequence[Member]) -> None:
        """Wait until all hosts of each part have each other for peers, and no other host."""
        answers = []
        for part in parts or (self.members,):
            for member in part:
                peers = [other.name for other in part if other is not member]
                answers.append(member.order("be_among", peers=peers))
        for answer in answers:
            taken(answer)

    def live(self, *, change_s: float, ask_s: float) -> None:
        """Have all change their catalogues and call each other."""
        for member in self:
            member.ask("live", change_s=change_s, ask_s=ask_s)

    def rest(self) -> None:
        """Let all come to rest: everybody knows what everybody published last, and all work is
        done, none of it twice."""
        began_s = time.monotonic()
        self.all_see({name: told["published"] for name, told in self._all("still").items()})
        note(f"alike after {time.monotonic() - began_s:.2f} s")
        told = self._all("rest")
        self._all("idle")
        self.check_work(piece for one in told.values() for piece in one["answered"])
        for name, one in told.items():
            note(f"{name}: {len(one['answered'])} answered, {one['failed']}")
            assert one["failed"].keys() <= FAILURES, one["failed"]

    def check_work(self, answered: Iterable[str] = ()) -> None:
        """What was written down: nothing was done twice, nothing runs on, and what was answered was
        done."""
        lives = {
            log.name: log.read_text(encoding="utf-8").splitlines() for log in self.log.iterdir()
        }
        works = Counter(line for lines in lives.values() for line in lines)
        assert [line for line, times in works.items() if times > 1] == []
        killed = {f"{one.name}-{epoch}" for one in self for epoch in one.killed}
        for life, lines in lives.items():
            begun, ended = _pieces(lines, "begin"), _pieces(lines, "end")
            assert ended <= begun
            assert begun == ended or life in killed, f"{life} goes on with {begun - ended}"
        assert set(answered) <= _pieces(works, "end")

    def clear(self) -> None:
        """Bring all back to where they began: one network, the right time, nothing published, no
        work. Nothing may have broken."""
        self.switch.join()
        for member in self:
            member.cable.heal()
            member.ask("set_clock", skew_s=0)
        for name, told in self._all("still").items():
            (member,) = (one for one in self if one.name == name)
            member.ask("publish", changes=dict.fromkeys(told["published"]))
        self.all_see({member.name: {} for member in self})
        self._all("idle")
        for member in self:
            member.forget()
        self.check_whole()

    def check_whole(self) -> None:
        """No host met an error that it did not expect."""
        broken = [f"{member.name}: {what}" for member in self for what in member.broken]
        assert not broken, "\n".join(broken)

    def _all(self, do: str) -> dict[str, Told]:
        answers = {member.name: member.order(do) for member in self}
        return {name: taken(answer) for name, answer in answers.items()}


class Trusting:
    """Trust between hosts: all of these names trust each other, by pairing or by a fleet."""

    def __init__(self, names: Sequence[str], *, by_fleet: bool = False) -> None:
        self.keys = {name: HostKeys.generate() for name in names}
        self.fleet, self.secret = new_fleet() if by_fleet else ("", b"")
        self.paired = {} if by_fleet else {one.public: name for name, one in self.keys.items()}

    def config(self, name: str, keys: HostKeys) -> Told:
        """A host's configuration of trust; certificates are valid for 31 days from yesterday."""
        return {
            "paired": {key: name for key, name in self.paired.items() if key != keys.public},
            "fleets": [self.fleet] if self.fleet else [],
            "certificate": self._certificate(name, keys).hex() if self.fleet else "",
        }

    def _certificate(self, name: str, keys: HostKeys) -> bytes:
        yesterday = datetime.now(UTC) - timedelta(days=1)
        until = yesterday + timedelta(days=31)
        signed = issue(self.secret, name, keys.public, not_before=yesterday, not_after=until)
        return signed.to_bytes()


@contextmanager
def crew(work: Path, *names: str, seed: int, trust: Trusting | None = None) -> Iterator[Crew]:
    """Hosts on one switch that all see each other."""
    with Network() as network:
        made = Crew(network, work, trust or Trusting(names), seed)
        made.start()
        yield made
        made.check_whole()


def _pieces(lines: Iterable[str], word: str) -> set[str]:
    return {line.removeprefix(f"{word} ") for line in lines if line.startswith(f"{word} ")}


def note(text: str) -> None:
    """Tell a figure: pytest shows it with -s, and when the test fails."""
    sys.stdout.write(f"{text}\n")
