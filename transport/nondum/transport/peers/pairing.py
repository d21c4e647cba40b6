"""Two hosts that never met, introduced by people who compare a short code. Pure; times are given.

Commit, then reveal (the numeric comparison of Bluetooth Secure Simple Pairing, Core Specification
vol 2 part H, 7.2): the answering host commits to its nonce before it sees the asking one's, so that
an attacker between the hosts cannot search for a nonce that makes both codes equal. Its chance is
one in a million a try. A bare short hash of the keys would be found in seconds.

    asking host                                             answering host
    Ask(key, name)                       ──►
                                         ◄──  Commit(key, name, commitment)
    Nonce(nonce)                         ──►
                                         ◄──  Nonce(nonce)            both show the code
    Agreed(proof)                       ◄─►   Agreed(proof)           once its own person said yes
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import field, replace
from enum import Enum
from typing import Annotated, TypeAlias

from nondum.sdk.codec.checks import Bounds
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.transport.peers.certificate import HOST_NAME
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, parse_key

WINDOW_S = 120.0
"""How long a host can be paired after a person allowed it."""
TRIES = 3
"""How often, in that time."""
NONCE_BYTES = 16
HASH_BYTES = 32
CODE_DIGITS = 6


def _check_name(name: str) -> None:
    if not HOST_NAME.fullmatch(name):
        problem = Problem("HOST_NAME", "the other end's name is none of a host")
        raise ProtocolViolation(problem)


Key: TypeAlias = Annotated[PeerKey, parse_key]
HostName: TypeAlias = Annotated[str, _check_name]
Hash: TypeAlias = Annotated[bytes, Bounds(HASH_BYTES, HASH_BYTES)]


@frozen
class Ask:
    """The first message: pair with me."""

    key: Key
    name: HostName


@frozen
class Commit:
    """The answer: I hold a nonce of which this is the hash."""

    key: Key
    name: HostName
    commitment: Hash


@frozen
class Nonce:
    """A nonce, told."""

    nonce: Annotated[bytes, Bounds(NONCE_BYTES, NONCE_BYTES)]


@frozen
class Agreed:
    """The person here saw the same code there."""

    proof: Hash


Message: TypeAlias = Ask | Commit | Nonce | Agreed


class Step(Enum):
    """How far a try has come."""

    AWAITING_ASK = "awaiting ask"
    AWAITING_COMMIT = "awaiting commit"
    AWAITING_NONCE = "awaiting nonce"
    COMPARING = "comparing"
    """The code is shown; neither person, or only the one there, has said yes."""
    AWAITING_AGREED = "awaiting agreed"
    """The person here has said yes."""
    PAIRED = "paired"
    FAILED = "failed"


class Role(Enum):
    """Which end of a pairing this is."""

    ASKING = "asking"
    ANSWERING = "answering"


@frozen
class Pairing:
    """One try, seen from one end."""

    role: Role
    key: PeerKey
    name: str
    nonce: bytes = field(repr=False)
    ends_s: float
    """On the clock that every `now_s` is read from."""
    step: Step
    peer_key: PeerKey | None = None
    """The key that the other end has proved to hold (by CURVE)."""
    peer_name: str = ""
    peer_nonce: bytes = b""
    commitment: bytes = b""
    """What the other end committed to, for the asking end."""
    peer_agreed: bool = False

    @property
    def has_told_nonce(self) -> bool:
        """Whether the other end knows the code by now, so that giving up would be a guess made."""
        unknowing = [Step.AWAITING_ASK, Step.AWAITING_COMMIT]
        if self.role is Role.ANSWERING:
            unknowing.append(Step.AWAITING_NONCE)
        return self.step not in unknowing

    @property
    def code(self) -> str:
        """What both people must see. Raises `ValueError` before it is known."""
        if self.step not in (Step.COMPARING, Step.AWAITING_AGREED, Step.PAIRED):
            raise ValueError(f"no code yet: {self.step.value}")
        number = int.from_bytes(_transcript(self, b"code"), "big") % 10**CODE_DIGITS
        digits = f"{number:0{CODE_DIGITS}d}"
        return f"{digits[: CODE_DIGITS // 2]} {digits[CODE_DIGITS // 2 :]}"


@frozen
class PairingWindow:
    """A person allowed pairing here, for a while and a few tries."""

    opened_s: float
    tries: int = 0

    def begin(
        self, role: Role, key: PeerKey, name: str, nonce: bytes, now_s: float
    ) -> tuple[PairingWindow, Pairing]:
        """Begin one try; `nonce` is fresh from the system's random source.

        Raises `PeerRefused` (PAIRING_TRIES, PAIRING_OVER).
        """
        if len(nonce) != NONCE_BYTES:
            raise ValueError(f"a nonce has {NONCE_BYTES} bytes")
        if self.tries >= TRIES:
            raise _refused(
                "PAIRING_TRIES",
                f"{TRIES} attempts have failed: somebody may be between the two hosts",
                fix="begin again on both hosts, over a network that you trust",
            )
        _check_time(self.opened_s + WINDOW_S, now_s)
        step = Step.AWAITING_COMMIT if role is Role.ASKING else Step.AWAITING_ASK
        pairing = Pairing(role, key, name, nonce, self.opened_s + WINDOW_S, step)
        return replace(self, tries=self.tries + 1), pairing


def ask(pairing: Pairing) -> Ask:
    """The asking end's first message."""
    return Ask(pairing.key, pairing.name)


def receive(
    pairing: Pairing, message: Message, proved: PeerKey, now_s: float
) -> tuple[Pairing, tuple[Message, ...]]:
    """Take a message in, from an end that holds the key `proved`: the new state, and what to send.

    Raises `PeerRefused` (PAIRING_OVER, PAIRING_ORDER, PAIRING_KEY, PAIRING_COMMITMENT,
    PAIRING_PROOF): the try has `failed` then.
    """
    _check_time(pairing.ends_s, now_s)
    if pairing.peer_key not in (None, proved):
        raise _refused("PAIRING_KEY", "another host speaks than the one that began")
    match pairing.step, message:
        case Step.AWAITING_ASK, Ask(key, name):
            return _committed(pairing, _introduced(pairing, key, name, proved))
        case Step.AWAITING_COMMIT, Commit(key, name, commitment):
            known = _introduced(pairing, key, name, proved)
            asking = replace(known, commitment=commitment, step=Step.AWAITING_NONCE)
            return asking, (Nonce(asking.nonce),)
        case Step.AWAITING_NONCE, Nonce(nonce):
            return _revealed(pairing, nonce)
        case Step.COMPARING, Agreed(proof) if not pairing.peer_agreed:
            return _receive_agreed(pairing, proof), ()
        case Step.AWAITING_AGREED, Agreed(proof):
            return replace(_receive_agreed(pairing, proof), step=Step.PAIRED), ()
    raise _refused(
        "PAIRING_ORDER", f"{type(message).__name__} came out of turn, while {pairing.step.value}"
    )


def confirm(pairing: Pairing, now_s: float) -> tuple[Pairing, tuple[Message, ...]]:
    """The person here says that the codes are equal.

    Raises `PeerRefused` (PAIRING_OVER, PAIRING_ORDER).
    """
    _check_time(pairing.ends_s, now_s)
    if pairing.step is not Step.COMPARING:
        raise _refused("PAIRING_ORDER", f"there is nothing to confirm: {pairing.step.value}")
    step = Step.PAIRED if pairing.peer_agreed else Step.AWAITING_AGREED
    return replace(pairing, step=step), (Agreed(_proof(pairing, pairing.role)),)


def failed(pairing: Pairing) -> Pairing:
    """The try is over: the person said no, or the other end broke the rules."""
    return replace(pairing, step=Step.FAILED)


def _introduced(pairing: Pairing, key: PeerKey, name: str, proved: PeerKey) -> Pairing:
    if key != proved or key == pairing.key:
        raise _refused("PAIRING_KEY", "the other end claims a key that it has not proved to hold")
    return replace(pairing, peer_key=key, peer_name=name)


def _committed(pairing: Pairing, known: Pairing) -> tuple[Pairing, tuple[Message, ...]]:
    answering = replace(known, step=Step.AWAITING_NONCE)
    assert answering.peer_key is not None
    commitment = _commitment(pairing.key, answering.peer_key, pairing.nonce)
    return answering, (Commit(pairing.key, pairing.name, commitment),)


def _revealed(pairing: Pairing, nonce: bytes) -> tuple[Pairing, tuple[Message, ...]]:
    if len(nonce) != NONCE_BYTES or nonce == pairing.nonce:
        raise _refused("PAIRING_COMMITMENT", "the other end's nonce is none")
    comparing = replace(pairing, peer_nonce=nonce, step=Step.COMPARING)
    if pairing.role is Role.ANSWERING:
        return comparing, (Nonce(pairing.nonce),)
    assert pairing.peer_key is not None
    promised = _commitment(pairing.peer_key, pairing.key, nonce)
    if not hmac.compare_digest(promised, pairing.commitment):
        raise _refused("PAIRING_COMMITMENT", "the other end told another nonce than it promised")
    return comparing, ()


def _receive_agreed(pairing: Pairing, proof: bytes) -> Pairing:
    theirs = Role.ANSWERING if pairing.role is Role.ASKING else Role.ASKING
    if not hmac.compare_digest(proof, _proof(pairing, theirs)):
        raise _refused("PAIRING_PROOF", "the other end agreed to something else")
    return replace(pairing, peer_agreed=True)


def _commitment(answering: PeerKey, asking: PeerKey, nonce: bytes) -> bytes:
    return _digest(b"commit", answering.encode("ascii"), asking.encode("ascii"), nonce)


def _proof(pairing: Pairing, role: Role) -> bytes:
    return _transcript(pairing, f"agreed {role.value}".encode("ascii"))


def _transcript(pairing: Pairing, purpose: bytes) -> bytes:
    """What both ends say and know, with the asking one's first."""
    assert pairing.peer_key is not None
    ours = (pairing.key, pairing.name, pairing.nonce)
    theirs = (pairing.peer_key, pairing.peer_name, pairing.peer_nonce)
    ends = (ours, theirs) if pairing.role is Role.ASKING else (theirs, ours)
    parts = (part for key, name, nonce in ends for part in (key.encode(), name.encode(), nonce))
    return _digest(purpose, *parts)


def _digest(*parts: bytes) -> bytes:
    """SHA-256 of the parts, each with its length, so that none runs into the next."""
    digest = hashlib.sha256(b"nondum-pairing@1")
    for part in parts:
        digest.update(len(part).to_bytes(4, "big") + part)
    return digest.digest()


def _check_time(ends_s: float, now_s: float) -> None:
    if now_s > ends_s:
        raise _refused(
            "PAIRING_OVER",
            f"the {WINDOW_S:.0f} seconds for pairing are over",
            fix="begin again on both hosts",
        )


def _refused(code: str, message: str, *, fix: str = "") -> PeerRefused:
    return PeerRefused(Problem(code, message, fix=fix))
