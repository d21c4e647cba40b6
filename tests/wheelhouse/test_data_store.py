"""Data that are kept by hash: linked where they are wanted, hashed again, least used gone first."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from nondum.sdk.errors import InstallFailed
from nondum.wheelhouse.format.contents import Entry
from nondum.wheelhouse.store import quota
from nondum.wheelhouse.store.data_store import DataStore


@pytest.fixture
def store(tmp_path: Path) -> DataStore:
    return DataStore(tmp_path / "data")


def entry(data: bytes, path: str = "data/a/b") -> Entry:
    return Entry(hashlib.sha256(data).hexdigest(), len(data), path)


def kept(store: DataStore, data: bytes) -> Entry:
    """Data that the store has, of a payload that is gone."""
    found = entry(data)
    path = store.root.parent / "payload"
    path.write_bytes(data)
    store.keep(path, found.sha256)
    path.unlink()
    return found


def link(store: DataStore, *entries: Entry) -> Path:
    folder = store.root.parent / "staging"
    store.link(entries, folder, lambda: None)
    return folder


def test_what_is_kept_is_linked_where_it_is_wanted(store: DataStore) -> None:
    found = kept(store, b"weights")
    assert store.has(found)
    assert (link(store, found) / found.path).read_bytes() == b"weights"
    assert (store.root / found.sha256).stat().st_nlink == 2


def test_what_is_kept_can_be_written_to_by_no_user(store: DataStore) -> None:
    found = kept(store, b"weights")
    assert (store.root / found.sha256).stat().st_mode & 0o777 == 0o444


def test_a_file_is_kept_once(store: DataStore) -> None:
    assert kept(store, b"weights") == kept(store, b"weights")
    assert len(list(store.kept())) == 1


def test_a_file_of_another_size_is_not_the_one(store: DataStore) -> None:
    found = kept(store, b"weights")
    assert not store.has(Entry(found.sha256, 3, found.path))
    assert not store.has(entry(b"others"))


def test_a_file_that_is_not_as_it_was_is_refused_and_deleted(store: DataStore) -> None:
    whole, broken = kept(store, b"weights"), kept(store, b"a map of the hall")
    path = store.root / broken.sha256
    path.chmod(0o644)
    path.write_bytes(b"a map of the mall")
    whole = Entry(whole.sha256, whole.size, "data/a/c")
    with pytest.raises(InstallFailed) as failed:
        link(store, whole, broken)
    assert [problem.code for problem in failed.value.problems] == ["STORE_DAMAGED"]
    assert (store.has(whole), store.has(broken)) == (True, False)


def test_a_file_that_goes_meanwhile_is_told(store: DataStore) -> None:
    found = kept(store, b"weights")
    store.remove(found.sha256)
    with pytest.raises(InstallFailed) as failed:
        link(store, found)
    assert failed.value.code == "IO_ERROR"


def test_the_least_used_goes_first(store: DataStore) -> None:
    first, second = kept(store, b"first"), kept(store, b"second")
    for one in (first, second):
        os.utime(store.root / one.sha256, (1000, 1000))
    link(store, first)
    assert quota.prune([store], (), first.size) == (second.sha256,)
    assert quota.prune([store], {first.sha256}, 0) == ()
    assert [one.sha256 for one in store.kept()] == [first.sha256]
