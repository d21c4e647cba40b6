"""Compiled files: what interpreters take, of the very bytes that were stored, or none."""

from __future__ import annotations

import hashlib
import os
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


class Host:
    """A folder of modules that an interpreter imports from, and has compiled."""

    def __init__(self, root: Path, **sources: bytes) -> None:
        self.root, self.files = root / "host", stored(root / "host", **sources)
        run = "import sys; sys.path.insert(0, sys.argv[1]); " + "; ".join(
            f"import {name}" for name in sources
        )
        subprocess.run([sys.executable, "-I", "-c", run, str(self.root)], check=True)

    def known_of(self, wheel: Path, files: list[StoredFile]) -> list[str] | None:
        done = bytecode.write_known(wheel, files, [str(wheel.parent / "nowhere"), str(self.root)])
        return None if done is None else [file.path for file in done]


def says(root: Path, module: str) -> str:
    """What an interpreter that may not write finds in a module, which is not its source any more:
    where it says it is, and its value."""
    (root / f"{module}.py").write_text("raise SystemExit")
    run = f"import sys; sys.path.insert(0, sys.argv[1]); from {module} import *; print(where(), x)"
    command = [sys.executable, "-I", "-B", "-c", run, str(root)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


WHERE = b"def where(): return where.__code__.co_filename"


def test_modules_that_the_host_has_are_compiled_as_they_are_stored(tmp_path: Path) -> None:
    source = b"x = 1\n" + WHERE
    host = Host(tmp_path, a=source)
    wheel = tmp_path / "wheel"
    files = stored(wheel, a=source)
    assert host.known_of(wheel, files) == [bytecode.cached("a.py")]
    assert says(wheel, "a") == f"{wheel}/a.py 1"


@pytest.mark.parametrize("mode", ["checked-hash", "unchecked-hash"])
def test_what_the_host_has_compiled_by_hash_is_taken_too(tmp_path: Path, mode: str) -> None:
    source = b"x = 2\n" + WHERE
    host, wheel = Host(tmp_path, a=source), tmp_path / "wheel"
    command = [
        sys.executable,
        "-m",
        "compileall",
        "-qf",
        "--invalidation-mode",
        mode,
        str(host.root),
    ]
    subprocess.run(command, check=True)
    assert host.known_of(wheel, stored(wheel, a=source))
    assert says(wheel, "a") == f"{wheel}/a.py 2"


def test_modules_that_the_host_has_compiled_of_other_bytes_are_compiled(tmp_path: Path) -> None:
    """The host has another module by now."""
    host, wheel = Host(tmp_path, a=b"x = 1\n" + WHERE), tmp_path / "wheel"
    source = b"x = 3\n" + WHERE
    before = (host.root / "a.py").stat()
    (host.root / "a.py").write_bytes(source)
    os.utime(host.root / "a.py", ns=(before.st_atime_ns, before.st_mtime_ns + 10**9))
    assert host.known_of(wheel, stored(wheel, a=source))
    assert says(wheel, "a") == f"{wheel}/a.py 3"


def test_wheel_with_one_module_that_the_host_has_not_is_left_to_be_compiled(tmp_path: Path) -> None:
    host = Host(tmp_path, a=b"x = 1", b=b"y = 1")
    assert host.known_of(tmp_path / "one", stored(tmp_path / "one", a=b"x = 1", b=b"y = 2")) is None
    assert host.known_of(tmp_path / "two", stored(tmp_path / "two", a=b"x = 1", c=b"z = 1")) is None
    assert host.known_of(tmp_path / "three", stored(tmp_path / "three")) is None
    for name in ("one", "two"):
        assert not list((tmp_path / name).rglob("*.pyc"))
