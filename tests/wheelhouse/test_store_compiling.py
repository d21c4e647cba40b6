"""Compiled files in the store: recorded, hashed again, counted, and never half there."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from tests.kit.payloads import make_wheel, sha256
from tests.wheelhouse.file_systems import file_system, needs_mount

from nondum.sdk.errors import InstallFailed
from nondum.wheelhouse.store import bytecode, quota, venvs
from nondum.wheelhouse.store.store import UNFINISHED, Store
from nondum.wheelhouse.store.stored import StoredWheel

PYTHON = Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"
SOURCES = {"a/__init__.py": "", "a/b.py": "B = 1\n", "a/t.py": "{% template %}", "a/data": "x"}
COMPILED = {bytecode.cached("a/__init__.py"), bytecode.cached("a/b.py")}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


@pytest.fixture
def entry(store: Store, tmp_path: Path) -> StoredWheel:
    path = make_wheel(tmp_path, "a", "1", SOURCES)
    return store.add(path, sha256(path))


def on_disk(entry: StoredWheel) -> set[str]:
    files = (path for path in entry.root.rglob("*.pyc"))
    return {path.relative_to(entry.root).as_posix() for path in files}


def test_modules_are_compiled_and_recorded(store: Store, entry: StoredWheel) -> None:
    compiled = store.compile(entry.sha256)
    assert compiled == store.get(entry.sha256)
    assert {file.path for file in compiled.compiled_here or ()} == COMPILED == on_disk(entry)
    assert compiled.files == entry.files
    assert store.verify(entry.sha256) == ()
    assert not (entry.folder / UNFINISHED).exists()


def test_compiled_bytes_count(store: Store, entry: StoredWheel) -> None:
    compiled = store.compile(entry.sha256)
    on_disk = sum((entry.root / path).stat().st_size for path in COMPILED)
    assert compiled.size == entry.size + on_disk
    assert quota.prune([store], (), compiled.size) == ()
    assert quota.prune([store], (), entry.size) == (compiled.sha256,)


def test_compiling_twice_does_nothing(store: Store, entry: StoredWheel) -> None:
    compiled = store.compile(entry.sha256)
    path = entry.root / bytecode.cached("a/b.py")
    before = path.stat().st_ino
    assert store.compile(entry.sha256) == compiled
    assert path.stat().st_ino == before


def test_several_interpreters_share_an_entry(
    store: Store, entry: StoredWheel, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.compile(entry.sha256)
    with monkeypatch.context() as other:
        other.setattr(bytecode, "TAG", "cpython-399")
        both = store.compile(entry.sha256)
        assert all("cpython-399" in file.path for file in both.compiled_here or ())
    assert {compiled.tag for compiled in both.compiled} == {bytecode.TAG, "cpython-399"}
    assert len(on_disk(entry)) == 4
    assert store.verify(entry.sha256) == ()


def test_a_wheel_that_is_not_there_cannot_be_compiled(store: Store) -> None:
    with pytest.raises(InstallFailed) as failed:
        store.compile("0" * 64)
    assert failed.value.code == "STORE_MISSING"


@pytest.mark.parametrize("harm", ["change", "remove"])
def test_damaged_compiled_files_are_dropped(store: Store, entry: StoredWheel, harm: str) -> None:
    store.compile(entry.sha256)
    victim = entry.root / bytecode.cached("a/b.py")
    victim.unlink()
    if harm == "change":
        victim.write_bytes(b"something else")
    assert [problem.code for problem in store.verify(entry.sha256)] == ["STORE_DAMAGED"]
    assert store.whole(entry.sha256) == entry
    assert store.get(entry.sha256) == entry
    assert on_disk(entry) == set()
    assert store.verify(entry.sha256) == ()
    store.compile(entry.sha256)
    assert on_disk(entry) == COMPILED


def test_damaged_modules_take_the_compiled_with_them(
    store: Store, entry: StoredWheel, tmp_path: Path
) -> None:
    store.compile(entry.sha256)
    (entry.root / "a/b.py").unlink()
    assert store.whole(entry.sha256) is None
    path = next(tmp_path.glob("*.whl"))
    assert store.add(path, sha256(path)) == entry
    assert on_disk(entry) == set()


def test_an_entry_of_before_is_read(store: Store, entry: StoredWheel) -> None:
    manifest = entry.folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace(', "compiled": {}', ""))
    assert store.get(entry.sha256) == entry


@needs_mount
def test_a_full_disk_leaves_the_entry_as_it_was(tmp_path: Path) -> None:
    numbers = ",".join(map(str, range(1000, 250_000)))  # compiles to more than its source
    path = make_wheel(tmp_path, "big", "1", {"big.py": f"X = [{numbers}]\n"})
    with file_system(tmp_path / "small", 4) as small:
        store = Store(small / "store")
        entry = store.add(path, sha256(path))
        (small / "rest").write_bytes(bytes(shutil.disk_usage(small).free - 300_000))
        with pytest.raises(InstallFailed) as failed:
            store.compile(entry.sha256)
        assert failed.value.code == "DISK_FULL"
        assert store.whole(entry.sha256) == entry
        assert not (entry.folder / UNFINISHED).exists()


CALLS = ("mkdir", "chmod", "rename", "syncfs", "fsync", "unlink", "unlinkat", "rmdir")
"""Of compiling, what leaves a trace on disk; the bytes of files are written in between."""


@pytest.mark.slow
def test_killed_at_any_call_the_entry_is_whole(
    store: Store, entry: StoredWheel, tmp_path: Path
) -> None:
    script = (
        "from pathlib import Path; from nondum.wheelhouse.store.store import Store\n"
        f"Store(Path({str(store.root)!r})).compile({entry.sha256!r})"
    )
    made = counted(script, tmp_path / "trace")
    assert made["rename"] == len(COMPILED) + 1
    for call, times in made.items():
        for time in range(1, times + 1):
            forget(store, entry)
            killed = traced(script, "-e", f"inject={call}:signal=SIGKILL:when={time}")
            assert killed == -9, (call, time)
            check(store, entry, tmp_path / "venv")


def counted(script: str, trace: Path) -> Counter[str]:
    """How often an undisturbed run makes each call."""
    assert traced(script, "-o", str(trace)) == 0
    lines = (line.split(None, 1)[1] for line in trace.read_text().splitlines())
    return Counter(line.partition("(")[0] for line in lines if "(" in line)


def traced(script: str, *options: str) -> int:
    path = os.pathsep.join(sys.path)
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["strace", "-f", "-e", f"trace={','.join(CALLS)}", *options, sys.executable]
    ended = subprocess.run(
        [*command, "-c", script], env=environment, capture_output=True, check=False
    )
    return ended.returncode


def forget(store: Store, entry: StoredWheel) -> None:
    """Have a wheel not compiled."""
    for path in on_disk(entry):
        (entry.root / path).unlink()
    store.sweep()
    store.whole(entry.sha256)
    assert store.get(entry.sha256) == entry


def check(store: Store, entry: StoredWheel, venv: Path) -> None:
    """What a killed compilation left is whole, can be used, and is compiled the next time."""
    assert store.verify(entry.sha256) == ()
    left = store.whole(entry.sha256)
    assert left is not None
    assert left.files == entry.files
    assert left.compiled_here is None or {f.path for f in left.compiled_here} == COMPILED
    venvs.make(venv, PYTHON, [left])
    linked = {p.relative_to(venvs.site_packages(venv)).as_posix() for p in venv.rglob("*.pyc")}
    assert linked == {file.path for file in left.compiled_here or ()}
    store.compile(entry.sha256)
    store.sweep()
    assert store.verify(entry.sha256) == ()
    assert on_disk(entry) == COMPILED
    assert not (entry.folder / UNFINISHED).exists()
