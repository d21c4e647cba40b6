"""Plugins with all their authors' names replaced: what the host must not know, it cannot miss.

`shuffle` copies plugin folders so that distribution, package, payload, component, unit, slot,
behaviour, action and object names are random words, and the order of payloads is random too. What
the copies can do, and what people say to get it, is the same.
"""

from demo.shuffle.copying import NotEquivalent, Shuffled, shuffle, sources
from demo.shuffle.names import Names

__all__ = ["Names", "NotEquivalent", "Shuffled", "shuffle", "sources"]
