"""Venvs: whole or not there, of links, and good enough for interpreters (pip: test_read_by_pip)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.kit.payloads import installed_wheel, make_wheel, sha256
from tests.kit.processes import is_alive
from tests.kit.until import until
from tests.wheelhouse.file_systems import file_system, needs_mount

from nondum.sdk.errors import InstallFailed
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.store import bytecode, venvs
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel

PYTHON = Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


def stored(store: Store, *paths: Path) -> list[StoredWheel]:
    return [store.add(path, sha256(path)) for path in paths]


def test_files_are_links_to_the_store(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "a", "1", {"a/__init__.py": "X = 1", "a/b": ""}))
    venv = tmp_path / "venv"
    venvs.make(venv, PYTHON, [wheel])
    site = venvs.site_packages(venv)
    assert {p.relative_to(site).as_posix() for p in site.rglob("*") if p.is_file()} == {
        file.path for file in wheel.files
    }
    for file in wheel.files:
        assert (site / file.path).samefile(wheel.root / file.path)


def test_interpreters_take_it_for_a_venv(store: Store, tmp_path: Path) -> None:
    venv = tmp_path / "venv"
    venvs.make(venv, PYTHON, stored(store, *map(installed_wheel, ("pluggy", "msgpack"))))
    code = "import json, sys, pluggy, msgpack; print(json.dumps([sys.prefix, pluggy.__file__]))"
    done = subprocess.run(
        [venv / "bin/python", "-I", "-c", code], capture_output=True, text=True, check=True
    )
    prefix, file = json.loads(done.stdout)
    assert Path(prefix) == venv
    assert Path(file).is_relative_to(venvs.site_packages(venv))


def test_a_namespace_is_shared(store: Store, tmp_path: Path) -> None:
    wheels = stored(
        store,
        make_wheel(tmp_path, "ns-a", "1", {"ns/a.py": "A = 1"}),
        make_wheel(tmp_path, "ns-b", "1", {"ns/b.py": "B = 2"}),
    )
    venvs.make(tmp_path / "venv", PYTHON, wheels)
    code = "import ns.a, ns.b; print(ns.a.A + ns.b.B)"
    done = subprocess.run(
        [tmp_path / "venv/bin/python", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == "3\n"


def test_the_same_file_of_two_wheels_is_linked_once(store: Store, tmp_path: Path) -> None:
    same = "__import__('pkg_resources').declare_namespace(__name__)"
    wheels = stored(
        store,
        *(make_wheel(tmp_path, n, "1", {"ns/__init__.py": same, f"ns/{n}.py": ""}) for n in "ab"),
    )
    venvs.make(tmp_path / "venv", PYTHON, wheels)
    assert (venvs.site_packages(tmp_path / "venv") / "ns/b.py").exists()


@pytest.mark.parametrize(
    ("one", "other"),
    [
        pytest.param("ns/x.py", "ns/x.py", id="contents"),
        pytest.param("ns/x.py", "ns/x.py/y.py", id="folder where a file is"),
        pytest.param("ns/x.py/y.py", "ns/x.py", id="file where a folder is"),
    ],
)
def test_colliding_wheels_are_refused(store: Store, tmp_path: Path, one: str, other: str) -> None:
    wheels = stored(
        store,
        make_wheel(tmp_path, "one", "1", {one: "1"}),
        make_wheel(tmp_path, "two", "1", {other: "2"}),
    )
    with pytest.raises(InstallFailed) as failed:
        venvs.make(tmp_path / "venv", PYTHON, wheels)
    assert failed.value.code == "FILES_COLLIDE"
    assert "one-1" in str(failed.value)
    assert "two-1" in str(failed.value)
    assert [p.name for p in tmp_path.iterdir() if "venv" in p.name] == []


def test_a_venv_is_replaced_whole(store: Store, tmp_path: Path) -> None:
    one, two = stored(
        store,
        make_wheel(tmp_path, "one", "1", {"one.py": ""}),
        make_wheel(tmp_path, "two", "1", {"two.py": ""}),
    )
    venv = tmp_path / "venv"
    venvs.make(venv, PYTHON, [one])
    venvs.make(venv, PYTHON, [two])
    assert {p.name for p in venvs.site_packages(venv).iterdir()} == {"two.py", "two-1.dist-info"}


def test_making_is_idempotent_after_a_crash(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "one", "1", {"one.py": ""}))
    left = venvs.site_packages(tmp_path / ".venv.part")
    left.mkdir(parents=True)
    (left / "half.py").touch()
    venvs.make(tmp_path / "venv", PYTHON, [wheel])
    assert not (venvs.site_packages(tmp_path / "venv") / "half.py").exists()


def test_removing_leaves_nothing(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "one", "1", {"one.py": ""}))
    venvs.make(tmp_path / "venv", PYTHON, [wheel])
    venvs.remove(tmp_path / "venv")
    venvs.remove(tmp_path / "venv")
    assert not (tmp_path / "venv").exists()
    assert store.verify(wheel.sha256) == ()


@needs_mount
def test_across_file_systems_files_are_copied(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "one", "1", {"one.py": "X = 1"}))
    with file_system(tmp_path / "other", 8) as other:
        venvs.make(other / "venv", PYTHON, [wheel])
        assert (venvs.site_packages(other / "venv") / "one.py").read_text() == "X = 1"
        for _ in range(2):
            venvs.add_compiled(other / "venv", [store.compile(wheel.sha256)])
        (copy,) = venvs.site_packages(other / "venv").rglob("__pycache__/*")
        assert copy.name == Path(bytecode.cached("one.py")).name


@needs_mount
def test_a_full_disk_leaves_no_venv(store: Store, tmp_path: Path) -> None:
    big = {"big.bin": os.urandom(3 * 1024**2)}
    (wheel,) = stored(store, make_wheel(tmp_path, "big", "1", big))
    with file_system(tmp_path / "small", 2) as small:
        with pytest.raises(InstallFailed) as failed:
            venvs.make(small / "venv", PYTHON, [wheel])
        assert failed.value.code == "DISK_FULL"
        assert {p.name for p in small.iterdir()} == {"lost+found"}


COMPILED = bytecode.cached("ns/__init__.py")


def test_compiled_files_are_linked_too(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "a", "1", {"ns/__init__.py": "", "b.py": ""}))
    compiled = store.compile(wheel.sha256)
    venvs.make(tmp_path / "venv", PYTHON, [compiled])
    site = venvs.site_packages(tmp_path / "venv")
    for file in compiled.all_files:
        assert (site / file.path).samefile(compiled.root / file.path)


def test_compiled_files_are_added_to_a_venv(store: Store, tmp_path: Path) -> None:
    same = {"ns/__init__.py": ""}
    wheels = stored(store, *(make_wheel(tmp_path, n, "1", {**same, f"{n}.py": ""}) for n in "ab"))
    venvs.make(tmp_path / "venv", PYTHON, wheels)
    site = venvs.site_packages(tmp_path / "venv")
    assert not list(site.rglob("*.pyc"))
    compiled = [store.compile(wheel.sha256) for wheel in wheels]
    for _ in range(2):
        venvs.add_compiled(tmp_path / "venv", compiled)
    assert (site / COMPILED).samefile(compiled[0].root / COMPILED)
    assert (site / bytecode.cached("b.py")).samefile(compiled[1].root / bytecode.cached("b.py"))


@pytest.mark.parametrize("path", [COMPILED, "ns/__pycache__"])
def test_what_another_wheel_brings_stays(store: Store, tmp_path: Path, path: str) -> None:
    one, other = stored(
        store,
        make_wheel(tmp_path, "one", "1", {"ns/__init__.py": ""}),
        make_wheel(tmp_path, "other", "1", {path: "its own"}),
    )
    venvs.make(tmp_path / "venv", PYTHON, [store.compile(one.sha256), other])
    assert (venvs.site_packages(tmp_path / "venv") / path).read_text() == "its own"


def test_adding_to_no_venv_is_told(store: Store, tmp_path: Path) -> None:
    (wheel,) = stored(store, make_wheel(tmp_path, "one", "1", {"one.py": ""}))
    with pytest.raises(InstallFailed) as failed:
        venvs.add_compiled(tmp_path / "nowhere", [store.compile(wheel.sha256)])
    assert failed.value.code == "IO_ERROR"


def locked(path: Path) -> LockedWheel:
    name, version = path.name.split("-")[:2]
    size = path.stat().st_size
    return LockedWheel(name, version, f"wheels/{path.name}", sha256(path), size, unpacked=size)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "payload/wheels").mkdir(parents=True)
    return tmp_path / "payload"


def test_pip_makes_one_too(folder: Path, tmp_path: Path) -> None:
    path = make_wheel(folder / "wheels", "one", "1", {"one.py": "X = 1"}, requires=["absent"])
    venvs.make_with_pip(tmp_path / "venv", PYTHON, folder, [locked(path)])
    site = venvs.site_packages(tmp_path / "venv")
    assert (site / "one.py").read_text() == "X = 1"
    assert (site / "one-1.dist-info/RECORD").exists()
    assert not (tmp_path / "venv/requirements.txt").exists()


INSTALLER = """
import sys
from pathlib import Path
from nondum.wheelhouse.store import venvs
from nondum.wheelhouse.format.lock import LockedWheel
venv, python, folder = map(Path, sys.argv[1:])
wheel = LockedWheel("one", "1", "wheels/one-1-py3-none-any.whl", "0" * 64, 1, 1)
venvs.make_with_pip(venv, python, folder, [wheel])
"""


def test_pip_ends_with_the_process_that_runs_it(folder: Path, tmp_path: Path) -> None:
    os.mkfifo(folder / "wheels/one-1-py3-none-any.whl")  # pip reads until somebody has written
    command = [sys.executable, "-c", INSTALLER, str(tmp_path / "venv"), str(PYTHON), str(folder)]
    with subprocess.Popen(command) as installer:
        children = Path(f"/proc/{installer.pid}/task/{installer.pid}/children")
        pip = int(until("pip runs", lambda: children.read_text().split())[0])
        installer.kill()
    until("pip has ended", lambda: not is_alive(pip))


def test_pip_refuses_another_wheel(folder: Path, tmp_path: Path) -> None:
    path = make_wheel(folder / "wheels", "one", "1", {"one.py": "X = 1"})
    entry = locked(path)
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(InstallFailed) as failed:
        venvs.make_with_pip(tmp_path / "venv", PYTHON, folder, [entry])
    assert failed.value.code == "PIP_FAILED"
    assert not (tmp_path / "venv").exists()
    assert not (tmp_path / ".venv.part").exists()


def test_pip_is_not_swayed_by_its_environment(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pip.conf").write_text("[install]\nprefix = /nowhere\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    monkeypatch.setenv("PIP_TARGET", str(tmp_path / "elsewhere"))
    path = make_wheel(folder / "wheels", "one", "1", {"one.py": "X = 1"})
    venvs.make_with_pip(tmp_path / "venv", PYTHON, folder, [locked(path)])
    assert not (tmp_path / "elsewhere").exists()
