"""What is copied for another host, and how what another host offers is judged."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from tests.kit.lamp_drive import PAYLOAD, code, lamp, told
from tests.kit.payloads import seal

from nondum.host.jobs import parcel
from nondum.wheelhouse.payload import payload
from nondum.wheelhouse.payload.memory import Promised
from nondum.wheelhouse.store.store import Store


def hand_over(folder: Path, target: Path, **more: Any) -> dict[str, Any]:
    contents = (folder / "CONTENTS").read_bytes()
    arguments = {
        "root": str(folder.parents[1]),
        "node": None,
        "folder": f"nondum/{PAYLOAD}",
        "digest": hashlib.sha256(contents).hexdigest(),
        "target": str(target),
        "wanted": None,
        "reserve_mb": 0,
    }
    return parcel.hand_over(arguments | more, told)


def judge(folder: Path, state: Path, **more: Any) -> dict[str, Any]:
    rules = {"confinement": "none", "method": "store", "reserve_mb": 0, "allow_unsigned": True}
    headroom = {"promised": asdict(Promised()), "freed_mb": 0, "freed_gpu_mb": 0}
    given = {"folder": str(folder), "store": str(state / "store"), "headroom": headroom, **rules}
    return parcel.judge(given | more, told)


def files(folder: Path) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


def test_what_it_is_judged_by_comes_first(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    (folder / "CONTENTS.sig").write_bytes(b"signed")
    copied = hand_over(folder, tmp_path / "out")
    metadata = {"payload.toml", "index.json", "pylock.lamp.toml"}
    assert files(tmp_path / "out") == {"CONTENTS", "CONTENTS.sig", *metadata}
    assert {path for _, path in copied["files"]} == metadata
    assert copied["contents"] == (folder / "CONTENTS").stat().st_size


def test_only_what_is_wanted_is_copied(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    wheel = next((folder / "wheels").glob("test_lamp*"))
    sha256 = hashlib.sha256(wheel.read_bytes()).hexdigest()
    for _ in range(2):  # what a former attempt left is no hindrance
        copied = hand_over(folder, tmp_path / "out", wanted=[sha256, "0" * 64])
    assert copied["files"] == [[sha256, f"wheels/{wheel.name}"]]
    assert files(tmp_path / "out") == {f"wheels/{wheel.name}"}


def test_disk_that_is_to_stay_free_stays_free(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    whole_mb = shutil.disk_usage(tmp_path).total // 2**20
    assert code(hand_over, folder, tmp_path / "out", reserve_mb=whole_mb) == "DISK_FULL"
    assert files(tmp_path / "out") == set()


def test_drive_that_is_another_one_now_is_refused(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    assert code(hand_over, folder, tmp_path / "out", digest="0" * 64) == "HASH_MISMATCH"


def test_file_that_changed_on_the_drive_is_refused(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    with (folder / "index.json").open("ab") as index:
        index.write(b" ")
    assert code(hand_over, folder, tmp_path / "out") == "HASH_MISMATCH"


def test_drive_that_is_gone_is_told(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    root = str(tmp_path / "other")
    assert code(hand_over, folder, tmp_path / "out", root=root) == "DRIVE_GONE"


def test_metadata_is_enough_to_judge_by(tmp_path: Path) -> None:
    folder, out = lamp(tmp_path / "drive"), tmp_path / "out" / PAYLOAD
    hand_over(folder, out)
    listed = parcel.outline({"folder": str(out)}, told)
    assert {path for path, _, _ in listed} == files(out) - {"CONTENTS"}
    judged = judge(out, tmp_path)
    assert {path for path, _, _ in judged["needed"]} == files(folder) - files(out)


@pytest.mark.parametrize(
    ("requires", "refusal"),
    [
        ('python = ">=3.99"', "PYTHON_VERSION"),
        ("memory_mb = 900000000", "NO_MEMORY"),
        ("disk_mb = 900000000", "DISK_FULL"),
        ("confinement = 1", "CONFINEMENT"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, requires: str, refusal: str) -> None:
    assert code(judge, lamp(tmp_path / "drive", requires=requires), tmp_path) == refusal


def test_memory_that_is_promised_to_other_payloads_is_not_available(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive", requires="memory_mb = 1")
    promised = asdict(Promised(10**9, 10**9, holders=("org.example.other",)))
    headroom = {"promised": promised, "freed_mb": 0, "freed_gpu_mb": 0}
    assert judge(folder, tmp_path)
    assert code(judge, folder, tmp_path, headroom=headroom) == "NO_MEMORY"


def test_more_than_is_read_to_judge_is_refused(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    with (folder / "leaflet.txt").open("wb") as leaflet:
        leaflet.truncate(payload.MAX_METADATA)
    seal(folder, payload_id=PAYLOAD)
    assert code(parcel.outline, {"folder": str(folder)}, told) == "TOO_LARGE"


def test_metadata_that_is_endless_to_read_is_read_in_a_copy_first(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    (folder / "pylock.lamp.toml").write_text("a" + ".a" * 120_000 + " = 1")
    seal(folder, payload_id=PAYLOAD)
    assert code(judge, folder, tmp_path) == "METADATA_LIMIT"


def test_payload_for_a_newer_nondum_is_not_fetched(tmp_path: Path) -> None:
    contents = lamp(tmp_path / "drive") / "CONTENTS"
    said = contents.read_text()
    contents.write_text(said.replace("minimum-nondum: 0.1", "minimum-nondum: 99"))
    assert code(judge, contents.parent, tmp_path) == "NONDUM_VERSION"


def test_fetched_files_need_disk_space_beside_what_is_made_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = lamp(tmp_path / "drive", requires="disk_mb = 100")
    (wheel,) = (folder / "wheels").glob("test_lamp*")
    listed = (folder / "CONTENTS").read_text()
    entry = next(line for line in listed.splitlines() if line.endswith(wheel.name))
    size = entry.split("  ")[1]
    lock = (folder / "pylock.lamp.toml").read_text()
    (folder / "pylock.lamp.toml").write_text(lock.replace(f"size = {size}", "size = 9000000"))
    seal(folder, payload_id=PAYLOAD)
    listed = (folder / "CONTENTS").read_text()
    (folder / "CONTENTS").write_text(listed.replace(f"  {size}  ", "  9000000  "))
    real = shutil.disk_usage(tmp_path)
    for free_mb, refusal in ((99, "DISK_FULL"), (107, "DISK_FULL"), (115, "")):
        disk = real._replace(free=free_mb * 2**20)
        monkeypatch.setattr(shutil, "disk_usage", lambda _, disk=disk: disk)
        if refusal:
            assert code(judge, folder, tmp_path) == refusal
        else:
            assert judge(folder, tmp_path)["needed"]


@pytest.mark.parametrize(("method", "refused"), [("store", False), ("pip", True)])
def test_wheels_that_are_stored_take_no_disk_but_with_pip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, *, refused: bool
) -> None:
    folder = lamp(tmp_path / "drive")
    (wheel,) = (folder / "wheels").glob("test_lamp*")
    lock = folder / "pylock.lamp.toml"
    said = f'[packages.tool.nondum.unpacked]\n"{wheel.name}" = {200 * 2**20}\n'
    before, after = lock.read_text().split(f'[[packages.wheels]]\nname = "{wheel.name}"')
    lock.write_text(f'{before}{said}[[packages.wheels]]\nname = "{wheel.name}"{after}')
    seal(folder, payload_id=PAYLOAD)
    real = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: real._replace(free=100 * 2**20))
    assert code(judge, folder, tmp_path, method=method) == "DISK_FULL"
    store = Store(tmp_path / "store")
    for path in (folder / "wheels").iterdir():
        store.add(path, hashlib.sha256(path.read_bytes()).hexdigest())
    if refused:
        assert code(judge, folder, tmp_path, method=method) == "DISK_FULL"
    else:
        assert judge(folder, tmp_path, method=method)["needed"] == []
