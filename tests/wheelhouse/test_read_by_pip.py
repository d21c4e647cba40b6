"""Every venv is one that pip can read: what it tells is what the lock says, by either method."""

from __future__ import annotations

import importlib.metadata
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from tests.kit import pip_reader
from tests.kit.payloads import installed_wheel, make_wheel, sdk_wheel
from tests.wheelhouse.hostile_wheels import digest

from nondum.wheelhouse.build import locking
from nondum.wheelhouse.format import lock
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.store import bytecode, quota, venvs
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel

PYTHON = Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"
COMPONENT = "lamp"
METHODS = ("store", "pip")
LEFT_OUT = {
    "tools-2.0.data/scripts/old-tool": "#!python\n",
    "tools-2.0.data/headers/tools.h": "",
    "tools-2.0.data/data/share/tools/manual.txt": "",
    "a1_coverage.pth": "raise RuntimeError('a start-up hook runs')\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A payload's wheels and lock: what wheels hold beside libraries, odd names, real ones."""
    made = tmp_path_factory.mktemp("payload")
    scheme = {"tools-2.0.data/purelib/more_tools.py": ""}
    points = {"console_scripts": {"tool": "tools:main", "deep/tool": "tools:main"}}
    wheels = make_folder(made / "wheels")
    make_wheel(wheels, "tools", "2.0", {"tools.py": "", **scheme, **LEFT_OUT}, entry_points=points)
    needs = ["tools>=2", "msgpack", "absent; python_version < '3'"]
    make_wheel(wheels, "Odd.Name", "1.0.post1", {"odd/a.py": ""}, requires=needs)
    for wheel in (sdk_wheel(), installed_wheel("pluggy"), installed_wheel("msgpack")):
        shutil.copy(wheel, wheels)
    return with_lock(made)


@pytest.fixture(scope="module", params=METHODS)
def venv(request: pytest.FixtureRequest, folder: Path) -> Path:
    """A venv of that payload, by each method."""
    return made_by(request.param, folder)


def make_folder(folder: Path) -> Path:
    folder.mkdir(parents=True)
    return folder


def with_lock(folder: Path) -> Path:
    """Lock the wheels that are there."""
    text = locking.lock_text({Target.here(): sorted((folder / "wheels").iterdir())})
    (folder / lock.file_name(COMPONENT)).write_text(text, encoding="utf-8")
    return folder


def locked(folder: Path) -> tuple[LockedWheel, ...]:
    return pip_reader.locked(folder, COMPONENT)


def stored(store: Store, folder: Path) -> list[StoredWheel]:
    return [store.add(folder / wheel.path, wheel.sha256) for wheel in locked(folder)]


def made_by(method: str, folder: Path) -> Path:
    venv = folder / "venvs" / method
    if method == "pip":
        venvs.make_with_pip(venv, PYTHON, folder, locked(folder))
    else:
        venvs.make(venv, PYTHON, stored(Store(folder / "store"), folder))
    return venv


def versions(wheels: Sequence[LockedWheel]) -> dict[str, str]:
    return {wheel.name: wheel.version for wheel in wheels}


def recorded(venv: Path) -> dict[str, str]:
    """Path → digest, as RECORD has them of all distributions."""
    found = importlib.metadata.distributions(path=[str(venvs.site_packages(venv))])
    files = [file for distribution in found for file in distribution.files or ()]
    return {file.as_posix(): file.hash.value if file.hash else "" for file in files}


def installed(venv: Path) -> set[str]:
    """Paths of the files that are there, but for compiled ones."""
    site = venvs.site_packages(venv)
    found = (path for path in site.rglob("*") if path.is_file())
    return {p.relative_to(site).as_posix() for p in found if p.parent.name != bytecode.FOLDER}


def test_list_and_inspect_tell_what_is_locked(venv: Path, folder: Path) -> None:
    expected = versions(locked(folder))
    assert expected.keys() == {"odd-name", "tools", "nondum-sdk", "pluggy", "msgpack"}
    assert pip_reader.listed(venv) == expected
    inspected = pip_reader.inspected(venv)
    told = {name: row["metadata"]["version"] for name, row in inspected.items()}
    assert told == expected
    for row in inspected.values():
        assert Path(row["metadata_location"]).parent == venvs.site_packages(venv)


def test_check_finds_nothing_broken(venv: Path) -> None:
    assert pip_reader.broken(venv) == ""


def test_wheels_that_pip_installed_are_told_by_their_locked_hash(venv: Path, folder: Path) -> None:
    urls = [row.get("direct_url") for row in pip_reader.inspected(venv).values()]
    hashes = {url["archive_info"]["hashes"]["sha256"] for url in urls if url is not None}
    by_pip = venv.name == "pip"
    assert hashes == ({wheel.sha256 for wheel in locked(folder)} if by_pip else set())


def test_record_names_exactly_the_files_that_are_there(venv: Path) -> None:
    named = recorded(venv)
    assert named.keys() == installed(venv)
    assert {"tools.py", "more_tools.py"} <= named.keys()
    site = venvs.site_packages(venv)
    changed = [p for p, said in named.items() if said and said != digest((site / p).read_bytes())]
    assert changed == []


def test_scripts_headers_data_and_hooks_are_in_no_venv(venv: Path) -> None:
    names = {path.name for path in venvs.site_packages(venv).iterdir()}
    assert not names & {"bin", "share", "include", "a1_coverage.pth"}
    assert {path.name for path in (venv / "bin").iterdir()} == {"python"}


@pytest.mark.parametrize("method", METHODS)
def test_library_is_kept_where_a_script_would_lie(method: str, tmp_path: Path) -> None:
    """Two wheels have one script; a package of one of them is called as the folder of scripts."""
    wheels = make_folder(tmp_path / "wheels")
    for name, library in (("one", "bin/tool.py"), ("two", "two.py")):
        extra = {f"{name}-1.data/scripts/tool.py": "script", f"{name}-1.data/data/etc/x": ""}
        make_wheel(wheels, name, "1", {library: "library", **extra})
    venv = made_by(method, with_lock(tmp_path))
    assert (venvs.site_packages(venv) / "bin/tool.py").read_text() == "library"
    assert installed(venv) == recorded(venv).keys()
    assert not (venvs.site_packages(venv) / "etc").exists()


@pytest.mark.parametrize("method", METHODS)
def test_check_tells_what_is_missing(method: str, tmp_path: Path) -> None:
    make_wheel(make_folder(tmp_path / "wheels"), "one", "1", {"one.py": ""}, requires=["absent"])
    told = pip_reader.broken(made_by(method, with_lock(tmp_path)))
    assert "one 1 requires absent, which is not installed" in told


def test_compiled_files_change_nothing_that_pip_tells(folder: Path, tmp_path: Path) -> None:
    store = Store(tmp_path / "store")
    wheels = stored(store, folder)
    venvs.make(tmp_path / "venv", PYTHON, wheels)
    before = installed(tmp_path / "venv")
    venvs.add_compiled(tmp_path / "venv", [store.compile(wheel.sha256) for wheel in wheels])
    assert installed(tmp_path / "venv") == before == recorded(tmp_path / "venv").keys()
    assert pip_reader.listed(tmp_path / "venv") == versions(locked(folder))


def test_venv_outlives_its_store_and_is_made_again_of_a_new_one(
    folder: Path, tmp_path: Path
) -> None:
    store, expected = Store(tmp_path / "store"), versions(locked(folder))
    wheels = stored(store, folder)
    venvs.make(tmp_path / "venv", PYTHON, wheels)
    assert len(quota.prune([store], set(), 0)) == len(wheels)
    assert pip_reader.listed(tmp_path / "venv") == expected
    venvs.make(tmp_path / "venv", PYTHON, stored(store, folder))
    assert pip_reader.listed(tmp_path / "venv") == expected
    assert pip_reader.broken(tmp_path / "venv") == ""


def test_listing_runs_nothing_of_the_venv(tmp_path: Path) -> None:
    """pip imports `attr` where it finds one: it must not find that of a payload."""
    trace = tmp_path / "ran"
    source = {"attr.py": f"open({str(trace)!r}, 'w')\n"}
    make_wheel(make_folder(tmp_path / "wheels"), "bait", "1", source)
    venv = made_by("store", with_lock(tmp_path))
    assert pip_reader.listed(venv) == {"bait": "1"}
    assert pip_reader.inspected(venv).keys() == {"bait"}
    assert not trace.exists()
    subprocess.run([venv / "bin/python", "-c", "import attr"], check=True)
    assert trace.exists()
