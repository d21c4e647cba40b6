"""Data on a drive: `[[data]]`, `[[component.data]]`, and payloads that bring nothing else."""

from __future__ import annotations

import hashlib
import resource
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.kit.payloads import Part, make_payload, seal

from nondum.sdk.errors import InstallFailed, PayloadRefused
from nondum.wheelhouse.build import data_payload
from nondum.wheelhouse.build.verification import verify
from nondum.wheelhouse.format import contents, manifest
from nondum.wheelhouse.format.data import BroughtData, DataNeed
from nondum.wheelhouse.format.signatures import EVERYTHING, Grant, UnsignedAllowed
from nondum.wheelhouse.payload import drive, payload

HEAD = 'id = "org.example.x"\nname = "x"\n'
PLAIN = 'name = "yolo"\nkind = "onnx-detector"\nfiles = ["yolo.onnx"]\n'
COMPONENT = '[[component]]\nid = "a"\ndistribution = "dist-a"\n'


def brought(text: str) -> BroughtData:
    (found,) = manifest.parse(f"{HEAD}[[data]]\n{text}", "payload.toml").data
    return found


def need(text: str) -> DataNeed:
    said = manifest.parse(f"{HEAD}{COMPONENT}[[component.data]]\n{text}", "payload.toml")
    (found,) = said.components[0].data
    return found


def codes(text: str) -> list[str]:
    with pytest.raises(PayloadRefused) as refused:
        manifest.parse(HEAD + text, "payload.toml")
    return [problem.code for problem in refused.value.problems]


def write(drive: Path, *files: Path, **more: Any) -> Path:
    given = {"name": "yolo", "kind": "onnx-detector", **more}
    return data_payload.write(drive, "org.example.yolo", files, **given)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    (tmp_path / "from").mkdir()
    (tmp_path / "from/yolo.onnx").write_bytes(bytes(range(256)) * 5000)
    return tmp_path / "from/yolo.onnx"


def test_a_payload_may_bring_data_and_nothing_else() -> None:
    assert brought(PLAIN) == BroughtData("yolo", "onnx-detector", "1", ("yolo.onnx",))
    assert brought(PLAIN).paths == ("data/yolo/yolo.onnx",)


def test_a_component_asks_by_kind_by_name_or_by_both() -> None:
    assert need('name = "weights"\nkind = "gguf"\n') == DataNeed("weights", kind="gguf")
    both = need('name = "w"\nkind = "gguf"\ndata = "tiny"\nversion = ">=2"\noptional = true\n')
    assert both == DataNeed("w", "gguf", "tiny", ">=2", optional=True)


@pytest.mark.parametrize(
    ("asked", "is_met"),
    [
        (DataNeed("w", kind="gguf"), True),
        (DataNeed("w", kind="onnx"), False),
        (DataNeed("w", data="tiny"), True),
        (DataNeed("w", data="large"), False),
        (DataNeed("w", kind="gguf", data="large"), False),
        (DataNeed("w", kind="gguf", version=">=1.2,<2"), True),
        (DataNeed("w", kind="gguf", version=">=2"), False),
    ],
)
def test_data_meet_a_need_by_all_that_it_says(asked: DataNeed, *, is_met: bool) -> None:
    assert asked.is_met_by("gguf", "tiny", "1.2") is is_met


WRONG = {
    "no-name": (f"[[data]]\n{PLAIN.replace('name', '#')}", ["MANIFEST_KEY"]),
    "no-kind": (f"[[data]]\n{PLAIN.replace('kind', '#')}", ["MANIFEST_KEY"]),
    "bad-name": (f"[[data]]\n{PLAIN.replace('yolo', 'Yo lo', 1)}", ["MANIFEST_VALUE"]),
    "no-files": ("[[data]]\nname = 'a'\nkind = 'b'\nfiles = []\n", ["MANIFEST_VALUE"]),
    "path-up": (f"[[data]]\n{PLAIN.replace('yolo.onnx', '../a')}", ["MANIFEST_VALUE"]),
    "path-absolute": (f"[[data]]\n{PLAIN.replace('yolo.onnx', '/a')}", ["MANIFEST_VALUE"]),
    "file-twice": (
        "[[data]]\nname = 'a'\nkind = 'b'\nfiles = ['c', 'c']\n",
        ["MANIFEST_VALUE"],
    ),
    "version": (f"[[data]]\n{PLAIN}version = 'new'\n", ["MANIFEST_VALUE"]),
    "unknown-key": (f"[[data]]\n{PLAIN}size = 3\n", ["MANIFEST_KEY"]),
    "name-twice": (f"[[data]]\n{PLAIN}[[data]]\n{PLAIN}", ["MANIFEST_TWICE"]),
    "neither-kind-nor-data": (
        f"{COMPONENT}[[component.data]]\nname = 'w'\n",
        ["MANIFEST_VALUE"],
    ),
    "need-version": (
        f"{COMPONENT}[[component.data]]\nname = 'w'\nkind = 'k'\nversion = 'new'\n",
        ["MANIFEST_VALUE"],
    ),
    "need-twice": (
        COMPONENT + "[[component.data]]\nname = 'w'\nkind = 'k'\n" * 2,
        ["MANIFEST_TWICE"],
    ),
}


@pytest.mark.parametrize(("text", "told"), WRONG.values(), ids=WRONG)
def test_wrong_data_are_refused(text: str, told: list[str]) -> None:
    assert codes(text) == told


def test_data_take_a_permission_of_their_own() -> None:
    said = manifest.parse(f"{HEAD}[[data]]\n{PLAIN}", "payload.toml")
    assert EVERYTHING.problems(said) == ()
    (problem,) = Grant(("gpu",)).problems(said)
    assert (problem.code, problem.need, problem.where) == ("PERMISSION_DENIED", "data", "data yolo")


def test_a_file_becomes_a_payload_that_hosts_take(tmp_path: Path, model: Path) -> None:
    folder = write(tmp_path / "drive", model, version="1.2", release=3)
    assert verify(folder, UnsignedAllowed()).problems == ()
    assert drive.find_payloads(tmp_path / "drive") == (folder,)
    staged = payload.load(folder, contents.parse(drive.read_contents(folder), "CONTENTS"))
    assert staged.manifest.data == (BroughtData("yolo", "onnx-detector", "1.2", ("yolo.onnx",)),)
    (listed,) = (e for e in staged.contents.entries if not payload.is_metadata(e.path))
    assert listed.sha256 == hashlib.sha256(model.read_bytes()).hexdigest()
    assert (folder / listed.path).read_bytes() == model.read_bytes()
    assert not (folder / listed.path).is_symlink()


def test_a_folder_brings_all_that_is_in_it(tmp_path: Path, model: Path) -> None:
    (model.parent / "labels").mkdir()
    (model.parent / "labels/coco.txt").write_text("person\n")
    folder = write(tmp_path / "drive", model.parent)
    said = manifest.parse((folder / "payload.toml").read_text(), "payload.toml")
    assert said.data[0].files == ("labels/coco.txt", "yolo.onnx")
    assert verify(folder, UnsignedAllowed()).problems == ()


def test_its_progress_ends_with_all_bytes(tmp_path: Path, model: Path) -> None:
    told: list[tuple[str, int, int]] = []
    folder = write(tmp_path / "drive", model, progress=lambda *step: told.append(step))
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    assert told[-1][1:] == (size, size)
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)


def test_files_of_one_name_are_told(tmp_path: Path, model: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other/yolo.onnx").write_bytes(b"x")
    with pytest.raises(PayloadRefused) as refused:
        write(tmp_path / "drive", model, tmp_path / "other/yolo.onnx")
    assert [p.code for p in refused.value.problems] == ["MANIFEST_TWICE"]
    assert not (tmp_path / "drive").exists()


@pytest.mark.parametrize("name", ["Yolo v8.onnx", "größe.bin"])
def test_names_that_no_payload_can_have_are_told(tmp_path: Path, model: Path, name: str) -> None:
    odd = model.rename(model.with_name(name))
    with pytest.raises(PayloadRefused) as refused:
        write(tmp_path / "drive", odd)
    assert [p.code for p in refused.value.problems] == ["PATH_UNSAFE"]


@pytest.fixture
def small_files_only() -> Iterator[None]:
    """As on FAT, where a file has a greatest size (RLIMIT_FSIZE, setrlimit(2))."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000 * 1000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_drive_that_cannot_take_it_is_told_and_keeps_what_it_had(
    tmp_path: Path, model: Path, request: pytest.FixtureRequest
) -> None:
    folder = write(tmp_path / "drive", model, release=1)
    before = (folder / "CONTENTS").read_bytes()
    request.getfixturevalue("small_files_only")
    with pytest.raises(InstallFailed) as failed:
        write(tmp_path / "drive", model, release=2)
    (problem,) = failed.value.problems
    assert (problem.code, "exFAT" in problem.fix) == ("IO_ERROR", True)
    assert (folder / "CONTENTS").read_bytes() == before
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_data_that_are_not_as_listed_are_told_and_copied_nowhere(
    tmp_path: Path, model: Path
) -> None:
    folder = write(tmp_path / "drive", model)
    (folder / "data/yolo/yolo.onnx").write_bytes(bytes(1280000))
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    with pytest.raises(PayloadRefused) as refused:
        drive.check(folder, listed)
    assert [p.code for p in refused.value.problems] == ["HASH_MISMATCH"]
    assert [p.code for p in verify(folder, UnsignedAllowed()).problems] == ["HASH_MISMATCH"]


def test_listed_data_that_the_manifest_does_not_name_are_refused(tmp_path: Path) -> None:
    folder = make_payload(tmp_path / "drive", Part("blinker", "X = 1\n", with_sdk=False))
    (folder / "data/more").mkdir(parents=True)
    (folder / "data/more/a").write_bytes(b"a")
    seal(folder, payload_id="org.example.test")
    assert [p.code for p in verify(folder, UnsignedAllowed()).problems] == ["MANIFEST_VALUE"]


def test_data_that_are_not_listed_are_refused(tmp_path: Path, model: Path) -> None:
    folder = write(tmp_path / "drive", model)
    (folder / "data/yolo/yolo.onnx").unlink()
    seal(folder, payload_id="org.example.yolo")
    assert [p.code for p in verify(folder, UnsignedAllowed()).problems] == ["FILE_MISSING"]
