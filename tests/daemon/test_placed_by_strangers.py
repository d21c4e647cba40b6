"""What a host accepts and refuses from a peer that places payloads on it."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.daemon.guest import Guest, guest
from tests.daemon.neighbours import OpenHost, beacon, open_host
from tests.kit.payloads import make_payload, seal
from tests.kit.running_host import RunningHost
from tests.kit.shared import Shared

from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall, Lease, Loss

pytestmark = pytest.mark.daemon

RELEASES = itertools.count(2, 2)

Twist = Callable[[str, int, bytes], Any]
"""Path of a file, offset and its bytes there → what is sent."""


class FileServer:
    """Serves the files of one payload folder, changed by `twist`."""

    def __init__(self, folder: Path, twist: Twist = lambda path, offset, data: data) -> None:
        self.folder, self._twist = folder, twist
        files = (path for path in folder.rglob("*") if path.is_file())
        self._files = {hashlib.sha256(path.read_bytes()).hexdigest(): path for path in files}

    def offer(self, **more: Any) -> dict[str, Any]:
        """The arguments of `place.take`."""
        contents = (self.folder / "CONTENTS").read_bytes()
        return {
            "digest": hashlib.sha256(contents).hexdigest(),
            "payload": self.folder.name,
            "contents": len(contents),
            "signature": None,
            "why": "it likes it better there",
        } | more

    def serve(self, incoming: IncomingCall) -> Body:
        if incoming.method == "place.want":
            return {}
        path, offset = self._files[incoming.args["sha256"]], incoming.args["offset"]
        data = path.read_bytes()[offset : offset + incoming.args["length"]]
        return {"data": self._twist(path.relative_to(self.folder).as_posix(), offset, data)}

    def notice(self, *_: Any) -> None: ...

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return Lease.STOP


@pytest.fixture(scope="module")
def one_mule(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[OpenHost]]:
    with Shared(lambda: open_host(tmp_path_factory.mktemp("mule"), "mule")) as shared:
        yield shared


@pytest.fixture
def mule(one_mule: Shared[OpenHost]) -> Iterator[OpenHost]:
    """A host, and where it listens."""
    with one_mule.lent() as mule:
        yield mule


@pytest.fixture
def release() -> int:
    """One that was not here yet, nor was the one before it."""
    return next(RELEASES)


@pytest.fixture
def folder(tmp_path: Path, release: int) -> Path:
    part = beacon(tmp_path / "log")
    return make_payload(tmp_path / "drive", part, payload_id="org.example.light", release=release)


@pytest.fixture
def stored(mule: OpenHost) -> set[str]:
    """The wheels that are stored before anything is handed over."""
    return wheels(mule.host)


def wheels(host: RunningHost) -> set[str]:
    return {path.name for path in (host.state / "store").glob("[0-9a-f]*")}


def refused(one: Guest, server: FileServer, **more: Any) -> tuple[str, str]:
    """Code and place of a refusal."""
    with pytest.raises(CallFailed) as caught:
        one.ask("mule", "place.take", **server.offer(**more))
    return caught.value.code, caught.value.problems[0].where


def check_nothing_is_left(host: RunningHost, stored: set[str]) -> None:
    assert not any((host.state / "placed").glob("*"))
    assert wheels(host) == stored
    assert all(row["event"] != "DriveInserted" for row in host.journal())


def flipped(path: str) -> Twist:
    def twist(sent: str, offset: int, data: bytes) -> bytes:
        return bytes([data[0] ^ 1]) + data[1:] if path in sent and offset == 0 else data

    return twist


def only(path: str, change: Callable[[bytes], Any]) -> Twist:
    return lambda sent, offset, data: change(data) if path in sent else data


TWISTS = {
    "a bit of the contents list": ("CONTENTS", flipped("CONTENTS")),
    "a bit of the manifest": ("payload.toml", flipped("payload.toml")),
    "a bit of a wheel": ("wheels/test_beacon", flipped("wheels/test_beacon")),
    "a byte too many": ("payload.toml", only("payload.toml", lambda data: data + b"\n")),
    "a byte too few": ("wheels/pluggy", only("wheels/pluggy", lambda data: data[:-1])),
    "nothing": ("index.json", only("index.json", lambda data: b"")),
    "text": ("index.json", only("index.json", lambda data: "it is a fine index")),
}


@pytest.mark.parametrize("twist", TWISTS)
def test_file_that_is_not_as_listed_is_refused(
    mule: OpenHost, folder: Path, stored: set[str], twist: str
) -> None:
    host, address = mule
    where, change = TWISTS[twist]
    server = FileServer(folder, change)
    with guest("liar", ("mule", address), handler=server) as one:
        code, place = refused(one, server)
        assert code == "HASH_MISMATCH"
        assert place.startswith(where)
    check_nothing_is_left(host, stored)


@pytest.mark.parametrize(
    "args",
    [
        {"digest": "../../etc/passwd"},
        {"payload": "../../etc"},
        {"payload": 7},
        {"contents": 0},
        {"contents": 1 << 20},
        {"contents": "many"},
        {"signature": b"x" * 9000},
        {"signature": "signed"},
        {"why": None},
    ],
    ids=str,
)
def test_offer_that_is_none_is_refused(
    mule: OpenHost, folder: Path, stored: set[str], args: dict[str, Any]
) -> None:
    host, address = mule
    server = FileServer(folder)
    with guest("liar", ("mule", address), handler=server) as one:
        assert refused(one, server, **args)[0] == "CALL_MALFORMED"
    check_nothing_is_left(host, stored)


def test_payload_of_another_name_is_refused(mule: OpenHost, folder: Path, stored: set[str]) -> None:
    host, address = mule
    server = FileServer(folder)
    with guest("liar", ("mule", address), handler=server) as one:
        assert refused(one, server, payload="org.example.dark")[0] == "CALL_MALFORMED"
    check_nothing_is_left(host, stored)


def test_list_that_leads_out_of_the_folder_is_refused(
    mule: OpenHost, folder: Path, stored: set[str]
) -> None:
    host, address = mule
    listed = (folder / "CONTENTS").read_text(encoding="ascii")
    hostile = listed.replace("payload.toml", "../../../../payload.toml")
    (folder / "CONTENTS").write_text(hostile, encoding="ascii")
    server = FileServer(folder)
    with guest("liar", ("mule", address), handler=server) as one:
        code, _ = refused(one, server)
        assert code in ("PATH_UNSAFE", "CONTENTS_ENTRY")
    check_nothing_is_left(host, stored)


def test_more_to_judge_than_is_read_is_refused(
    mule: OpenHost, folder: Path, stored: set[str]
) -> None:
    host, address = mule
    with (folder / "leaflet.txt").open("wb") as leaflet:
        leaflet.truncate(17 << 20)
    seal(folder, payload_id=folder.name)
    server = FileServer(folder)
    with guest("liar", ("mule", address), handler=server) as one:
        assert refused(one, server)[0] == "TOO_LARGE"
    check_nothing_is_left(host, stored)


def test_sound_payload_is_here_for_as_long_as_the_call(mule: OpenHost, folder: Path) -> None:
    host, address = mule
    server = FileServer(folder)
    with guest("rover", ("mule", address), handler=server) as one:
        steps = one.reports("mule", "place.take", until={"step": "active"}, **server.offer())
        assert steps[0]["step"] == "checking"
        host.until_component("beacon", "ready")
        (row,) = host.ask("places")
        assert (row["payload"], row["for"]) == ("org.example.light", "rover")
        assert not any((host.state / "placed").rglob("*.whl")), "the store has them"
    host.until_gone("light")
    assert not any((host.state / "placed").glob("*"))


def test_older_release_than_was_here_is_refused(mule: OpenHost, folder: Path, release: int) -> None:
    host, address = mule
    drive = folder.parents[1]
    slot = host.plug(drive)
    host.until_step("light", "active")
    host.pull(slot)
    host.until_gone("light")
    seal(folder, payload_id=folder.name, release=release - 1)
    server = FileServer(folder)
    with guest("rover", ("mule", address), handler=server) as one:
        assert refused(one, server)[0] == "ROLLBACK"


def test_component_of_the_id_of_one_that_is_here_is_taken_beside_it(
    mule: OpenHost, folder: Path, tmp_path: Path
) -> None:
    host, address = mule
    host.bring("lamp", beacon(tmp_path / "log"))
    server = FileServer(folder)
    with guest("rover", ("mule", address), handler=server) as one:
        one.reports("mule", "place.take", until={"step": "active"}, **server.offer())
        host.until_component("beacon--org-example-light", "ready")
        assert host.component("beacon") is not None
    host.until_gone("light")


def test_only_who_takes_a_payload_may_fetch_it(mule: OpenHost, folder: Path) -> None:
    host, address = mule
    host.plug(folder.parents[1])
    host.until_step("light", "active")
    server = FileServer(folder)
    digest = server.offer()["digest"]
    with guest("thief", ("mule", address), handler=server) as one:
        for method, args in (
            ("place.read", {"sha256": digest, "offset": 0, "length": 9}),
            ("place.want", {"wanted": [digest]}),
        ):
            with pytest.raises(CallFailed) as caught:
                one.ask("mule", method, digest=digest, **args)
            assert caught.value.code == "NOT_OFFERED"
