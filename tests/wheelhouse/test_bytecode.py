"""Compiled files: what interpreters take, of the very bytes that were stored, or none."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.wheelhouse.store import bytecode
from nondum.wheelhouse.store.unpacking import StoredFile

UNCOMPILABLE = {
    "a template": b"class {{ name }}: pass",
    "another version": b"print 'hello'",
    "a null byte": b"x = 1\0",
    "no text": b"\xff\xfe",
    "an unknown encoding": b"# coding: klingon\n",
    "deep nesting": b"(" * 5000 + b")" * 5000,
    "a deep expression": b"-" * 50_000 + b"1",
}


def stored(root: Path, **sources: bytes) -> list[StoredFile]:
    root.mkdir()
    files = []
    for name, source in sources.items():
        (root / f"{name}.py").write_bytes(source)
        files.append(StoredFile(f"{name}.py", len(source), hashlib.sha256(source).hexdigest()))
    return files


@pytest.mark.parametrize("source", UNCOMPILABLE.values(), ids=UNCOMPILABLE)
def test_what_does_not_compile_is_left_without(source: bytes) -> None:
    assert bytecode.compiled(source, "a.py") is None


@given(st.binary(max_size=200))
def test_any_bytes_compile_or_do_not(source: bytes) -> None:
    data = bytecode.compiled(source, "a.py")
    assert data is None or len(data) > 16


def test_nothing_compiled_is_run(tmp_path: Path) -> None:
    source = f"open({str(tmp_path / 'ran')!r}, 'w')".encode()
    assert bytecode.compiled(source, "a.py")
    assert not (tmp_path / "ran").exists()


def test_doubtful_syntax_compiles_in_silence(recwarn: pytest.WarningsRecorder) -> None:
    assert bytecode.compiled(rb"x = '\d'", "a.py")
    assert not recwarn.list


def test_interpreters_take_what_was_compiled(tmp_path: Path) -> None:
    """The module says something else by now: what it says is not read."""
    root = tmp_path / "files"
    files = stored(root, a=b"X = 'compiled'\nWHERE = (lambda: 0).__code__.co_filename")
    bytecode.write(root, files, root)
    (root / "a.py").write_text("X = 'source'")
    code = f"import sys; sys.path.append({str(root)!r}); import a; print(a.X, a.WHERE)"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-B", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"compiled {root}/a.py\n"


def test_what_was_written_is_told(tmp_path: Path) -> None:
    files = stored(tmp_path / "files", a=b"A = 1", broken=b"?")
    told: list[int] = []
    (file,) = bytecode.write(tmp_path / "files", files, tmp_path / "out", told.append)
    data = (tmp_path / "out" / file.path).read_bytes()
    assert file.path == bytecode.cached("a.py")
    assert (file.size, file.sha256) == (len(data), hashlib.sha256(data).hexdigest())
    assert told == [5, 1]


def test_a_module_that_was_changed_is_not_compiled(tmp_path: Path) -> None:
    files = stored(tmp_path / "files", a=b"A = 1")
    (tmp_path / "files/a.py").write_bytes(b"A = 2")
    assert bytecode.write(tmp_path / "files", files, tmp_path / "out") == ()


@pytest.mark.parametrize("path", [bytecode.cached("a.py"), bytecode.FOLDER])
def test_files_that_a_wheel_brings_stay(tmp_path: Path, path: str) -> None:
    files = stored(tmp_path / "files", a=b"A = 1")
    taken = StoredFile(path, 1, "0" * 64)
    assert bytecode.write(tmp_path / "files", [*files, taken], tmp_path / "out") == ()
