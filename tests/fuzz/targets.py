"""Everything of nondum that reads bytes from somebody else, as targets.

Each is read as the host reads it, text from its UTF-8 bytes; seeds are what the project's own
writers write.
"""

from __future__ import annotations

import base64
import json
import re
import tempfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from packaging.tags import sys_tags
from tests.fuzz.target import LONGEST, Target
from tests.kit.payloads import lock_text, make_wheel
from tests.wheelhouse.hostile import WHEELS
from tests.wheelhouse.hostile_wheels import NAME, WheelBuilder

from nondum.host import config
from nondum.host.control import protocol as control
from nondum.planning.claims import claims_of
from nondum.planning.contribution import Contribution
from nondum.planning.parse import parse_formula
from nondum.sdk import wire
from nondum.sdk.description import Behaviour, Fragment, PluginDescription
from nondum.sdk.errors import FragmentRefused, PayloadRefused, Problem
from nondum.transport.bridge import packets as bridge
from nondum.transport.discovery import hint
from nondum.transport.discovery import packets as discovery
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import Source
from nondum.transport.peers import certificate, messages, pairing, pairing_messages
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey
from nondum.wheelhouse import archive, contents, goals, index, lock, manifest, wheel
from nondum.wheelhouse.contents import Contents, Entry
from nondum.wheelhouse.trust import sshsig, trust_file
from nondum.wheelhouse.trust.public_key import FIDO, PublicKey
from nondum.wheelhouse.trust.wire import string

PLUGINS = Path(__file__).parents[2] / "plugins"
SHA256 = "0123456789abcdef" * 4
WHERE = "fuzzed"
ENDLESS_NUMBER = b"9" * 5_000
"""Python makes an `int` of 4,300 digits at most, and raises `ValueError` on more."""
TOUCHED = b"\1\0\0\0\7"
"""What a FIDO token adds to a signature: that a person was there, and its counter."""


def of_text(read: Callable[[str], object]) -> Callable[[bytes], object]:
    """A reader of text, which is not asked about bytes that are none."""

    def read_bytes(data: bytes) -> object:
        try:
            text = data.decode()
        except UnicodeDecodeError:
            return None
        return read(text)

    return read_bytes


def with_endless_numbers(seeds: list[bytes]) -> list[bytes]:
    """Each seed with one of its numbers after the other made longer than Python reads them."""
    return [
        seed[: number.start()] + ENDLESS_NUMBER + seed[number.end() :]
        for seed in seeds
        for number in re.finditer(rb"[0-9]+", seed)
    ]


def _contents() -> list[bytes]:
    entries = tuple(Entry(SHA256, size, f"wheels/a-{size}.whl") for size in (1, 2, 3))
    listed = Contents(
        "org.example.lamp", "1.0", 7, "survey", "0.1.0", "2026-01-01T00:00:00Z", entries
    )
    return [listed.to_bytes()]


def _public_key() -> PublicKey:
    point = base64.b64decode("R0UdCfPvbzM/XVCmWYsjLAMTvOZ5YVsjSEzg1q3PxQE=")
    return PublicKey("ssh-ed25519", point)


def _bare_signatures() -> list[bytes]:
    """What stands between the markers, for a key in a file and one in a token."""
    return [_bare(_public_key(), b""), _bare(PublicKey(FIDO, _public_key().point, "ssh:"), TOUCHED)]


def _bare(key: PublicKey, more: bytes) -> bytes:
    inner = string(key.kind.encode()) + string(bytes(range(64))) + more
    parts = (key.blob, sshsig.PAYLOAD.encode(), b"", b"sha512", inner)
    return sshsig.MAGIC + b"\0\0\0\1" + b"".join(map(string, parts))


def _read_bare_signature(data: bytes) -> object:
    """Armoured as it must be, so that what is inside is what is judged."""
    text = base64.b64encode(data).decode()
    lines = [text[at : at + sshsig.LINE] for at in range(0, len(text), sshsig.LINE)]
    return _read_signature("\n".join([sshsig.BEGIN, *lines, sshsig.END, ""]).encode())


def _signatures() -> list[bytes]:
    one = sshsig.armoured(_public_key(), sshsig.PAYLOAD, "sha512", bytes(range(64)))
    return [one, one + one]


def _read_signature(data: bytes) -> object:
    return [signature.holds(b"contents") for signature in sshsig.parse(data, WHERE)]


def _trust_files() -> list[bytes]:
    key = f"ssh-ed25519 {base64.b64encode(_public_key().blob).decode()}"
    return [
        f"""\
format = "nondum-trust 1"
owner = "survey"
version = 3
made = "2026-08-01T00:00:00Z"
fleets = ["survey"]

[roots]
threshold = 1
[[roots.key]]
name = "alice"
key = "{key}"

[[key]]
name = "acme-release"
key = "{key}"
until = "2028-01-01T00:00:00Z"

[[role]]
name = "acme"
payloads = ["com.acme"]
keys = ["acme-release"]
permissions = ["network"]

[[revoked]]
fingerprint = "SHA256:{"a" * 43}"
why = "lost"
""".encode()
    ]


MANIFEST = b"""\
id = "org.example.blinker"
name = "Blinker"
summary = "Blinks"
authors = ["A. Author"]
licence = "Apache-2.0"

[requires]
python = ">=3.11"
memory_mb = 50

[[component]]
id = "blinker"
distribution = "example-blinker"
permissions = ["network"]
settings = { rate_hz = 2, names = ["a", "b"] }

[[component.device]]
name = "lamp"
match = { ID_VENDOR_ID = "1a86", SUBSYSTEM = "tty" }
optional = true

[[component.unit]]
name = "lamp"
xyz = [0.1, 0, 0.2]
rpy = [0, 0, 1.57]
"""
MARKERS = (b"extra ", b"extras", b"os_name", b"~=", b"===", b" not in ", b" or ", b"(")
"""Of environment markers (PEP 508)."""
TOML = (b"[[", b"]]", b'"""', b"'''", b"1e999", b"inf", b"2026-01-01", b"a.b.c", b"\\u0000", b"= {")


def _locks() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        made = [make_wheel(Path(folder), name, "1.0", {f"{name}.py": ""}) for name in ("a", "b")]
        plain = lock_text(made)
    head, _, packages = plain.partition("[[packages]]")
    bounds = 'requires-python = ">=3.9"\nenvironments = ["python_version >= \'3.9\'"]\n\n'
    marker = "marker = \"python_full_version >= '3.9'\""
    return [plain.encode(), f"{head}{bounds}[[packages]]\n{marker}{packages}".encode()]


def _read_lock(text: str) -> object:
    return lock.select(lock.parse(text, WHERE), _environment(), tuple(sys_tags()))


def _environment() -> Mapping[str, str]:
    from packaging.markers import default_environment

    return {key: str(value) for key, value in default_environment().items()}


def _wheels() -> list[bytes]:
    plain = WheelBuilder(files={"evil/__init__.py": b"X = 1\n", "evil/data.txt": b"0" * 500})
    with tempfile.TemporaryDirectory() as folder:
        scripts = {"evil": {"evil": "evil:main"}}
        made = make_wheel(Path(folder), "evil", "1.0", {"evil.py": "X=1"}, entry_points=scripts)
        return [plain.bytes(), made.read_bytes()]


def _read_wheel(data: bytes) -> object:
    """As `verify` and the store read it: laid out, what it needs told, every member unpacked."""
    view = memoryview(data)
    layout = wheel.lay_out(view, NAME)
    wheel.refuse_if_any(layout.problems)
    for file in layout.files:
        try:
            for _ in archive.unpack(view, file.member):
                pass
        except ValueError as error:  # how a damaged member is told to `wheel`
            raise PayloadRefused(wheel.damaged(file, NAME, str(error))) from error
    return layout.needs.requirements


def _hostile_wheels() -> list[bytes]:
    made = (case.build(Path("canary")) for case in WHEELS if case.filename == NAME)
    return [data for data in made if len(data) <= LONGEST]


def _described() -> PluginDescription:
    fragment = Fragment("domain.pddl", DOMAIN.decode())
    behaviour = Behaviour("point", "(point ?u - pointer ?t - thing)", lasting=True)
    return PluginDescription("lamp", "1.0", behaviours=(behaviour,), fragments=(fragment,))


def _indexes() -> list[bytes]:
    return [index.to_bytes({"lamp": _described()})]


DOMAIN = b"""\
(define (domain lamp)
  (:requirements :strips :typing)
  (:types lamp - pointer colour - object)
  (:constants red - colour)
  (:predicates (lit ?l - lamp ?c - colour) (bright ?l - lamp))
  (:derived (bright ?l - lamp) (exists (?c - colour) (lit ?l ?c)))
  (:action light
    :parameters (?l - lamp ?c - colour)
    :precondition (and (not (lit ?l ?c)) (or (bright ?l) (= ?l ?l)))
    :effect (and (lit ?l ?c) (forall (?d - colour) (when (lit ?l ?d) (not (lit ?l ?d))))
                 (increase (total-cost) 3))))
"""
PROBLEM = b"""\
(define (problem lamp) (:domain lamp) (:objects source - target) (:init (senses lamp source)))
"""
GOAL = b"(and (lit a red) (not (lit b red)))"
PDDL = (b"(and", b"(or", b"(not", b"(forall (?x - t)", b"(exists (?x)", b"(when", b"(either a b)")


def _read_fragment(text: str) -> object:
    """Parsed, and then checked as one component's claim."""
    said = Contribution("lamp", "spot", "lamp", "1.0", fragments=(Fragment(WHERE, text),))
    claims = claims_of.__wrapped__(said)
    if claims.problems:
        raise FragmentRefused(*claims.problems)
    return claims


def _frames() -> list[bytes]:
    body = {"a": 1, "b": [1.5, "x", None, True], "c": {"d": b"\0"}}
    said = (
        wire.Hello((1, 2), "0.1", 7),
        wire.Welcome(1, body),
        wire.Request(3, "behave", body),
        wire.Reply(3, body),
        wire.Failure(3, (Problem("CODE", "message", "where", "need", "have", "fix"),)),
        wire.Event("progress", 3, body),
        wire.Cancel(3),
    )
    return [wire.encode(each) for each in said]


MSGPACK = (b"\xc1", b"\xdf\xff\xff\xff\xff", b"\xdd\xff\xff\xff\xff", b"\x81\xa1a", b"\x91" * 40)
"""A byte that is none, lying lengths, a table, nesting."""


def _peer_messages() -> list[bytes]:
    hello = messages.Hello((1,), "rover", "k" * 40, 5, 1, b"")
    body = {"a": [1, 2.5, "x"], "b": {"c": None}}
    problem = Problem("CODE", "message")
    said = (
        hello,
        messages.Welcome(hello),
        messages.Refused(problem),
        messages.Request(2, 1, 1000, "behave", body),
        messages.Reply(1, body),
        messages.Failure(1, (problem,)),
        messages.Progress(1, body),
        messages.Cancel(1),
        messages.Notice("changed", body),
        messages.Ping(3),
        messages.Pong(3),
        messages.Bye("stopped"),
    )
    return [messages.encode(each) for each in said]


def _pairing_messages() -> list[bytes]:
    commit = pairing.Commit(KEY, "rover", bytes(pairing_messages.HASH_BYTES))
    said = (
        pairing.Ask(KEY, "rover"),
        commit,
        pairing_messages.Beat(),
        pairing_messages.Ended(pairing_messages.Ending.BUSY),
    )
    return [pairing_messages.encode(each) for each in said]


KEY = PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7")


def _certificates() -> list[bytes]:
    _, secret = certificate.new_fleet()
    begin, end = datetime(2026, 1, 1, tzinfo=UTC), datetime(2027, 1, 1, tzinfo=UTC)
    made = certificate.issue(secret, "rover", KEY, not_before=begin, not_after=end)
    return [made.to_bytes()]


def _announcement() -> Announcement:
    return Announcement(KEY, "rover", 7, ("tcp://0.0.0.0:7410",), pairing_port=7411)


def _answers() -> list[bytes]:
    return [discovery.answer(bytes(discovery.NONCE), _announcement())]


def _read_datagram(data: bytes) -> object:
    """Asked, answered, and what is answered judged as a hint."""
    discovery.nonce_of(data)
    told = discovery.read_answer(data)
    return _hint(told.txt, told.port)


def _txts() -> list[bytes]:
    return [json.dumps(hint.to_txt(_announcement())).encode()]


def _read_txt(text: str) -> object:
    """The fields of a DNS-SD record; JSON stands for what zeroconf has taken apart."""
    try:
        txt: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(txt, dict) or any(type(value) is not str for value in txt.values()):
        return None
    return _hint(txt, 7410)


def _hint(txt: Mapping[str, str], port: int) -> object:
    hosts = ("192.0.2.1", "fe80::1%eth0")
    return hint.from_txt(txt, port, hosts, source=Source.MULTICAST, security=Security.CURVE)


def _asked() -> list[bytes]:
    claims = (bridge.Claim(1, "token"), bridge.Handled(3), bridge.Ping(1.5))
    return [bridge.asked(claim) for claim in claims]


def _told() -> list[bytes]:
    over = bridge.Over(Problem("CODE", "message"))
    frame = bridge.Frame(3, bridge.Coding.RAW, {"t": 1.0}, b"bulk")
    return [
        bridge.head(frame),
        bridge.told(bridge.Opened("image")),
        bridge.told(bridge.Pong(1.0, 2.0)),
        bridge.told(over),
    ]


def _requests() -> list[bytes]:
    return [control.encode_request(control.Request("goal", {"words": "follow me"}))]


CONFIG = b"""\
[host]
name = "rover"
state = "/var/lib/nondum"

[drives]
slots = ["/run/slots"]
allow_unsigned = false

[workers]
memory_mb = 512

[peers]
listen = ["tcp://*:7410"]
"""

JSON = (b"null", b"[[", b"{}", b"1e999")


def _read_config(text: str) -> object:
    return config.parse(text, WHERE, config.user_config())


TARGETS = (
    Target(
        "signature",
        _read_signature,
        _signatures,
        tokens=(sshsig.BEGIN.encode(), sshsig.END.encode(), b"U1NIU0lH", b"\n"),
        cases=1_000_000,
    ),
    Target(
        "signature, bare",
        _read_bare_signature,
        _bare_signatures,
        tokens=(b"SSHSIG", b"\0\0\0\1", b"sha512", b"ssh:", b"sk-ssh-ed25519@openssh.com"),
        cases=1_000_000,
    ),
    Target("trust file", of_text(lambda t: trust_file.parse(t, WHERE)), _trust_files, tokens=TOML),
    Target(
        "contents list",
        lambda data: contents.parse(data, WHERE),
        _contents,
        lambda: with_endless_numbers(_contents()),
        tokens=(b"release: ", b"../", b"\n\n", b"  ", SHA256.encode()),
        cases=1_000_000,
        longest=4 * LONGEST,
    ),
    Target(
        "manifest", of_text(lambda t: manifest.parse(t, WHERE)), lambda: [MANIFEST], tokens=TOML
    ),
    Target(
        "lock",
        of_text(_read_lock),
        _locks,
        tokens=(*TOML, *MARKERS, b"hashes", b"vcs", b"archive", b"url"),
    ),
    Target(
        "wheel",
        _read_wheel,
        _wheels,
        _hostile_wheels,
        tokens=(b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06", b"PK\x06\x06", b"\xff\xff\xff\xff"),
    ),
    Target("goal file", lambda data: goals.parse(data, WHERE), lambda: [b"follow me\n# no\n"]),
    Target("index", lambda data: index.parse(data, WHERE), _indexes, tokens=JSON),
    Target("fragment", of_text(_read_fragment), lambda: [DOMAIN, PROBLEM], tokens=PDDL),
    Target(
        "goal",
        of_text(lambda t: parse_formula(t, WHERE)),
        lambda: [GOAL],
        tokens=PDDL,
    ),
    Target("worker frame", wire.decode, _frames, tokens=MSGPACK, cases=1_000_000),
    Target("peer message", messages.decode, _peer_messages, tokens=MSGPACK),
    Target("pairing message", pairing_messages.decode, _pairing_messages, tokens=MSGPACK),
    Target("certificate", certificate.parse, _certificates, tokens=(b": ", b"\n", b"+0000")),
    Target("datagram", _read_datagram, _answers, tokens=MSGPACK),
    Target("TXT record", of_text(_read_txt), _txts, tokens=(b'"pk"', b'"proto"', b'"epoch"', b",")),
    Target("stream, asked", bridge.read_asked, _asked, tokens=MSGPACK),
    Target("stream, told", lambda data: bridge.read_told([data]), _told, tokens=MSGPACK),
    Target("control request", control.decode_request, _requests, tokens=JSON),
    Target(
        "configuration",
        of_text(_read_config),
        lambda: [CONFIG],
        tokens=TOML,
    ),
)
