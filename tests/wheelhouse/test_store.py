"""The store: whole wheels or none, the same files for ever, and the least used go first."""

from __future__ import annotations

import hashlib
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from tests.kit.payloads import make_wheel, sha256
from tests.wheelhouse.file_systems import file_system, needs_mount
from tests.wheelhouse.hostile_wheels import INFO, METADATA, WHEEL, Lie, WheelBuilder, record_of

from nondum.sdk.errors import InstallFailed, PayloadRefused
from nondum.wheelhouse.store import quota
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel

SOURCES = {"plain/__init__.py": "X = 1\n", "plain/data.bin": "d" * 10_000}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


def plain(folder: Path, name: str = "plain", version: str = "1.0") -> Path:
    folder.mkdir(exist_ok=True)
    return make_wheel(
        folder, name, version, {f"{name}/{k.partition('/')[2]}": v for k, v in SOURCES.items()}
    )


def added(store: Store, path: Path) -> StoredWheel:
    return store.add(path, sha256(path))


def test_a_wheel_is_unpacked_whole(store: Store, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    path = plain(tmp_path / "w")
    stored = store.add(path, sha256(path), lambda done, total: told.append((done, total)))
    assert {f.path for f in stored.files} == {
        *SOURCES,
        *(f"plain-1.0.dist-info/{name}" for name in ("METADATA", "WHEEL", "RECORD")),
    }
    for file in stored.files:
        data = (stored.root / file.path).read_bytes()
        assert (file.size, file.sha256) == (len(data), hashlib.sha256(data).hexdigest())
    assert told == sorted(told)
    assert told[-1] == (stored.size, stored.size)
    assert store.verify(stored.sha256) == ()
    assert store.get(stored.sha256) == stored
    assert store.listing() == (stored,)


def test_stored_files_are_read_only(store: Store, tmp_path: Path) -> None:
    stored = added(store, plain(tmp_path / "w"))
    modes = {stat.S_IMODE((stored.root / f.path).stat().st_mode) for f in stored.files}
    assert modes == {0o444}


def test_executables_stay_so(store: Store, tmp_path: Path) -> None:
    builder = WheelBuilder(lies={"evil/__init__.py": Lie(mode=0o100755)})
    stored = added(store, builder.write(tmp_path))
    assert stat.S_IMODE((stored.root / "evil/__init__.py").stat().st_mode) == 0o555


def test_a_known_wheel_is_not_unpacked_again(store: Store, tmp_path: Path) -> None:
    path = plain(tmp_path / "w")
    first = added(store, path)
    before = (first.root / "plain/data.bin").stat().st_ino
    assert added(store, path) == first
    assert (first.root / "plain/data.bin").stat().st_ino == before


def test_several_wheels_come_in_together(store: Store, tmp_path: Path) -> None:
    paths = [plain(tmp_path / "w", name) for name in ("one", "two", "three")]
    known = added(store, paths[1])
    stored = store.add_all([(path, sha256(path)) for path in paths])
    assert [wheel.filename for wheel in stored] == [path.name for path in paths]
    assert stored[1] == known
    assert all(store.get(wheel.sha256) == wheel for wheel in stored)
    assert not any(store.verify(wheel.sha256) for wheel in stored)


def test_wheel_stays_where_progress_cannot_be_reported(store: Store, tmp_path: Path) -> None:
    """As when the daemon is killed while its job reads the store."""
    path = make_wheel(tmp_path, "large", "1.0", {"large/data.bin": "d" * 600_000})
    stored = added(store, path)

    def broken() -> None:
        raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        store.add_all([(path, stored.sha256)], alive=broken)
    assert store.get(stored.sha256) == stored


def test_one_bad_wheel_keeps_out_all_new_ones(store: Store, tmp_path: Path) -> None:
    good, bad = plain(tmp_path / "w"), plain(tmp_path / "w", "bad")
    known = added(store, plain(tmp_path / "w", "known"))
    with pytest.raises(PayloadRefused, match="HASH_MISMATCH"):
        store.add_all([(good, sha256(good)), (bad, "0" * 64)])
    assert [path.name for path in store.root.iterdir()] == [known.sha256]


@pytest.mark.parametrize("harm", ["change", "truncate", "remove"])
def test_damage_is_found_and_repaired(store: Store, tmp_path: Path, harm: str) -> None:
    path = plain(tmp_path / "w")
    stored = added(store, path)
    victim = stored.root / "plain/data.bin"
    victim.chmod(0o644)
    if harm == "remove":
        victim.unlink()
    else:
        victim.write_text("e" * 10_000 if harm == "change" else "d")
    (problem,) = store.verify(stored.sha256)
    assert problem.code == "STORE_DAMAGED"
    assert "plain/data.bin" in problem.message
    assert added(store, path) == stored
    assert store.verify(stored.sha256) == ()


@pytest.mark.parametrize("text", ["", "{", "[]", '{"wheel": 1}', '{"wheel": "a", "files": 3}'])
def test_a_broken_manifest_counts_as_absent(store: Store, tmp_path: Path, text: str) -> None:
    path = plain(tmp_path / "w")
    stored = added(store, path)
    (stored.folder / "manifest.json").write_text(text)
    assert store.get(stored.sha256) is None
    assert [p.code for p in store.verify(stored.sha256)] == ["STORE_MISSING"]
    assert store.listing() == ()
    assert added(store, path) == stored


def test_another_wheel_than_the_locked_is_refused(store: Store, tmp_path: Path) -> None:
    with pytest.raises(PayloadRefused) as refused:
        store.add(plain(tmp_path / "w"), "0" * 64)
    assert refused.value.code == "HASH_MISMATCH"
    assert list(store.root.iterdir()) == []


def test_what_is_not_there_cannot_be_compiled(store: Store) -> None:
    with pytest.raises(InstallFailed) as failed:
        store.compile("0" * 64)
    assert failed.value.code == "STORE_MISSING"


def test_a_hostile_wheel_leaves_nothing(store: Store, tmp_path: Path) -> None:
    record = record_of(
        {"evil/__init__.py": b"?", f"{INFO}/METADATA": b"", f"{INFO}/WHEEL": WHEEL},
        f"{INFO}/RECORD",
    )
    for builder in (WheelBuilder(record=record), WheelBuilder(files={"../out.py": b""})):
        path = builder.write(tmp_path)
        with pytest.raises(PayloadRefused):
            added(store, path)
    assert list(store.root.iterdir()) == []
    assert not (tmp_path / "out.py").exists()


@pytest.mark.parametrize("harm", ["digest", "checksum"])
def test_bytes_that_are_not_what_they_were_said_to_be_are_not_stored(
    store: Store, tmp_path: Path, harm: str
) -> None:
    files = {"evil/__init__.py": b"Y = 2\n", f"{INFO}/METADATA": METADATA, f"{INFO}/WHEEL": WHEEL}
    record = record_of(files, f"{INFO}/RECORD")
    builder = WheelBuilder(record=record)
    if harm == "checksum":
        builder = WheelBuilder(lies={"evil/__init__.py": Lie(crc=1)})
    path = builder.write(tmp_path)
    with pytest.raises(PayloadRefused) as refused:
        added(store, path)
    assert [problem.code for problem in refused.value.problems] == ["WHEEL_RECORD"]
    assert list(store.root.iterdir()) == []


def test_half_done_work_is_swept(store: Store, tmp_path: Path) -> None:
    stored = added(store, plain(tmp_path / "w"))
    (store.root / ".abc.part/files").mkdir(parents=True)
    (store.root / ".abc.gone").mkdir()
    assert {p.name for p in store.sweep()} == {".abc.part", ".abc.gone"}
    assert [p.name for p in store.root.iterdir()] == [stored.sha256]


def test_half_done_work_does_not_stand_in_the_way(store: Store, tmp_path: Path) -> None:
    path = plain(tmp_path / "w")
    left = store.root / f".{sha256(path)}.part/files/plain"
    left.mkdir(parents=True)
    (left / "__init__.py").write_text("half")
    assert store.verify(added(store, path).sha256) == ()


def test_the_least_used_are_pruned_first(store: Store, tmp_path: Path) -> None:
    wheels = [added(store, plain(tmp_path / "w", name)) for name in ("one", "two", "three")]
    for age, stored in enumerate(wheels):
        os.utime(stored.folder, (1000 + age, 1000 + age))
    one, two, three = wheels
    assert quota.prune([store], (), 10**9) == ()
    assert quota.prune([store], {one.sha256}, one.size + three.size) == (two.sha256,)
    assert {w.sha256 for w in store.listing()} == {one.sha256, three.sha256}
    assert quota.prune([store], (), 0) == (one.sha256, three.sha256)


def test_use_keeps_a_wheel_young(store: Store, tmp_path: Path) -> None:
    old, new = (plain(tmp_path / "w", name) for name in ("old", "new"))
    first, second = added(store, old), added(store, new)
    for stored in (first, second):
        os.utime(stored.folder, (1000, 1000))
    added(store, old)
    assert quota.prune([store], (), first.size) == (second.sha256,)


def test_links_outlive_their_wheel(store: Store, tmp_path: Path) -> None:
    stored = added(store, plain(tmp_path / "w"))
    os.link(stored.root / "plain/data.bin", tmp_path / "link")
    store.remove(stored.sha256)
    assert (tmp_path / "link").read_text() == SOURCES["plain/data.bin"]
    assert store.get(stored.sha256) is None
    store.remove(stored.sha256)


@needs_mount
def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    noise = os.urandom(4 * 1024**2)
    path = make_wheel(tmp_path, "big", "1.0", {"big/noise.bin": noise})
    with file_system(tmp_path / "small", 3) as small:
        store = Store(small / "store")
        with pytest.raises(InstallFailed) as failed:
            added(store, path)
        assert failed.value.code == "DISK_FULL"
        assert failed.value.problems[0].fix
        assert list(store.root.iterdir()) == []


def test_what_is_renamed_in_was_synced(tmp_path: Path) -> None:
    """The order of the system calls, as the kernel saw them."""
    path = plain(tmp_path / "w")
    script = (
        "from pathlib import Path; import sys; from nondum.wheelhouse.store.store import Store\n"
        f"Store(Path({str(tmp_path / 'store')!r})).add(Path({str(path)!r}), {sha256(path)!r})"
    )
    trace = tmp_path / "trace"
    calls = "trace=syncfs,fsync,rename"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = ["strace", "-f", "-y", "-o", str(trace), "-e", calls]
    subprocess.run([*command, sys.executable, "-c", script], check=True, env=environment)
    seen = [line.split(None, 1)[1] for line in trace.read_text().splitlines() if "store" in line]
    names = [line.partition("(")[0] for line in seen]
    assert names == ["syncfs", "rename", "fsync"]
