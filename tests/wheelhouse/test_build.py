"""Building: from a source folder to a payload that a host takes, offline, by real pip."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from tests.kit.payloads import installed_wheel, make_wheel, sdk_wheel
from tests.wheelhouse.hostile_wheels import WheelBuilder
from tests.wheelhouse.locks import host
from tests.wheelhouse.sources import PLUGIN, make_source

from nondum.sdk import codes
from nondum.sdk.errors import (
    ConfigRefused,
    InstallFailed,
    NondumError,
    PayloadRefused,
    Problem,
)
from nondum.wheelhouse.build import build
from nondum.wheelhouse.build.cost import Cost, costs
from nondum.wheelhouse.build.library_wheels import library_wheel
from nondum.wheelhouse.build.resolve import ADD_IT, Sources
from nondum.wheelhouse.build.verification import verify
from nondum.wheelhouse.format import contents, index, lock
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.format.target import Target, targets
from nondum.wheelhouse.payload import drive, host_facts, payload
from nondum.wheelhouse.store.store import Store

HERE = Target.here()
OTHER = Target("aarch64" if HERE.architecture != "aarch64" else "x86_64", HERE.python)


@pytest.fixture
def wheels(tmp_path: Path) -> Path:
    """A wheel folder with the SDK and what it depends on; msgpack's own build is for here only."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    for wheel in (sdk_wheel(), installed_wheel("pluggy")):
        (folder / wheel.name).write_bytes(wheel.read_bytes())
    make_wheel(folder, "msgpack", "1.2.0", {"msgpack/__init__.py": ""})
    return folder


DEVICES = """
@hookimpl
def devices():
    return (DeviceNeed("lamp", {"usb": "1a86:7523"}),)
"""

Build = Callable[..., Path]


@pytest.fixture
def built(tmp_path: Path, wheels: Path) -> Build:
    def build_it(source: Path, *on: Target, release: int | None = 1) -> Path:
        options = build.Options(
            targets=on or (HERE,), sources=Sources((wheels,), offline=True), release=release
        )
        return build.build(source, tmp_path / "drive", options, lambda *step: None)

    return build_it


def refused(act: Callable[[], object], kind: type[NondumError]) -> list[str]:
    with pytest.raises(kind) as found:
        act()
    return [problem.code for problem in found.value.problems]


def test_a_source_becomes_a_payload_that_hosts_take(built: Build, tmp_path: Path) -> None:
    folder = built(make_source(tmp_path / "src"))
    facts = host_facts.probe(tmp_path, reserve_mb=0, confinement=Level.NONE)
    assert verify(folder, UnsignedAllowed(), facts).problems == ()
    assert drive.find_payloads(tmp_path / "drive") == (folder,)
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    assert (listed.payload_id, listed.version, listed.release) == ("org.example.blinker", "1.0", 1)
    said = index.parse((folder / "index.json").read_bytes(), "index.json")["blinker"]
    assert (said.name, said.version, said.behaviours[0].name) == ("blinker", "1.0", "shine")


def test_a_source_is_found_from_beside_it(
    built: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_source(tmp_path / "src")
    monkeypatch.chdir(tmp_path)
    assert built(Path("src")).is_relative_to(tmp_path / "drive")


def test_the_lock_names_every_wheel_on_the_drive(built: Build, tmp_path: Path) -> None:
    folder = built(make_source(tmp_path / "src"))
    parsed = lock.parse((folder / "pylock.blinker.toml").read_text(), "lock")
    assert parsed.packages == {"blinker", "msgpack", "nondum-sdk", "pluggy"}
    assert {w.filename for w in parsed.wheels} == {p.name for p in (folder / "wheels").iterdir()}


def test_the_lock_says_what_is_installed_from_each_wheel(built: Build, tmp_path: Path) -> None:
    folder = built(make_source(tmp_path / "src"))
    parsed = lock.parse((folder / "pylock.blinker.toml").read_text(), "lock")
    store = Store(tmp_path / "store")
    stored = [store.add(folder / w.path, w.sha256) for w in parsed.wheels]
    assert [w.unpacked for w in parsed.wheels] == [s.size for s in stored]
    assert all(w.unpacked > 0 for w in parsed.wheels)


def test_each_architecture_and_python_gets_its_wheels(
    built: Build, tmp_path: Path, wheels: Path
) -> None:
    for minor in (11, 12):
        for machine in ("x86_64", "aarch64"):
            tag = f"cp3{minor}-cp3{minor}-manylinux_2_28_{machine}"
            make_wheel(wheels, "native", f"1.{minor}", {"native.py": tag}, tag=tag)
    source = make_source(tmp_path / "src", requires=["nondum-sdk", "native"])
    folder = built(source, *targets(("x86_64", "aarch64"), ("3.11", "3.12")))
    parsed = lock.parse((folder / "pylock.blinker.toml").read_text(), "lock")
    for minor in (11, 12):
        for machine in ("x86_64", "aarch64"):
            chosen = lock.select(parsed, *host((3, minor), machine))
            assert {w.filename for w in chosen} >= {
                f"native-1.{minor}-cp3{minor}-cp3{minor}-manylinux_2_28_{machine}.whl"
            }
            assert len(chosen) == 5


def test_a_wheel_that_several_targets_take_is_carried_once(
    built: Build, tmp_path: Path, wheels: Path
) -> None:
    """Pure wheels, and those for the stable interface of several Pythons."""
    old, new, x86_old, x86_new = targets(("aarch64", "x86_64"), ("3.11", "3.12"))
    kinds = {"cp311-cp311": "aarch64", "cp312-cp312": "aarch64", "cp311-abi3": "x86_64"}
    native = {
        abi: make_wheel(
            wheels,
            "native",
            "1.0",
            {"native.py": abi, "more.py": "" if abi != "cp312-cp312" else str(range(100))},
            tag=f"{abi}-manylinux_2_28_{machine}",
        )
        for abi, machine in kinds.items()
    }
    source = make_source(tmp_path / "src", requires=["nondum-sdk", "native"])
    folder = built(source, x86_old, old, x86_new, new)
    sizes = {path.name: path.stat().st_size for path in (folder / "wheels").iterdir()}
    assert len(sizes) == len({"blinker", "msgpack", "nondum-sdk", "pluggy"}) + len(native)
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    staged = payload.load(folder, listed)
    size = {abi: wheel.stat().st_size for abi, wheel in native.items()}
    pure = sum(sizes.values()) - sum(size.values())
    assert costs(staged, (x86_old, old, x86_new, new)) == (
        Cost(new, pure + size["cp312-cp312"], size["cp312-cp312"]),
        Cost(old, pure + size["cp311-cp311"], size["cp311-cp311"]),
        Cost(x86_old, pure + size["cp311-abi3"], 0),
        Cost(x86_new, pure + size["cp311-abi3"], 0),
    )


def test_two_components_of_one_distribution_share_its_wheels(built: Build, tmp_path: Path) -> None:
    source = make_source(
        tmp_path / "src", components=["left", "right"], entry_points={"only": "plugin_blinker"}
    )
    folder = built(source)
    assert {p.name for p in folder.glob("pylock.*")} == {"pylock.left.toml", "pylock.right.toml"}
    assert set(index.parse((folder / "index.json").read_bytes(), "i")) == {"left", "right"}
    assert verify(folder, UnsignedAllowed()).problems == ()


def test_a_payload_is_replaced_whole(built: Build, tmp_path: Path) -> None:
    source = make_source(tmp_path / "src")
    folder = built(source)
    (folder / "left-over").write_text("x")
    assert built(source, release=2) == folder
    assert not (folder / "left-over").exists()
    assert contents.parse(drive.read_contents(folder), "C").release == 2


def test_the_same_sources_give_the_same_bytes(
    built: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    source = make_source(tmp_path / "src")
    first = drive.read_contents(built(source, release=None))
    assert drive.read_contents(built(source, release=None)) == first
    assert b"release: 1700000000\n" in first
    assert b"built: 2023-11-14T22:13:20Z\n" in first


WRONG_PLUGINS = {
    "fails-to-import": ("IMPORT_FAILED", "import nothing_like_this\n"),
    "syntax": ("IMPORT_FAILED", "def (:\n"),
    "raises-in-hook": (
        "HOOK_FAILED",
        "from nondum.sdk import hookimpl\n@hookimpl\ndef units():\n    raise ValueError('x')\n",
    ),
    "exits": ("DESCRIBE_FAILED", "import os\nos._exit(3)\n"),
    "exits-politely": ("DESCRIBE_FAILED", "raise SystemExit(0)\n"),
}


@pytest.mark.parametrize(("code", "text"), WRONG_PLUGINS.values(), ids=WRONG_PLUGINS)
def test_a_plugin_that_cannot_describe_itself_is_refused(
    built: Build, tmp_path: Path, code: str, text: str
) -> None:
    source = make_source(tmp_path / "src", files={"plugin_blinker.py": text})
    assert refused(lambda: built(source), PayloadRefused) == [code]
    assert not (tmp_path / "drive").exists()


def test_what_hosts_would_not_plan_with_is_refused_and_not_delivered(
    wheels: Path, tmp_path: Path
) -> None:
    wrong = Problem("PDDL_UNKNOWN", "it is not declared")
    options = build.Options(
        (HERE,), Sources((wheels,), offline=True), judge=lambda index: (wrong,) if index else ()
    )
    source = make_source(tmp_path / "src")
    made = partial(build.build, source, tmp_path / "drive", options, lambda *step: None)
    assert refused(made, PayloadRefused) == ["PDDL_UNKNOWN"]
    assert not (tmp_path / "drive").exists()


def test_devices_that_only_the_plugin_asks_for_are_refused(built: Build, tmp_path: Path) -> None:
    text = PLUGIN.replace("import Context,", "import Context, DeviceNeed,") + DEVICES
    source = make_source(tmp_path / "src", files={"plugin_blinker.py": text})
    assert refused(lambda: built(source), PayloadRefused) == ["DEVICE_RULES"]


def test_what_a_plugin_prints_does_no_harm(built: Build, tmp_path: Path) -> None:
    noise = "import atexit\nprint('{}')\natexit.register(print, 'bye')\n"
    built(make_source(tmp_path / "src", files={"plugin_blinker.py": PLUGIN + noise}))


@pytest.mark.parametrize("points", [{}, {"a": "plugin_blinker", "b": "plugin_blinker"}])
def test_a_missing_entry_point_is_told(
    built: Build, tmp_path: Path, points: dict[str, str]
) -> None:
    source = make_source(tmp_path / "src", entry_points=points)
    assert refused(lambda: built(source), PayloadRefused) == ["ENTRY_POINT"]


@pytest.mark.parametrize("name", ["payload.toml", "pyproject.toml"])
def test_an_incomplete_source_is_told(built: Build, tmp_path: Path, name: str) -> None:
    source = make_source(tmp_path / "src")
    (source / name).unlink()
    assert refused(lambda: built(source), PayloadRefused) == ["SOURCE_INCOMPLETE"]


@pytest.mark.parametrize("text", ["[project\n", "project = 3\n"], ids=["toml", "value"])
def test_a_wrong_pyproject_is_told(built: Build, tmp_path: Path, text: str) -> None:
    source = make_source(tmp_path / "src")
    (source / "pyproject.toml").write_text(text)
    assert refused(lambda: built(source), InstallFailed) == ["BUILD_FAILED"]


def test_a_manifest_in_another_encoding_is_told(built: Build, tmp_path: Path) -> None:
    source = make_source(tmp_path / "src")
    (source / "payload.toml").write_bytes(b"name = '\xff'")
    assert refused(lambda: built(source), PayloadRefused) == ["NOT_UTF8"]


def test_a_wrong_manifest_is_told(built: Build, tmp_path: Path) -> None:
    source = make_source(tmp_path / "src")
    (source / "payload.toml").write_text("id = 3\n")
    assert set(refused(lambda: built(source), PayloadRefused)) == {"MANIFEST_VALUE", "MANIFEST_KEY"}


def test_a_package_that_does_not_build_is_told(built: Build, tmp_path: Path) -> None:
    source = make_source(tmp_path / "src", fail="no compiler here")
    with pytest.raises(InstallFailed) as failed:
        built(source)
    (problem,) = failed.value.problems
    assert (problem.code, problem.fix) == ("BUILD_FAILED", codes.remedy("BUILD_FAILED"))


def test_every_target_without_a_wheel_is_told(built: Build, tmp_path: Path, wheels: Path) -> None:
    tag = f"cp{HERE.python.replace('.', '')}-none-manylinux_2_28_{HERE.architecture}"
    make_wheel(wheels, "native", "1.0", {"native.py": ""}, tag=tag)
    source = make_source(tmp_path / "src", requires=["nondum-sdk", "native"])
    built(source, HERE)
    others = targets((OTHER.architecture,), ("3.12", "3.13"))
    with pytest.raises(InstallFailed) as failed:
        built(source, HERE, *others)
    assert [(p.code, p.fix) for p in failed.value.problems] == [("WHEEL_MISSING", ADD_IT)] * 2
    assert all("native" in p.message for p in failed.value.problems)
    assert [OTHER.architecture in p.where for p in failed.value.problems] == [True, True]


def test_a_hostile_dependency_is_refused(built: Build, tmp_path: Path, wheels: Path) -> None:
    WheelBuilder(files={"evil/__init__.py": b"", "evil.pth": b"import os"}).write(wheels)
    source = make_source(tmp_path / "src", requires=["nondum-sdk", "evil"])
    assert refused(lambda: built(source), PayloadRefused) == ["WHEEL_STARTUP_HOOK"]
    assert not (tmp_path / "drive").exists()


def test_a_library_is_built_again_only_when_its_sources_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    library = make_source(tmp_path / "lib", "lib", requires=[])
    made = [library_wheel(library, tmp_path / f"made{n}", Sources(offline=True)) for n in (1, 2)]
    assert made[0].read_bytes() == made[1].read_bytes()
    (library / "wheel.json").write_text((library / "wheel.json").read_text().replace("1.0", "2.0"))
    newer = library_wheel(library, tmp_path / "made3", Sources(offline=True))
    assert newer.name.startswith("lib-2.0-")
    assert len(list((tmp_path / "cache").rglob("*.whl"))) == 1


def test_a_cache_that_cannot_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").write_text("a file")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    library = make_source(tmp_path / "lib", "lib", requires=[])
    assert library_wheel(library, tmp_path / "made", Sources(offline=True)).exists()


@pytest.mark.parametrize(
    ("architectures", "pythons"),
    [
        (("mips",), ("3.11",)),
        (("x86_64",), ("2.7",)),
        (("x86_64",), ("3.10",)),
        (("x86_64",), ("3",)),
    ],
)
def test_unknown_targets_are_refused(architectures: tuple[str], pythons: tuple[str]) -> None:
    assert refused(lambda: targets(architectures, pythons), ConfigRefused) == ["TARGET_UNKNOWN"]


def test_a_target_takes_older_platforms_too() -> None:
    platforms = list(Target("aarch64", "3.11").platforms())
    assert platforms.index("manylinux_2_28_aarch64") < platforms.index("manylinux2014_aarch64")
    assert "manylinux_2_17_aarch64" in platforms
    assert all(platform.endswith("_aarch64") for platform in platforms)
