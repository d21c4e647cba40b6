"""A payload that was withdrawn and comes back: judged again, but not copied, checked and linked."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from tests.kit.host import LAMP, HostInProcess, host_in_process
from tests.kit.lamp_drive import code, lamp, told
from tests.kit.payloads import Part, make_payload
from tests.kit.signing import Key, sign_payload, trust_of
from tests.kit.until import until_async

from nondum.host.core.events.payloads import PayloadActivated, PayloadCached, PayloadCopied
from nondum.host.core.records.step import Step
from nondum.host.jobs import cached, install, look
from nondum.host.manager import payload_cache
from nondum.host.manager.install_options import InstallOptions
from nondum.host.workers.spec import Timing
from nondum.wheelhouse.payload.memory import Promised
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.trust import trust_text

ALICE, BOB = Key("alice"), Key("bob")
LAMP_ID = "org.example.lamp"
QUICK = Timing(startup_s=20.0, settle_beats=0)


class Away:
    """A payload that was installed, and whose checked files are in the cache."""

    def __init__(self, root: Path) -> None:
        self.drive = lamp(root / "drive", requires="memory_mb = 1")
        self.folder, self.venvs = root / "cache/payload", root / "cache/venvs"
        self.rules: dict[str, Any] = {
            "store": str(root / "store"),
            "staging": str(self.folder),
            "python": sys.executable,
            "method": "store",
            "reserve_mb": 0,
            "confinement": "none",
            "allow_unsigned": True,
            "headroom": {"promised": asdict(Promised()), "freed_mb": 0, "freed_gpu_mb": 0},
        }
        self.brought = {"folder": str(self.drive), "digest": self._digest()}
        look.copy(self.rules | self.brought, told)
        install.install(self._kept | {"venvs": str(root / "venvs"), "headroom": None}, told)
        self.stamp = cached.fill(self._kept, told)["stamp"]

    @property
    def _kept(self) -> dict[str, Any]:
        return self.rules | {"folder": str(self.folder), "venvs": str(self.venvs)}

    def _digest(self) -> str:
        return hashlib.sha256((self.drive / "CONTENTS").read_bytes()).hexdigest()

    @property
    def back(self) -> dict[str, Any]:
        """What the job is asked once the drive is there again."""
        places = {"cached_folder": str(self.folder), "cached_venvs": str(self.venvs)}
        return self.rules | self.brought | places | {"stamp": self.stamp}

    @property
    def module(self) -> Path:
        (found,) = self.venvs.glob("lamp/lib/*/site-packages/test_lamp.py")
        return found


@pytest.fixture
def away(tmp_path: Path) -> Away:
    return Away(tmp_path)


def test_what_comes_back_is_not_read_again(away: Away) -> None:
    for wheel in (away.drive / "wheels").iterdir():
        wheel.unlink()
    restored = cached.restore(away.back, told)
    assert restored is not None
    assert restored["known"] > 0


def test_links_of_other_venvs_change_nothing(away: Away, tmp_path: Path) -> None:
    os.link(away.module, tmp_path / "of-another-venv")
    assert cached.restore(away.back, told) is not None


@pytest.mark.parametrize(
    "touch",
    [
        lambda away: away.module.write_text("changed"),
        lambda away: away.module.unlink(),
        lambda away: away.module.chmod(0o600),
        lambda away: away.module.with_name("sitecustomize.py").touch(),
        lambda away: (away.folder / "payload.toml").write_text("changed"),
        lambda away: (away.folder / "more").touch(),
    ],
    ids=["written", "deleted", "mode", "more in a venv", "manifest", "more in the payload"],
)
def test_what_was_touched_meanwhile_is_not_used(
    away: Away, touch: Callable[[Away], object]
) -> None:
    touch(away)
    assert cached.restore(away.back, told) is None


def test_venvs_are_made_of_what_the_store_has_once_it_is_hashed_again(away: Away) -> None:
    store = Store(Path(away.rules["store"]))
    stored = next(wheel for wheel in store.listing() if "lamp" in wheel.filename)
    (stored.root / "test_lamp.py").unlink()
    (stored.root / "test_lamp.py").write_text("changed")
    assert code(cached.fill, away._kept, told) == "STORE_DAMAGED"


def test_list_that_was_changed_on_the_drive_is_refused(away: Away) -> None:
    with (away.drive / "CONTENTS").open("a") as contents:
        contents.write("\n")
    assert code(cached.restore, away.back, told) == "HASH_MISMATCH"


def test_it_is_judged_by_what_is_trusted_now(away: Away) -> None:
    trust = trust_of(roots=[ALICE], roles={"maker": (["org.example"], [ALICE])})
    demanding = {"allow_unsigned": False, "trust": trust_text.to_text(trust)}
    assert code(cached.restore, away.back | demanding, told) == "SIG_MISSING"
    sign_payload(away.drive, BOB)
    assert code(cached.restore, away.back | demanding, told) == "SIG_UNTRUSTED"
    sign_payload(away.drive, ALICE)
    assert cached.restore(away.back | demanding, told) is not None
    signature = away.drive / "CONTENTS.sig"
    assert (away.folder / "CONTENTS.sig").read_bytes() == signature.read_bytes(), "kept with it"


def test_memory_that_was_promised_meanwhile_is_not_there(away: Away) -> None:
    taken = {"promised": asdict(Promised(10**9, 10**9)), "freed_mb": 0, "freed_gpu_mb": 0}
    assert code(cached.restore, away.back | {"headroom": taken}, told) == "NO_MEMORY"


# In a host.


def lamp_drive(root: Path, name: str = "lamp", **about: Any) -> Path:
    folder = root / f"drive-{name}"
    make_payload(folder, Part(name, LAMP), payload_id=f"org.example.{name}", **about)
    return folder


async def put_away(host: HostInProcess, drive: Path, payload_id: str = LAMP_ID) -> str:
    """Plug a payload in, pull it, and wait until it is cached; its key."""
    host.plug(drive)
    key = (await host.until_step(payload_id, Step.ACTIVE)).key
    host.pull()
    await host.until_gone(payload_id)
    await host.until(lambda: PayloadCached(key) in host.heard)
    return key


def copied(host: HostInProcess) -> list[int]:
    return [event.bytes_copied for event in host.heard if isinstance(event, PayloadCopied)]


@pytest.mark.anyio
async def test_payload_that_comes_back_runs_from_the_venv_that_was_made_for_it(
    tmp_path: Path,
) -> None:
    drive = lamp_drive(tmp_path)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        key = await put_away(host, drive)
        made = host.folders.cache / key / "venvs/lamp"
        inode = made.stat().st_ino
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        (component,) = host.snapshot.components
        assert component.venv.stat().st_ino == inode
        assert copied(host)[1:] == [0]
        assert not (host.folders.cache / key).exists()
        host.pull()
        await host.until_gone(LAMP_ID)
        await host.until(lambda: host.heard.count(PayloadCached(key)) == 2)
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert len([e for e in host.heard if isinstance(e, PayloadActivated)]) == 3


@pytest.mark.anyio
async def test_what_was_touched_is_installed_again(tmp_path: Path) -> None:
    drive = lamp_drive(tmp_path)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        key = await put_away(host, drive)
        (module,) = (host.folders.cache / key).glob("venvs/lamp/lib/*/site-packages/test_lamp.py")
        module.with_name("more.py").touch()
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        (component,) = host.snapshot.components
        assert not (component.site_packages / "more.py").exists()
        assert not (host.folders.cache / key).exists()


@pytest.mark.anyio
async def test_what_could_not_be_restored_stays_cached(tmp_path: Path) -> None:
    """A drive that is pulled again at once, say."""
    drive = lamp_drive(tmp_path)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        key = await put_away(host, drive)
        signature = drive / "nondum" / LAMP_ID / "CONTENTS.sig"
        signature.mkdir()
        host.plug(drive)
        await host.until(lambda: is_refused(host))
        host.pull()
        await host.until_gone(LAMP_ID)
        signature.rmdir()
        made = host.folders.cache / key / "venvs/lamp"
        inode = made.stat().st_ino
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        (component,) = host.snapshot.components
        assert component.venv.stat().st_ino == inode


def is_refused(host: HostInProcess) -> bool:
    record = host.payload(LAMP_ID)
    return record is not None and record.step is Step.REFUSED


@pytest.mark.anyio
async def test_next_daemon_begins_with_an_empty_cache(tmp_path: Path) -> None:
    async with host_in_process(tmp_path, timing=QUICK) as host:
        await put_away(host, lamp_drive(tmp_path))
    async with host_in_process(tmp_path, timing=QUICK) as host:
        assert not list(host.folders.cache.iterdir())


@pytest.mark.anyio
async def test_last_ones_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(payload_cache, "CACHED", 1)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        await put_away(host, lamp_drive(tmp_path, "first"), "org.example.first")
        last = await put_away(host, lamp_drive(tmp_path, "last"), "org.example.last")
        assert [path.name for path in host.folders.cache.iterdir()] == [last]


@pytest.mark.anyio
async def test_what_has_no_place_in_the_store_any_more_is_not_cached(tmp_path: Path) -> None:
    """Links would keep it on disk beyond the quota."""
    options = InstallOptions(allow_unsigned=True, quota_mb=0)
    async with host_in_process(tmp_path, timing=QUICK, options=options) as host:
        host.plug(lamp_drive(tmp_path))
        key = (await host.until_step(LAMP_ID, Step.ACTIVE)).key
        host.pull()
        await host.until_gone(LAMP_ID)
        cached = host.folders.cache / key
        await until_async("no longer cached", lambda: not cached.exists())
        assert not Store(host.folders.store).listing()
