"""Machine code in wheels: what an interpreter would load is judged, and nothing else."""

from __future__ import annotations

import platform
import sys
from importlib.metadata import files
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.payloads import installed_wheel
from tests.wheelhouse.hostile.machines import ARM, ARM_32, MODULE, X86, X86_32, elf, native

from nondum.sdk.errors import Problem
from nondum.wheelhouse.wheels import extensions, wheel
from nondum.wheelhouse.wheels.elf import ARCHITECTURES, HEAD_BYTES, Elf
from nondum.wheelhouse.wheels.extensions import MAX_TOLD

PURE = "py3-none-any"
LIBRARY = b"\0gst_init\0"


def judged(tmp_path: Path, held: dict[str, bytes], *tags: str) -> tuple[Problem, ...]:
    name, builder = native(held, *tags)
    return wheel.check(builder.write(tmp_path, name))


def test_refusal_tells_both_machines(tmp_path: Path) -> None:
    (problem,) = judged(tmp_path, {MODULE: elf(ARM)})
    assert problem.code == "WHEEL_MACHINE"
    assert repr(MODULE) in problem.message
    assert (problem.need, problem.have) == ("x86_64", "aarch64, 64 bits")
    assert problem.where == "evil-1.0-cp311-cp311-manylinux_2_28_x86_64.whl"
    assert problem.fix


def test_many_are_told_shortly(tmp_path: Path) -> None:
    held = {f"evil/m{n}.abi3.so": elf(ARM, f"\0PyInit_m{n}\0".encode()) for n in range(99)}
    assert len(judged(tmp_path, held)) == MAX_TOLD


def test_a_wheel_of_nothing_but_foreign_files_takes_no_long_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search for a module ends after `MAX_SEARCHED` bytes."""
    held = {"evil/a.so": elf(ARM, bytes(3000)), "evil/b.so": elf(ARM, b"\0PyInit_b\0")}
    assert [p.code for p in judged(tmp_path, held)] == ["WHEEL_MACHINE"]
    monkeypatch.setattr(extensions, "MAX_SEARCHED", 3000)
    assert judged(tmp_path, held) == ()


HARMLESS = {
    "its own module": {MODULE: elf(X86)},
    "a program for a board": {"evil/firmware/flasher": elf(ARM_32)},
    "a library for a board": {"evil/data/libevil.so": elf(ARM, LIBRARY)},
    "a library with a version": {"evil/data/libevil.so.3": elf(ARM)},
    "something that is no library beside libraries": {"evil.libs/flasher.socket": elf(ARM)},
    "a module for an app, not importable": {"evil/lib-arm64/_core.so": elf(ARM)},
    "a module of the same name for another machine": {
        "evil/arm/_core.so": elf(ARM),
        "evil/pc/_core.so": elf(X86),
    },
    "modules of another machine beside its own, by name": {
        MODULE: elf(X86),
        "evil/_core.cpython-311-aarch64-linux-gnu.so": elf(ARM),
        "evil/_core.cpython-311-i386-linux-gnu.so": elf(X86_32),
    },
    "machine code of another system": {MODULE: b"\xcf\xfa\xed\xfe" + bytes(60)},
    "something else by a module's name": {MODULE: b"version https://git-lfs.example/spec/v1\n"},
    "nothing by a module's name": {MODULE: b""},
    "scripts for another machine": {"evil-1.0.data/scripts/evil": elf(ARM)},
    "a data folder's module": {"evil-1.0.data/data/lib/_core.abi3.so": elf(ARM)},
}


@pytest.mark.parametrize("held", HARMLESS.values(), ids=HARMLESS)
def test_what_no_interpreter_would_load_may_be_for_any_machine(
    tmp_path: Path, held: dict[str, bytes]
) -> None:
    assert judged(tmp_path, held) == ()


ANY = {
    "wheel for any machine": (PURE,),
    "wheel for several machines": (
        "cp311-cp311-manylinux_2_28_aarch64",
        "cp311-cp311-manylinux_2_28_x86_64",
    ),
    "wheel for a machine that is not known": ("cp311-cp311-linux_loongarch64",),
    "wheel for another system": ("cp311-cp311-win_amd64",),
}


@pytest.mark.parametrize("tags", ANY.values(), ids=ANY)
def test_a_wheel_that_does_not_say_which_machine_is_not_held_to_one(
    tmp_path: Path, tags: tuple[str, ...]
) -> None:
    assert judged(tmp_path, {MODULE: elf(X86), "evil/_core.so": elf(ARM)}, *tags) == ()


def test_machines_of_a_wheel_for_several_are_all_that_it_may_hold(tmp_path: Path) -> None:
    tags = "cp311-cp311-linux_armv6l", "cp311-cp311-linux_armv7l"
    module = "evil/_core.cpython-311-arm-linux-gnueabihf.so"
    assert judged(tmp_path, {module: elf(ARM_32)}, *tags) == ()
    (problem,) = judged(tmp_path, {module: elf(ARM)}, *tags)
    assert (problem.need, problem.have) == ("armv6l, armv7l", "aarch64, 64 bits")


def test_this_interpreter_is_what_it_is_taken_for() -> None:
    with Path(sys.executable).open("rb") as file:
        assert Elf.parse(file.read(HEAD_BYTES)) == ARCHITECTURES[platform.machine()]


def test_real_module_passes_in_a_wheel_for_this_machine_only(tmp_path: Path) -> None:
    """As msgpack's is, and by a name that says nothing of machines."""
    here = platform.machine()
    other = "aarch64" if here != "aarch64" else "x86_64"
    found = [f for f in files("msgpack") or () if f.name.startswith("_cmsgpack.cpython-")]
    (module,) = (Path(str(file.locate())).read_bytes() for file in found)
    plain = {"evil/_cmsgpack.so": module}
    assert wheel.check(installed_wheel("msgpack")) == ()
    assert judged(tmp_path, plain, f"cp311-cp311-linux_{here}") == ()
    assert [p.code for p in judged(tmp_path, plain, f"cp311-cp311-linux_{other}")] == [
        "WHEEL_MACHINE"
    ]


@given(st.binary(max_size=64))
def test_any_bytes_are_an_elf_file_or_none(head: bytes) -> None:
    found = Elf.parse(head)
    assert (found is not None) == (len(head) >= HEAD_BYTES and head[:4] == b"\x7fELF")
    assert found is None or str(found)


FILENAME, BUILDER = native({MODULE: elf(X86), "evil/_core.so": elf(ARM, bytes(999))})
WHOLE = BUILDER.bytes()


@given(st.integers(0, len(WHOLE) - 1), st.binary(min_size=1, max_size=9))
def test_damaged_machine_code_is_judged_like_any_other(at: int, noise: bytes) -> None:
    """Whatever is wrong with it is told where contents are judged; nothing else is raised."""
    damaged = (WHOLE[:at] + noise + WHOLE[at + len(noise) :])[: len(WHOLE)]
    found = wheel.lay_out(memoryview(damaged), FILENAME).problems
    assert all(problem.code.startswith("WHEEL_") for problem in found)


@given(st.sampled_from(list(ARCHITECTURES)))
def test_every_known_machine_is_read_as_it_is_written(name: str) -> None:
    assert Elf.parse(elf(ARCHITECTURES[name])) == ARCHITECTURES[name]
