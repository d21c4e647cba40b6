"""Modules compiled ahead of time, for interpreters that may not write: PEP 3147, PEP 552.

Hash-based and unchecked: interpreters do not compare them with their sources, since the host has
hashed both before it links them. Compiling runs none of the code, but the compiler reads what
strangers wrote: do it in a process that may die.
"""

from __future__ import annotations

import hashlib
import importlib.util
import marshal
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from nondum.wheelhouse.store.unpacking import StoredFile

TAG = sys.implementation.cache_tag or ""
"""Names the interpreters that understand what is compiled here: `cpython-311`."""

FOLDER = "__pycache__"
_UNCHECKED_HASH = (0b01).to_bytes(4, "little")
"""Flags of PEP 552: there is a hash of the source, and the interpreter need not check it."""
_UNCOMPILABLE = (SyntaxError, ValueError, ArithmeticError, RuntimeError, SystemError, MemoryError)
"""What the compiler raises: templates, other versions' syntax, null bytes, too deep nesting."""


def compiled(source: bytes, path: str) -> bytes | None:
    """A module's compiled file, or None if it does not compile.

    `path` is what tracebacks say until the import system puts the true one in its place.

    >>> compiled(b"print('not run')", "a.py").startswith(importlib.util.MAGIC_NUMBER)
    True
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            code = marshal.dumps(compile(source, path, "exec", dont_inherit=True, optimize=0))
        except _UNCOMPILABLE:
            return None
    digest = importlib.util.source_hash(source)
    return importlib.util.MAGIC_NUMBER + _UNCHECKED_HASH + digest + code


def cached(path: str) -> str:
    """Where interpreters look for a module's compiled file.

    >>> cached("a/b.py").replace(TAG, "cpython-311"), cached("c.py").replace(TAG, "cpython-311")
    ('a/__pycache__/b.cpython-311.pyc', '__pycache__/c.cpython-311.pyc')
    """
    folder, slash, name = path.rpartition("/")
    return f"{folder}{slash}{FOLDER}/{name.removesuffix('.py')}.{TAG}.pyc"


def write(
    root: Path,
    files: Sequence[StoredFile],
    out: Path,
    progress: Callable[[int], None] | None = None,
) -> tuple[StoredFile, ...]:
    """Compile the modules among the files under `root` to the same places under `out`.

    A module is left without if it does not compile, is not what it was when it was stored, or if
    another file has its place. `progress` gets bytes of source. Raises `OSError`.
    """
    done = []
    for file in _modules(files):
        source = (root / file.path).read_bytes()
        # The very bytes that were hashed are compiled: other processes may change the file.
        is_known = hashlib.sha256(source).hexdigest() == file.sha256
        data = compiled(source, file.path) if is_known else None
        if data is not None:
            done.append(_write(out, cached(file.path), data))
        if progress is not None:
            progress(file.size)
    return tuple(done)


def _modules(files: Sequence[StoredFile]) -> Iterator[StoredFile]:
    taken = {file.path for file in files}
    for file in files:
        place = cached(file.path)
        if file.path.endswith(".py") and not {place, os.path.dirname(place)} & taken:  # noqa: PTH120
            yield file


def _write(out: Path, path: str, data: bytes) -> StoredFile:
    target = out / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data)
    target.chmod(0o444)
    return StoredFile(path, len(data), hashlib.sha256(data).hexdigest())
