"""What a venv holds is what pip would have put there, file by file, for wheels that people use.

Scripts, other data schemes, start-up hooks of known tools and installer metadata apart. Many wheels
come from the package index, in a campaign; a few are those that are installed here.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from importlib.util import cache_from_source
from pathlib import Path

import pytest
from tests.kit.payloads import installed_wheel

from nondum.wheelhouse.build import locking
from nondum.wheelhouse.format import lock
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.payload import host_facts
from nondum.wheelhouse.store import bytecode, venvs
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel
from nondum.wheelhouse.wheels import wheel

PYTHON = Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"
POPULAR = (
    *("attrs", "certifi", "charset-normalizer", "click", "idna", "jinja2", "markupsafe"),
    *("numpy<2.5", "packaging", "pillow", "pygments", "python-dateutil", "pyyaml", "requests"),
    *("rich", "six", "typing-extensions", "urllib3", "jaraco-context", "jaraco-functools"),
)
FEW = ("idna", "markupsafe", "jaraco-functools", "python-dateutil")
"""Pure, of C, of a namespace, and with something that it needs."""
AT_HAND = ("pluggy", "msgpack", "packaging")
INSTALLER_METADATA = {"INSTALLER", "RECORD", "REQUESTED", "direct_url.json"}

long = pytest.mark.long("conformance")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A payload-like folder with the wheels, what they depend on, and a lock."""
    made = tmp_path_factory.mktemp("conformance")
    pip("download", "--only-binary", ":all:", "--dest", str(made / "wheels"), *POPULAR)
    write_lock(made)
    return made


def write_lock(folder: Path) -> None:
    """Of all wheels that are there."""
    text = locking.lock_text({Target.here(): sorted((folder / "wheels").iterdir())})
    (folder / "pylock.popular.toml").write_text(text)


def stored(folder: Path) -> list[StoredWheel]:
    """The wheels as chosen from the lock, in the store."""
    store = Store(folder / "store")
    parsed = lock.parse((folder / "pylock.popular.toml").read_text(), "lock")
    facts = host_facts.probe(folder, reserve_mb=0, confinement=Level.NONE)
    chosen = lock.select(parsed, facts.environment, facts.tags)
    for one in chosen:
        store.add(folder / one.path, one.sha256)
    return [store.compile(one.sha256) for one in chosen]


@pytest.fixture(scope="module")
def ours(folder: Path) -> Path:
    return made_by_us(folder)


@pytest.fixture(scope="module")
def pips(folder: Path) -> Path:
    return made_by_pip(folder)


def made_by_us(folder: Path) -> Path:
    """A venv of the wheels of the lock."""
    venvs.make(folder / "ours", PYTHON, stored(folder))
    return folder / "ours"


def made_by_pip(folder: Path) -> Path:
    """A venv of Python's own, filled by pip from the same lock."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "pips"], check=True)
    pip(
        *("--python", str(folder / "pips/bin/python"), "install"),
        *("--no-index", "--no-deps", "--require-hashes", "--no-compile"),
        *("-r", str(folder / "pylock.popular.toml")),
    )
    return folder / "pips"


def pip(*arguments: str) -> str:
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments]
    # pip imports what it finds beside itself (attrs): what is compared must not change by that.
    env = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


def tree(venv: Path) -> dict[str, tuple[str, bool]]:
    """Path → digest and whether it is executable, of site-packages."""
    site = venvs.site_packages(venv)
    return {
        path.relative_to(site).as_posix(): (
            hashlib.sha256(path.read_bytes()).hexdigest(),
            os.access(path, os.X_OK),
        )
        for path in site.rglob("*")
        if path.is_file()
        and path.parent.name != bytecode.FOLDER
        and not (path.parent.suffix == ".dist-info" and path.name in INSTALLER_METADATA)
    }


def test_trees_of_wheels_at_hand_are_equal(tmp_path: Path) -> None:
    """As they are installed here: with code of C, with scripts, and of packages within packages."""
    (tmp_path / "wheels").mkdir()
    for name in AT_HAND:
        made = installed_wheel(name)
        shutil.copy(made, tmp_path / "wheels" / made.name)
    write_lock(tmp_path)
    ours = made_by_us(tmp_path)
    assert tree(ours) == tree(made_by_pip(tmp_path))
    assert len(tree(ours)) > 20


@pytest.mark.short("conformance")
def test_trees_of_a_few_real_wheels_are_equal(tmp_path: Path) -> None:
    pip("download", "--only-binary", ":all:", "--dest", str(tmp_path / "wheels"), *FEW)
    write_lock(tmp_path)
    assert tree(made_by_us(tmp_path)) == tree(made_by_pip(tmp_path))


@long
def test_trees_are_equal(ours: Path, pips: Path) -> None:
    assert tree(ours) == tree(pips)
    assert len(tree(ours)) > 1000


@long
def test_compiled_files_are_those_that_interpreters_look_for(ours: Path) -> None:
    site = venvs.site_packages(ours)
    modules = [path for path in site.rglob("*.py") if "templates" not in path.parts]
    compiled = [path for path in modules if Path(cache_from_source(str(path))).exists()]
    assert len(compiled) > 1000
    assert len(compiled) >= len(modules) - 5


@long
def test_pip_sees_the_same_distributions(ours: Path, pips: Path) -> None:
    lists = [
        json.loads(pip("--python", str(venv / "bin/python"), "list", "--format", "json"))
        for venv in (ours, pips)
    ]
    assert lists[0] == lists[1]
    assert len(lists[0]) >= len(POPULAR)


@long
def test_pip_finds_nothing_broken(ours: Path) -> None:
    assert "No broken requirements" in pip("--python", str(ours / "bin/python"), "check")


@long
def test_the_distributions_work_together(ours: Path) -> None:
    code = (
        "import numpy, PIL.Image, yaml, requests, jaraco.context, jaraco.functools;"
        "print(PIL.Image.fromarray(numpy.zeros((4, 3), 'u1')).size)"
    )
    done = subprocess.run(
        [ours / "bin/python", "-I", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == "(3, 4)\n"


@long
def test_the_other_method_gives_the_same_tree(folder: Path, pips: Path) -> None:
    parsed = lock.parse((folder / "pylock.popular.toml").read_text(), "lock")
    facts = host_facts.probe(folder, reserve_mb=0, confinement=Level.NONE)
    venvs.make_with_pip(
        folder / "by-pip", PYTHON, folder, lock.select(parsed, facts.environment, facts.tags)
    )
    assert tree(folder / "by-pip") == tree(pips)


@long
def test_no_popular_wheel_is_refused(folder: Path) -> None:
    for path in (folder / "wheels").iterdir():
        assert wheel.check(path) == (), path.name


@long
def test_start_up_hooks_are_the_one_thing_left_out(tmp_path: Path) -> None:
    pip("download", "--no-deps", "--only-binary", ":all:", "--dest", str(tmp_path), "setuptools")
    (path,) = tmp_path.glob("*.whl")
    known = Store(tmp_path / "store").add(path, locking.sha256(path))
    venvs.make(tmp_path / "ours", PYTHON, [known])
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "pips"], check=True)
    python = str(tmp_path / "pips/bin/python")
    pip("--python", python, "install", "--no-index", "--no-deps", "--no-compile", str(path))
    ours, pips = tree(tmp_path / "ours"), tree(tmp_path / "pips")
    assert pips.keys() - ours.keys() == {"distutils-precedence.pth"}
    assert all(pips[name] == found for name, found in ours.items())
