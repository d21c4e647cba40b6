"""What a child process refuses of a drive, step by step, before anything of it is installed."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Any

import pytest
from tests.kit.lamp_drive import PAYLOAD, code, lamp, told
from tests.kit.payloads import seal
from tests.kit.signing import Key, sign_payload, trust_of
from tests.wheelhouse.hostile_wheels import WheelBuilder

from nondum.host.jobs import look
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.build import data_payload
from nondum.wheelhouse.format.signatures import UnsignedAllowed, Verdict
from nondum.wheelhouse.payload import payload
from nondum.wheelhouse.payload.memory import Promised
from nondum.wheelhouse.trust import trust_text

ALICE = Key("alice")
HEADROOM = {"promised": asdict(Promised()), "freed_mb": 0, "freed_gpu_mb": 0}


def rules(tmp_path: Path) -> dict[str, Any]:
    return {
        "store": str(tmp_path / "store"),
        "staging": str(tmp_path / "staging"),
        "confinement": "none",
        "method": "store",
        "reserve_mb": 0,
        "allow_unsigned": True,
        "headroom": HEADROOM,
    }


def copy(folder: Path, tmp_path: Path, **more: Any) -> dict[str, int]:
    digest = hashlib.sha256((folder / "CONTENTS").read_bytes()).hexdigest()
    given = {**rules(tmp_path), "folder": str(folder), "digest": digest}
    return look.copy(given | more, told)


def found_on(drive: Path, **more: Any) -> list[str]:
    """Codes of the problems of the one payload on a drive."""
    given = {"root": str(drive), "node": None, "kind": "slot", "allow_unsigned": True}
    (one,) = look.look(given | more, told)["payloads"]
    return [problem["code"] for problem in one["problems"]]


def resealed(folder: Path, change: Callable[[Path], object]) -> Path:
    change(folder)
    seal(folder, payload_id=PAYLOAD)
    return folder


def test_plain_payload_is_found_copied_and_verified(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    assert found_on(tmp_path / "drive") == []
    assert copy(folder, tmp_path)["copied"] > 0
    assert look.verify(rules(tmp_path), told).keys() == {"lamp"}


def test_payload_for_a_newer_nondum_is_told_as_it_is_found(tmp_path: Path) -> None:
    contents = lamp(tmp_path / "drive") / "CONTENTS"
    said = contents.read_text()
    contents.write_text(said.replace("minimum-nondum: 0.1", "minimum-nondum: 99"))
    assert found_on(tmp_path / "drive") == ["NONDUM_VERSION"]


def test_payload_that_breaks_its_reader_takes_no_other_along(tmp_path: Path) -> None:
    class Breaking(UnsignedAllowed):
        def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
            if contents == b"breaks it":
                raise RuntimeError("unforeseen")
            return super().verify(contents, signature)

    good = lamp(tmp_path / "drive")
    bad = good.with_name("org.example.alarm")
    bad.mkdir()
    (bad / "CONTENTS").write_bytes(b"breaks it")
    found = look.found([bad, good], Breaking())
    codes = [[problem["code"] for problem in one["problems"]] for one in found]
    assert codes == [["INTERNAL"], []]
    assert [one["payload_id"] for one in found] == ["org.example.alarm", PAYLOAD]


def test_version_without_end_takes_no_other_payload_of_the_drive_along(tmp_path: Path) -> None:
    good = lamp(tmp_path / "drive")
    listed = (good / "CONTENTS").read_text()
    bad = good.with_name("org.example.alarm")
    bad.mkdir()
    (bad / "CONTENTS").write_text(listed.replace("version: 1.0", f"version: {'9' * 5_000}"))
    given = {"root": str(tmp_path / "drive"), "node": None, "kind": "slot", "allow_unsigned": True}
    found = look.look(given, told)["payloads"]
    codes = [[problem["code"] for problem in one["problems"]] for one in found]
    assert codes == [["CONTENTS_HEADER"], []]


def test_unsigned_payload_is_neither_parsed_nor_copied(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    (folder / "CONTENTS").write_bytes(b"nondum-payload 1\n\xff")
    assert found_on(tmp_path / "drive", allow_unsigned=False) == ["SIG_MISSING"]
    assert found_on(tmp_path / "drive") == ["CONTENTS_ENCODING"]
    assert code(copy, folder, tmp_path, allow_unsigned=False) == "SIG_MISSING"
    assert not (tmp_path / "staging").exists()


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        pytest.param(Random(1).randbytes(2_000), "CONTENTS_ENCODING", id="random bytes"),
        pytest.param(b"all my photographs\n", "SCHEMA_VERSION", id="another text"),
        pytest.param(b"", "SCHEMA_VERSION", id="empty"),
    ],
)
def test_what_is_no_list_is_told_beside_the_missing_signature(
    tmp_path: Path, data: bytes, expected: str
) -> None:
    """Signing it would not help; to sign it is all that the other problem advises."""
    folder = lamp(tmp_path / "drive")
    (folder / "CONTENTS").write_bytes(data)
    assert found_on(tmp_path / "drive", allow_unsigned=False) == ["SIG_MISSING", expected]
    assert found_on(tmp_path / "drive") == [expected]
    (folder / "CONTENTS.sig").write_text("signed")
    signed = found_on(tmp_path / "drive", allow_unsigned=False)
    assert signed == ["SIG_MALFORMED"], "what came with signatures is judged by these alone"


def test_words_of_an_unsigned_drive_are_not_told(tmp_path: Path) -> None:
    (lamp(tmp_path / "drive") / "CONTENTS").write_bytes(b"run away, says the robot\n")
    given = {"root": str(tmp_path / "drive"), "node": None, "kind": "slot"}
    found = look.look(given | {"allow_unsigned": False}, told)["payloads"]
    assert len(found[0]["problems"]) == 2
    assert "run away" not in str(found)


def test_list_that_is_another_by_now_is_refused(tmp_path: Path) -> None:
    assert code(copy, lamp(tmp_path / "drive"), tmp_path, digest="0" * 64) == "HASH_MISMATCH"


def test_more_than_is_read_to_judge_is_not_copied(tmp_path: Path) -> None:
    def grow(folder: Path) -> None:
        with (folder / "leaflet.txt").open("wb") as leaflet:
            leaflet.truncate(payload.MAX_METADATA)

    folder = resealed(lamp(tmp_path / "drive"), grow)
    assert code(copy, folder, tmp_path) == "TOO_LARGE"
    assert not (tmp_path / "staging").exists()


def test_metadata_that_is_endless_to_read_is_read_in_a_copy_first(tmp_path: Path) -> None:
    def bomb(folder: Path) -> None:
        (folder / "pylock.lamp.toml").write_text("a" + ".a" * 120_000 + " = 1")

    assert code(copy, resealed(lamp(tmp_path / "drive"), bomb), tmp_path) == "METADATA_LIMIT"


def test_what_its_signer_may_not_grant_is_refused(tmp_path: Path) -> None:
    def ask(folder: Path) -> None:
        manifest = folder / "payload.toml"
        text = manifest.read_text()
        assert "distribution" in text
        manifest.write_text(
            text.replace("distribution", 'permissions = ["network"]\ndistribution', 1)
        )

    folder = resealed(lamp(tmp_path / "drive"), ask)
    sign_payload(folder, ALICE)
    trust = trust_of(roots=[ALICE], roles={"maker": (["org.example"], [ALICE])})
    text = trust_text.to_text(trust)
    assert code(copy, folder, tmp_path, trust=text) == "PERMISSION_DENIED"


def test_what_does_not_fit_this_host_is_refused_before_wheels_are_copied(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive", requires='python = ">=3.99"')
    assert code(copy, folder, tmp_path) == "PYTHON_VERSION"
    assert not (tmp_path / "staging/wheels").exists()


def model(drive: Path, size: int) -> Path:
    """A drive with data of a size, of which the disk has nothing: they are all zeros."""
    drive.mkdir(parents=True, exist_ok=True)
    (drive / "weights.gguf").touch()
    brought = [drive / "weights.gguf"]
    folder = data_payload.write(drive, PAYLOAD, brought, name="weights", kind="gguf")
    os.truncate(folder / "data/weights/weights.gguf", size)
    contents = (folder / "CONTENTS").read_text()
    path = "  data/weights/weights.gguf\n"
    (folder / "CONTENTS").write_text(contents.replace(f"  0{path}", f"  {size}{path}"))
    return folder


def test_data_that_do_not_fit_the_disk_are_refused_before_they_are_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = model(tmp_path / "drive", 5 * 1024**3)
    real = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: real._replace(free=5119 * 2**20))
    with pytest.raises(PayloadRefused) as refused:
        copy(folder, tmp_path)
    (problem,) = refused.value.problems
    assert (problem.code, problem.need, problem.have) == ("DISK_FULL", "5120 MB", "5119 MB")
    assert not (tmp_path / "staging/data").exists()


def test_data_are_copied_as_they_are_listed_or_not_at_all(tmp_path: Path) -> None:
    assert code(copy, model(tmp_path / "drive", 1000), tmp_path) == "HASH_MISMATCH"


def test_devices_that_the_manifest_does_not_ask_for_are_refused(tmp_path: Path) -> None:
    copy(lamp(tmp_path / "drive"), tmp_path)
    file = tmp_path / "staging/index.json"
    said = json.loads(file.read_text())
    said["components"]["lamp"]["devices"] = [{"name": "port", "match": {"usb": "*:*"}}]
    file.write_text(json.dumps(said))
    assert code(look.verify, rules(tmp_path), told) == "DEVICE_RULES"


def test_hostile_wheel_is_refused_where_it_was_copied(tmp_path: Path) -> None:
    copy(lamp(tmp_path / "drive"), tmp_path)
    (wheel,) = (tmp_path / "staging/wheels").glob("test_lamp*")
    wheel.write_bytes(WheelBuilder(suffix=b"x").bytes())
    assert code(look.verify, rules(tmp_path), told) == "WHEEL_STRUCTURE"
