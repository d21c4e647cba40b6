"""Locks: only wheels, only inside the payload, only with hashes; the right wheel for each host."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packaging.pylock import Package, PackageWheel
from packaging.utils import canonicalize_name
from packaging.version import Version
from tests.wheelhouse.locks import HEAD, SHA, host, package, wheel

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.format import lock

PLAIN = HEAD + package("a", "1.0", wheel("a-1.0-py3-none-any.whl"))


def refused(text: str) -> list[str]:
    with pytest.raises(PayloadRefused) as found:
        lock.parse(text, "pylock.a.toml")
    return [problem.code for problem in found.value.problems]


NATIVE = HEAD + package(
    "n",
    "1.0",
    *(
        wheel(f"n-1.0-cp{python}-cp{python}-manylinux_2_28_{machine}.whl")
        for python in (311, 312)
        for machine in ("x86_64", "aarch64")
    ),
    wheel("n-1.0-py3-none-any.whl"),
)


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
@pytest.mark.parametrize("minor", [11, 12])
def test_each_host_gets_its_own_wheel(minor: int, machine: str) -> None:
    (chosen,) = lock.select(lock.parse(NATIVE, "n"), *host((3, minor), machine))
    assert chosen.filename == f"n-1.0-cp3{minor}-cp3{minor}-manylinux_2_28_{machine}.whl"
    assert (chosen.name, chosen.version, chosen.sha256, chosen.size) == ("n", "1.0", SHA, 3)
    assert chosen.path == f"wheels/{chosen.filename}"


def test_a_pure_wheel_serves_where_no_native_one_does() -> None:
    (chosen,) = lock.select(lock.parse(NATIVE, "n"), *host((3, 13), "riscv64"))
    assert chosen.filename == "n-1.0-py3-none-any.whl"


def test_versions_may_differ_between_pythons() -> None:
    text = HEAD + "".join(
        package(
            "n",
            version,
            wheel(f"n-{version}-cp3{minor}-cp3{minor}-manylinux_2_17_x86_64.whl"),
            more=f"marker = \"python_version == '3.{minor}'\"\n",
        )
        for version, minor in (("1.0", 11), ("2.0", 12))
    )
    parsed = lock.parse(text, "n")
    assert {w.version for w in lock.select(parsed, *host((3, 11), "x86_64"))} == {"1.0"}
    assert {w.version for w in lock.select(parsed, *host((3, 12), "x86_64"))} == {"2.0"}
    assert lock.select(parsed, *host((3, 13), "x86_64")) == ()
    assert parsed.packages == {"n"}


def test_a_missing_architecture_is_told_with_what_there_is() -> None:
    text = HEAD + package("n", "1.0", wheel("n-1.0-cp311-cp311-manylinux_2_28_aarch64.whl"))
    with pytest.raises(PayloadRefused) as found:
        lock.select(lock.parse(text, "pylock.n.toml"), *host((3, 11), "x86_64"))
    (problem,) = found.value.problems
    assert problem.code == "WHEEL_INCOMPATIBLE"
    assert problem.need == "wheels for x86_64, Python 3.11, manylinux_2_28_x86_64 or older"
    assert problem.have == "cp311 on manylinux_2_28_aarch64"
    assert problem.where == "pylock.n.toml"


@pytest.mark.parametrize("platform", ["manylinux_2_39_x86_64", "musllinux_1_2_x86_64", "win_amd64"])
def test_a_newer_or_another_libc_is_told(platform: str) -> None:
    text = HEAD + package("n", "1.0", wheel(f"n-1.0-cp311-cp311-{platform}.whl"))
    with pytest.raises(PayloadRefused) as found:
        lock.select(lock.parse(text, "pylock.n.toml"), *host((3, 11), "x86_64"))
    (problem,) = found.value.problems
    assert problem.code == "WHEEL_INCOMPATIBLE"
    assert problem.have == f"cp311 on {platform}"
    assert problem.need == "wheels for x86_64, Python 3.11, manylinux_2_28_x86_64 or older"


def test_two_entries_for_one_host_are_refused() -> None:
    text = PLAIN + package("a", "2.0", wheel("a-2.0-py3-none-any.whl"))
    with pytest.raises(PayloadRefused) as found:
        lock.select(lock.parse(text, "pylock.a.toml"), *host((3, 11), "x86_64"))
    assert found.value.code == "WHEEL_INCOMPATIBLE"


@pytest.mark.parametrize(
    "marker",
    [
        "python_full_version ~= '6.9inf'",
        "platform_machine ~= '1.0'",
        "extras == 'a'",
        "extra == 'a'",
    ],
)
def test_marker_that_cannot_be_evaluated_is_refused(marker: str) -> None:
    text = HEAD + package("a", "1.0", wheel(A), more=f'marker = "{marker}"\n')
    (problem,) = not_selected(text)
    assert (problem.code, problem.where) == ("LOCK_INVALID", "pylock.a.toml a")
    assert marker.split("'")[1] in problem.message


def test_all_markers_that_cannot_be_evaluated_are_told() -> None:
    text = HEAD + "environments = [\"extra == 'x'\"]\n"
    for name in ("a", "b"):
        more = "marker = \"extra == 'a'\"\n"
        text += package(name, "1.0", wheel(f"{name}-1.0-py3-none-any.whl"), more=more)
    told = [problem.where for problem in not_selected(text)]
    assert told == [f"pylock.a.toml {place}" for place in ("environments", "a", "b")]


def not_selected(text: str) -> Sequence[Problem]:
    with pytest.raises(PayloadRefused) as found:
        lock.select(lock.parse(text, "pylock.a.toml"), *host((3, 11), "x86_64"))
    return found.value.problems


A = "a-1.0-py3-none-any.whl"
DIGITS = "9" * 5_000
"""More than Python makes a number of."""
REFUSED = {
    "not-toml": ("LOCK_TOML", "a = = b"),
    "depth-bomb": ("LOCK_TOML", HEAD + "x = " + "[" * 100_000),
    "too-long": ("TOO_LARGE", HEAD + "#" * lock.MAX_BYTES),
    "no-version": ("LOCK_INVALID", 'created-by = "test"\npackages = []\n'),
    "newer-format": ("LOCK_INVALID", PLAIN.replace("1.0", "2.0", 1)),
    "packages-is-text": ("LOCK_INVALID", HEAD + 'packages = "a"\n'),
    "url": (
        "LOCK_PATH",
        PLAIN.replace("path = ", 'url = "https://example.org/a.whl"\n#'),
    ),
    "url-and-path": (
        "LOCK_PATH",
        PLAIN.replace("path = ", 'url = "https://example.org/a.whl"\npath = '),
    ),
    "path-up": ("LOCK_PATH", HEAD + package("a", "1.0", wheel(A, path=f"../{A}"))),
    "path-absolute": ("LOCK_PATH", HEAD + package("a", "1.0", wheel(A, path=f"/opt/{A}"))),
    "path-odd": ("LOCK_PATH", HEAD + package("a", "1.0", wheel(A, path=f"a b/{A}"))),
    "no-hash": ("LOCK_INVALID", HEAD + package("a", "1.0", wheel(A, rest="size = 3"))),
    "weak-hash": (
        "LOCK_HASH",
        HEAD + package("a", "1.0", wheel(A, rest='size = 3\nhashes = { md5 = "00" }')),
    ),
    "short-hash": (
        "LOCK_HASH",
        HEAD + package("a", "1.0", wheel(A, rest='size = 3\nhashes = { sha256 = "00" }')),
    ),
    "no-size": (
        "LOCK_HASH",
        HEAD + package("a", "1.0", wheel(A, rest=f'hashes = {{ sha256 = "{SHA}" }}')),
    ),
    "no-wheels": ("LOCK_INVALID", HEAD + package("a", "1.0", "wheels = []\n")),
    "index": (
        "LOCK_PATH",
        HEAD + package("a", "1.0", wheel(A), more='index = "https://example.org/simple"\n'),
    ),
    "another-name-than-its-path": (
        "LOCK_INVALID",
        PLAIN.replace(f'name = "{A}"', 'name = "b.whl"'),
    ),
    "editable": (
        "LOCK_NOT_WHEEL",
        HEAD
        + '[[packages]]\nname = "a"\nversion = "1.0"\n'
        + 'directory = { path = ".", editable = true }\n',
    ),
    "sdist": (
        "LOCK_NOT_WHEEL",
        PLAIN + f'[packages.sdist]\npath = "a-1.0.tar.gz"\nsize = 1\nhashes.sha256 = "{SHA}"\n',
    ),
    "vcs": (
        "LOCK_NOT_WHEEL",
        HEAD
        + '[[packages]]\nname = "a"\nversion = "1.0"\n[packages.vcs]\ntype = "git"\n'
        + 'url = "https://example.org/a.git"\ncommit-id = "abc"\n',
    ),
    "directory": (
        "LOCK_NOT_WHEEL",
        HEAD + '[[packages]]\nname = "a"\nversion = "1.0"\n[packages.directory]\npath = "src"\n',
    ),
    "archive": (
        "LOCK_NOT_WHEEL",
        HEAD
        + '[[packages]]\nname = "a"\nversion = "1.0"\n[packages.archive]\npath = "a.zip"\n'
        + f'hashes.sha256 = "{SHA}"\n',
    ),
    "wheel-of-another-name": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel("b-1.0-py3-none-any.whl")),
    ),
    "wheel-of-another-version": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel("a-2.0-py3-none-any.whl")),
    ),
    "no-wheel-name": ("LOCK_INVALID", HEAD + package("a", "1.0", wheel("a-1.0.zip"))),
    "python-without-end": (
        "LOCK_INVALID",
        PLAIN.replace("[[", f'requires-python = ">={DIGITS}"\n[[', 1),
    ),
    "package-python-without-end": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more=f'requires-python = ">={DIGITS}"\n'),
    ),
    "marker-without-end": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more=f"marker = \"python_version > '{DIGITS}'\"\n"),
    ),
    "environment-without-end": (
        "LOCK_INVALID",
        PLAIN.replace("[[", f"environments = [\"python_version > '{DIGITS}'\"]\n[[", 1),
    ),
    "unpacked-is-a-number": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more="tool.nondum.unpacked = 3\n"),
    ),
    "unpacked-size-is-text": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more=f'tool.nondum.unpacked = {{ "{A}" = "3" }}\n'),
    ),
    "unpacked-size-below-nothing": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more=f'tool.nondum.unpacked = {{ "{A}" = -1 }}\n'),
    ),
    "nondum-says-a-number": (
        "LOCK_INVALID",
        HEAD + package("a", "1.0", wheel(A), more="tool.nondum = 3\n"),
    ),
    "no-package-version": ("LOCK_INVALID", PLAIN.replace('version = "1.0"\n[[', "[[")),
}


def test_what_other_tools_say_of_a_package_is_passed_over() -> None:
    more = "tool.uv.unpacked = 3\ntool.nondum.later = 3\n"
    (read,) = lock.parse(HEAD + package("a", "1.0", wheel(A), more=more), "pylock.a.toml").wheels
    assert (read.size, read.unpacked) == (3, 3)


@pytest.mark.parametrize(("code", "text"), REFUSED.values(), ids=REFUSED)
def test_a_wrong_lock_is_refused(code: str, text: str) -> None:
    assert code in refused(text)
    assert {found.partition("_")[0] for found in refused(text)} <= {"LOCK", "TOO"}


def locked(
    path: str | None = f"wheels/{A}", *, name: str | None = None, version: str | None = "1.0"
) -> Package:
    hashes = {"sha256": SHA}
    return Package(
        name=canonicalize_name("a"),
        version=Version(version) if version else None,
        wheels=[PackageWheel(name=name, path=path, size=3, hashes=hashes)],
    )


@pytest.mark.parametrize(
    ("package", "code"),
    [
        pytest.param(
            Package(name=canonicalize_name("a"), version=Version("1.0"), wheels=[]),
            "LOCK_NOT_WHEEL",
            id="no wheels",
        ),
        pytest.param(locked(version=None), "a has no version", id="no version"),
        pytest.param(locked(None), "LOCK_PATH", id="no path"),
        pytest.param(locked("wheels/a-1.0.zip"), "LOCK_NOT_WHEEL", id="no wheel's name"),
        pytest.param(locked("wheels/b-1.0-py3-none-any.whl"), "LOCK_INVALID", id="another name"),
        pytest.param(locked("wheels/a-2-py3-none-any.whl"), "LOCK_INVALID", id="another version"),
        pytest.param(
            locked(name="a-1.0-py2-none-any.whl"), "LOCK_INVALID", id="other tags than its path"
        ),
    ],
)
def test_what_a_library_may_let_through_is_refused(package: Package, code: str) -> None:
    told = list(lock.flaws(package, "pylock.a.toml"))
    assert code in [said for problem in told for said in (problem.code, problem.message)]
    assert not list(lock.flaws(locked(), "pylock.a.toml"))


def test_everything_wrong_is_told_at_once() -> None:
    text = HEAD + package("a", "1.0", wheel(A, path=f"../{A}"))
    text += package("b", "1.0", wheel("b-1.0-py3-none-any.whl", rest='hashes = { md5 = "0" }'))
    assert refused(text) == ["LOCK_PATH", "LOCK_HASH", "LOCK_HASH"]


def test_wheel_and_package_names_are_compared_normalised() -> None:
    text = HEAD + package("ruamel-yaml", "1.0", wheel("ruamel_yaml-1.0-py3-none-any.whl"))
    assert lock.parse(text, "x").wheels[0].name == "ruamel-yaml"


@given(st.text(max_size=100), st.integers(0, len(PLAIN)))
def test_noise_is_refused_and_nothing_else_raised(noise: str, at: int) -> None:
    for text in (noise, PLAIN[:at] + noise + PLAIN[at:], PLAIN[:at] + PLAIN[at + len(noise) :]):
        try:
            parsed = lock.parse(text, "x")
            lock.select(parsed, *host((3, 11), "x86_64"))
        except PayloadRefused:
            continue
