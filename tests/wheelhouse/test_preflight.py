"""Preflight: every reason against this host at once, with what is needed and what is there."""

from __future__ import annotations

import os
import platform
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from tests.wheelhouse.locks import FACTS, SHA, locked, unpacks_to

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import manifest
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.lock import Lock
from nondum.wheelhouse.payload.host_facts import HostFacts, probe
from nondum.wheelhouse.payload.preflight import preflight, select, unmet


def said(requires: str = "", components: tuple[str, ...] = ("a",)) -> manifest.Manifest:
    tables = "".join(f'[[component]]\nid = "{c}"\ndistribution = "dist-{c}"\n' for c in components)
    text = f'id = "org.example.x"\nname = "x"\n[requires]\n{requires}\n{tables}'
    return manifest.parse(text, "payload.toml")


def codes(
    manifest_: manifest.Manifest, locks: dict[str, Lock], facts: HostFacts = FACTS
) -> list[str]:
    return [p.code for p in preflight(manifest_, locks, facts)]


def test_what_fits_has_no_problems() -> None:
    assert codes(said(), {"a": locked("a")}) == []
    assert [w.filename for w in select(said(), {"a": locked("a")}, FACTS)["a"]] == [
        "dist_a-1.0-py3-none-any.whl"
    ]


def test_an_older_nondum_is_told() -> None:
    (problem,) = preflight(said(), {"a": locked("a")}, FACTS, minimum_nondum="0.2")
    assert (problem.code, problem.need, problem.have) == ("NONDUM_VERSION", ">=0.2", "0.1.0")


REFUSED = {
    "python": ("PYTHON_VERSION", 'python = ">=3.13"', ">=3.13", "3.11.4"),
    "memory": ("NO_MEMORY", "memory_mb = 4000", "4000 MB", "1000 MB"),
    "gpu": ("NO_GPU_MEMORY", "gpu_memory_mb = 1", "1 MB", "0 MB"),
    "gpu-in-a-table": ("NO_GPU_MEMORY", "gpu = { memory_mb = 1 }", "1 MB", "0 MB"),
    "gpu-kind-alone": ("NO_GPU_KIND", 'gpu_kind = "v3d"', "a GPU of kind v3d", "none"),
    "gpu-kind": ("NO_GPU_KIND", 'gpu = { kind = "cuda" }', "a GPU of kind cuda", "none"),
    "disk": ("DISK_FULL", "disk_mb = 1001", "1001 MB", "1000 MB"),
    "confinement": (
        "CONFINEMENT",
        'confinement = "sandboxed"',
        "level sandboxed",
        "level restricted",
    ),
}


@pytest.mark.parametrize(("code", "requires", "need", "have"), REFUSED.values(), ids=REFUSED)
def test_what_does_not_fit_is_told(code: str, requires: str, need: str, have: str) -> None:
    (problem,) = preflight(said(requires), {"a": locked("a")}, FACTS)
    assert (problem.code, problem.need, problem.have) == (code, need, have)
    assert problem.where == "org.example.x"


@pytest.mark.parametrize(
    ("size_mb", "unpacked_mb", "refused"),
    [
        pytest.param(400, 600, [], id="both fit"),
        pytest.param(400, 601, ["DISK_FULL"], id="a megabyte too much"),
        pytest.param(999, 1, [], id="stored as it is, and nothing of it installed"),
        pytest.param(1, 999, [], id="well packed"),
        pytest.param(500, None, [], id="nothing said: as much again"),
        pytest.param(501, None, ["DISK_FULL"], id="nothing said: more than as much again"),
    ],
)
def test_wheels_need_disk_for_themselves_and_for_what_their_lock_says_they_unpack_to(
    size_mb: int, unpacked_mb: int | None, refused: list[str]
) -> None:
    more = "" if unpacked_mb is None else unpacks_to(unpacked_mb * 1024**2)
    assert codes(said(), {"a": locked("a", more=more, size=size_mb * 1024**2)}) == refused


def test_wheels_that_are_stored_already_need_no_disk() -> None:
    big = {"a": locked("a", size=600 * 1024**2)}
    assert [p.code for p in preflight(said(), big, FACTS)] == ["DISK_FULL"]
    assert preflight(said(), big, FACTS, stored={SHA}) == ()


def test_wheels_that_components_share_are_counted_once() -> None:
    one = locked("a", size=400 * 1024**2)
    shared = replace(one, where="pylock.b.toml")
    both = replace(
        said(components=("a", "b")),
        components=tuple(
            replace(c, distribution="dist-a") for c in said(components=("a", "b")).components
        ),
    )
    assert codes(both, {"a": one, "b": shared}) == []


def test_another_architecture_is_told() -> None:
    foreign = locked("a", tag="cp311-cp311-manylinux_2_28_aarch64")
    (problem,) = preflight(said(), {"a": foreign}, FACTS)
    assert problem.code == "WHEEL_INCOMPATIBLE"
    assert "aarch64" in problem.have
    assert "x86_64" in problem.need


def test_another_libc_is_told() -> None:
    foreign = locked("a", tag="cp311-cp311-musllinux_1_2_x86_64")
    assert codes(said(), {"a": foreign}) == ["WHEEL_INCOMPATIBLE"]


def test_a_missing_lock_is_told() -> None:
    assert codes(said(), {}) == ["LOCK_MISSING"]


def test_a_lock_without_the_plugin_is_told() -> None:
    assert codes(said(), {"a": locked("b")}) == ["LOCK_INCOMPLETE"]


def test_a_plugin_locked_for_other_hosts_only_is_refused() -> None:
    other = locked("a", more="marker = \"python_version == '3.13'\"\n")
    (problem,) = preflight(said(), {"a": other}, FACTS)
    assert problem.code == "LOCK_INCOMPLETE"
    assert "other hosts" in problem.message


def test_everything_is_told_at_once() -> None:
    requires = 'python = ">=3.13"\nmemory_mb = 4000\ngpu_memory_mb = 9\nconfinement = 3'
    locks = {"a": locked("a", tag="cp312-cp312-manylinux_2_28_aarch64")}
    assert codes(said(requires, ("a", "b")), locks) == [
        "PYTHON_VERSION",
        "CONFINEMENT",
        "NO_MEMORY",
        "NO_GPU_MEMORY",
        "LOCK_MISSING",
        "WHEEL_INCOMPATIBLE",
    ]


def test_selecting_tells_all_components() -> None:
    foreign = {c: locked(c, tag="cp312-cp312-manylinux_2_28_aarch64") for c in ("a", "b")}
    with pytest.raises(PayloadRefused) as refused:
        select(said(components=("a", "b")), foreign, FACTS)
    assert [p.where for p in refused.value.problems] == ["pylock.a.toml", "pylock.b.toml"]


@pytest.mark.parametrize(
    ("line", "is_met"),
    [
        ("dist-a", True),
        ("Dist_A>=1.0", True),
        ("dist.a", True),
        ("dist-a>=2", False),
        ("absent", False),
        ("absent; sys_platform == 'win32'", True),
        ("absent; extra == 'speed'", True),
        ("absent; python_version < '3.12'", False),
        ("dist-a[speed]", True),
    ],
)
def test_dependencies_are_met_or_told(line: str, is_met: bool) -> None:
    chosen = locked("a").wheels
    problems = list(unmet({"other": [line]}, chosen, FACTS, "pylock.a.toml"))
    assert [p.code for p in problems] == ([] if is_met else ["LOCK_INCOMPLETE"])


def test_the_dependencies_of_extras_are_needed_too() -> None:
    chosen = (*locked("a").wheels, *locked("b").wheels)
    requirements = {"dist-a": ["dist-b[speed]"], "dist-b": ["absent; extra == 'speed'"]}
    (problem,) = unmet(requirements, chosen, FACTS, "pylock.a.toml")
    assert problem.need == "absent"


def test_an_unreadable_dependency_is_told() -> None:
    (problem,) = unmet({"other": ["no ! requirement"]}, locked("a").wheels, FACTS, "x")
    assert problem.code == "WHEEL_METADATA"


def test_probing_looks_at_this_machine(tmp_path: Path) -> None:
    facts = probe(tmp_path / "not/yet/there", reserve_mb=64, confinement=Level.RESTRICTED)
    assert facts.architecture == platform.machine()
    assert facts.python == platform.python_version()
    assert (
        0 < facts.memory.free_mb <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") >> 20
    )
    free_mb = shutil.disk_usage(tmp_path).free >> 20
    assert abs(facts.free_disk_mb - (free_mb - 64)) < 200
    assert facts.environment["platform_machine"] == platform.machine()
    assert preflight(said(), {"a": locked("a")}, facts) == ()


def test_the_reserve_is_never_negative(tmp_path: Path) -> None:
    assert probe(tmp_path, reserve_mb=10**9, confinement=Level.NONE).free_disk_mb == 0
