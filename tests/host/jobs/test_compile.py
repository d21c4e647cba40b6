"""What payloads run is compiled once they run, and no payload is worse off for it."""

from __future__ import annotations

import os
import shutil
import signal
from pathlib import Path

import pytest
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload
from tests.kit.until import arrived

from nondum.host.core.events.payloads import WheelsCompiled
from nondum.host.core.events.workers import WorkerLogged
from nondum.host.core.records.step import Step
from nondum.host.manager.install_options import InstallOptions
from nondum.host.sources.inotify import folders_watched
from nondum.wheelhouse.store import bytecode
from nondum.wheelhouse.store.store import UNFINISHED, Store
from nondum.wheelhouse.store.stored import StoredWheel

pytestmark = pytest.mark.anyio

LAMP_ID = "org.example.lamp"
CACHED = bytecode.cached("test_lamp.py")
TELLING = (
    "import os\n"
    "print('from', 'bytecode' if os.path.exists(globals().get('__cached__', '')) else 'source')\n"
)
"""Says where it was loaded from, each time that it is."""


@pytest.fixture(autouse=True)
def ordinary_priority(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child that compiles is SCHED_IDLE (`test_children.py` asserts that): on a machine that is
    always busy it would get no processor time."""
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_: None)


def lamp(drive: Path, *, id: str = "lamp", payload_id: str = LAMP_ID, **files: str) -> None:
    make_payload(drive, Part(id, LAMP + TELLING, files=files), payload_id=payload_id)


def said(host: HostInProcess) -> list[str]:
    lines = (event.message for event in host.heard if isinstance(event, WorkerLogged))
    return [line for line in lines if line.startswith("from ")]


def store(host: HostInProcess) -> Store:
    return Store(host.folders.store)


def entry(host: HostInProcess, filename: str = "test_lamp-1.0-py3-none-any.whl") -> StoredWheel:
    return next(wheel for wheel in store(host).listing() if wheel.filename == filename)


def venv_file(host: HostInProcess, path: str) -> Path:
    component = host.snapshot.component("lamp")
    assert component is not None
    return component.site_packages / path


async def test_wheels_are_compiled_after_the_payload_is_active(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        wheels = store(host).listing()
        assert len(wheels) == 4
        assert all(wheel.compiled_here for wheel in wheels)
        assert not any(store(host).verify(wheel.sha256) for wheel in wheels)
        assert venv_file(host, CACHED).samefile(entry(host).root / CACHED)
        assert not any(e.event == "WheelsCompiled" for e in await host.journal())


async def test_the_next_worker_starts_from_what_was_compiled(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        assert said(host) == ["from source"]
        os.kill(host.workers.pids()["lamp"], signal.SIGKILL)
        await host.until(lambda: len(said(host)) == 2)
        assert said(host)[1] == "from bytecode"


async def test_the_next_insertion_starts_from_what_was_compiled(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        before = (entry(host).root / CACHED).stat().st_ino
        host.pull()
        await host.until_gone(LAMP_ID)
        host.heard.clear()
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        assert said(host) == ["from bytecode"]
        assert (entry(host).root / CACHED).stat().st_ino == before


async def test_modules_that_do_not_compile_are_left_without(tmp_path: Path) -> None:
    lamp(tmp_path / "drive", **{"templates/lamp.py": "class {% name %}: pass"})
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        assert [file.path for file in entry(host).compiled_here or ()] == [CACHED]
        component = host.snapshot.component("lamp")
        assert component is not None
        assert component.is_ready


async def test_a_failure_hurts_no_payload(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    lamp(tmp_path / "other", id="torch", payload_id="org.example.torch")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive", "a")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        shutil.rmtree(entry(host).folder)  # so that it cannot be compiled
        host.plug(tmp_path / "other", "b")
        await host.until_compiled("org.example.torch")
        assert len([e for e in host.heard if isinstance(e, WheelsCompiled)]) == 1
        for id in ("lamp", "torch"):
            component = host.snapshot.component(id)
            assert component is not None
            assert component.is_ready


async def test_a_withdrawn_payload_is_not_compiled(tmp_path: Path) -> None:
    """It is pulled as its compilation begins, half done at any point."""
    sources = {f"lamp_{n}.py": f"X = [{','.join(map(str, range(20_000)))}]" for n in range(20)}
    lamp(tmp_path / "drive", **sources)
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        unfinished = entry(host).folder / UNFINISHED
        with folders_watched([unfinished.parent]) as changed:

            async def begun() -> None:
                while not unfinished.exists():
                    await changed.wait()
                    changed.clear()

            await arrived("a compilation that has begun", begun())
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)
        assert store(host).verify(entry(host).sha256) == ()
        assert not any(isinstance(event, WheelsCompiled) for event in host.heard)


async def test_what_pip_installed_is_left_as_it_is(tmp_path: Path) -> None:
    lamp(tmp_path / "drive")
    options = InstallOptions(allow_unsigned=True, method="pip")
    async with host_in_process(tmp_path, options=options) as host:
        host.plug(tmp_path / "drive")
        await host.until_compiled(LAMP_ID)
        assert not venv_file(host, CACHED).exists()
