"""The host that a sentence is said to, where its name comes first."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.planning.words.pattern import words_of


def addressed_to(words: str, hosts: Sequence[str]) -> tuple[str | None, str]:
    """The host whose name words begin with, if they do, and the rest of them.

    >>> addressed_to("big mule, search for people", ["rover", "big-mule"])
    ('big-mule', 'search for people')
    >>> addressed_to("search for people", ["rover"])
    (None, 'search for people')
    """
    said = words_of(words)
    for host in sorted(hosts, key=len, reverse=True):
        for name in ((host,), tuple(host.split("-"))):
            if said[: len(name)] == name and len(said) > len(name):
                return host, " ".join(said[len(name) :])
    return None, words
