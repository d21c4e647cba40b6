"""Inputs that are nearly right: seeds with bytes changed, cut, repeated, spliced, tokens put in."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

Change = st.tuples(
    st.sampled_from(("set", "cut", "repeat", "insert", "splice")),
    st.integers(0, 2**20),
    st.integers(0, 2**20),
    st.binary(min_size=1, max_size=8),
)
"""Kind, where, how much, and what with."""
MOST_REPEATED = 64


@st.composite
def mutated(draw: st.DrawFn, seeds: Sequence[bytes], tokens: Sequence[bytes]) -> bytes:
    """A seed with up to eight changes, or bytes out of nowhere."""
    if draw(st.integers(0, 9)) == 0:
        return draw(st.binary(max_size=512))
    data = draw(st.sampled_from(seeds))
    for kind, where, size, piece in draw(st.lists(Change, min_size=1, max_size=8)):
        token = tokens[size % len(tokens)] if tokens and piece[0] % 2 else piece
        data = changed(data, kind, where, size, token, seeds)
    return data


def changed(
    data: bytes, kind: str, where: int, size: int, piece: bytes, seeds: Sequence[bytes]
) -> bytes:
    """One change.

    >>> changed(b"abc", "insert", 1, 0, b"--", [])
    b'a--bc'
    """
    at = where % (len(data) + 1)
    until = min(len(data), at + size % (len(data) + 1))
    match kind:
        case "set":
            return data[:at] + piece + data[at + len(piece) :]
        case "cut":
            return data[:at] + data[until:]
        case "repeat":
            return data[:at] + data[at:until] * (2 + size % MOST_REPEATED) + data[until:]
        case "insert":
            return data[:at] + piece + data[at:]
        case _:
            other = seeds[size % len(seeds)]
            return data[:at] + other[size % (len(other) + 1) :]
