"""Pieces that mean something in the formats that several readers share."""

from __future__ import annotations

TOML = (b"[[", b"]]", b'"""', b"'''", b"1e999", b"inf", b"2026-01-01", b"a.b.c", b"\\u0000", b"= {")

JSON = (b"null", b"[[", b"{}", b"1e999")

MSGPACK = (b"\xc1", b"\xdf\xff\xff\xff\xff", b"\xdd\xff\xff\xff\xff", b"\x81\xa1a", b"\x91" * 40)
"""A byte that is none, lying lengths, a table, nesting."""
