"""The Debian package: what is in it, for both architectures, and that it is the same every time."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.packages.conftest import ROOT, Build

from nondum.host import config
from nondum.wheelhouse.elf import ARCHITECTURES, HEAD_BYTES, Elf

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),
    pytest.mark.skipif(not shutil.which("dpkg-deb"), reason="there is no dpkg here"),
]
MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
both = pytest.mark.parametrize("architecture", MACHINES)
OF_DEBIAN = {
    **{"libc.so.6": "libc6", "libm.so.6": "libc6", "libdl.so.2": "libc6", "librt.so.1": "libc6"},
    **{"libpthread.so.0": "libc6", "ld-linux-x86-64.so.2": "libc6", "libutil.so.1": "libc6"},
    **{"ld-linux-aarch64.so.1": "libc6", "libgcc_s.so.1": "libgcc-s1", "libz.so.1": "zlib1g"},
    "libstdc++.so.6": "libstdc++6",
}
"""Libraries that wheels may find on a machine (PEP 600), and which package has them."""


@pytest.fixture(scope="session")
def trees(packages: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """What each package puts on a machine, and, in DEBIAN/, what dpkg is told."""
    found = {}
    for architecture, deb in packages.items():
        found[architecture] = tmp_path_factory.mktemp(architecture) / "root"
        subprocess.run(["dpkg-deb", "-R", deb, found[architecture]], check=True)
    return found


@both
def test_name_tells_version_and_architecture(packages: dict[str, Path], architecture: str) -> None:
    deb = packages[architecture]
    assert deb.name == f"nondum_0.1.0+test1_{architecture}.deb"
    assert _field(deb, "Architecture") == architecture
    assert _field(deb, "Version") == "0.1.0+test1"


@both
def test_machine_code_is_of_its_architecture(trees: dict[str, Path], architecture: str) -> None:
    heads = (path.read_bytes()[:HEAD_BYTES] for path in _files(trees[architecture]))
    machines = {elf for head in heads if (elf := Elf.parse(head))}
    assert machines == {ARCHITECTURES[MACHINES[architecture]]}


@both
def test_depends_on_the_libraries_that_wheels_leave_out(
    trees: dict[str, Path], packages: dict[str, Path], architecture: str
) -> None:
    if not shutil.which("readelf"):
        pytest.skip("binutils are not installed")
    libraries = [p for p in _files(trees[architecture]) if ".so" in p.name]
    command: list[str | Path] = ["readelf", "-d", *libraries]
    said = subprocess.run(command, capture_output=True, text=True).stdout
    needed = {line.partition("[")[2].rstrip("]") for line in said.splitlines() if "NEEDED" in line}
    brought = {library.name for library in libraries}
    depended = {word.split()[0] for word in _field(packages[architecture], "Depends").split(",")}
    assert {OF_DEBIAN[name] for name in needed - brought} <= depended


@both
def test_own_distributions_and_planners_are_in_it(
    trees: dict[str, Path], architecture: str
) -> None:
    site = trees[architecture] / "opt/nondum/lib/python3.11/site-packages"
    names = {folder.name.partition("-")[0] for folder in site.glob("*.dist-info")}
    assert {"nondum", "nondum_sdk", "nondum_planner_pyperplan", "pyperplan", "isal"} <= names
    assert not list(site.rglob("*.pyc")), "what is compiled is for the machine to make"
    assert not (site / "bin").exists(), "others' programs are not ours to offer"


@both
def test_configuration_is_a_conffile_that_the_daemon_reads(
    trees: dict[str, Path], architecture: str
) -> None:
    root = trees[architecture]
    assert (root / "DEBIAN/conffiles").read_text() == f"{config.SYSTEM_FILE}\n"
    file = root / config.SYSTEM_FILE.relative_to("/")
    defaults = config.HostConfig()
    assert config.load(file, defaults) == defaults, "as delivered it changes nothing"


@both
def test_commented_keys_are_keys(trees: dict[str, Path], architecture: str) -> None:
    text = (trees[architecture] / config.SYSTEM_FILE.relative_to("/")).read_text()
    lines = [
        line[2:] if line.startswith("# ") and " = " in line else line for line in text.splitlines()
    ]
    config.parse("\n".join(lines), "host.toml", config.HostConfig())


@both
def test_every_unit_and_rule_of_the_checkout_is_in_it(
    trees: dict[str, Path], architecture: str
) -> None:
    names = {path.name for path in _files(trees[architecture])}
    folders = (f for f in (ROOT / "packaging").iterdir() if f.name != "debian")
    assert {path.name for folder in folders for path in _files(folder)} <= names


@both
def test_installing_asks_no_network(trees: dict[str, Path], architecture: str) -> None:
    for name in ("postinst", "prerm", "postrm"):
        script = (trees[architecture] / "DEBIAN" / name).read_text()
        assert not any(word in script for word in ("pip install", "http", "apt-get", "curl")), name
        subprocess.run(["sh", "-n", trees[architecture] / "DEBIAN" / name], check=True)


@both
def test_units_in_scripts_are_those_that_can_be_enabled(
    trees: dict[str, Path], architecture: str
) -> None:
    units = (trees[architecture] / "lib/systemd/system").iterdir()
    enabled = {unit.name for unit in units if "[Install]" in unit.read_text()}
    for name in ("postinst", "postrm"):
        script = (trees[architecture] / "DEBIAN" / name).read_text()
        (line,) = (line for line in script.splitlines() if line.startswith("UNITS="))
        assert set(line.partition("=")[2].strip('"').split()) == enabled, name


@both
def test_all_that_is_compiled_at_installation_can_be(
    trees: dict[str, Path], architecture: str
) -> None:
    script = (trees[architecture] / "DEBIAN/postinst").read_text()
    (left_out,) = re.findall(r"py3compile .*-X '(.*)'", script)
    modules = [path for path in _files(trees[architecture] / "opt") if path.suffix == ".py"]
    for path in (path for path in modules if not re.match(left_out, str(path))):
        compile(path.read_bytes(), str(path), "exec", dont_inherit=True)


def test_command_of_the_tree_runs_wherever_it_lies(trees: dict[str, Path]) -> None:
    mine = {machine: name for name, machine in MACHINES.items()}.get(platform.machine())
    if mine is None or not Path("/usr/bin/python3.11").exists():
        pytest.skip("neither architecture is this machine's, or Debian 12's Python is not here")
    python = trees[mine] / "opt/nondum/bin/python"
    command: list[str | Path] = [python, "-I", "-m", "nondum.host.cli"]
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert "0.1.0" in said.stdout
    completion = (trees[mine] / "usr/share/bash-completion/completions/nondum").read_text()
    printed = subprocess.run([*command, "completion", "bash"], capture_output=True, text=True)
    assert completion == printed.stdout


def test_same_bytes_whoever_builds_it(packages: dict[str, Path], build: Build) -> None:
    words = ("--arch", "arm64", "--version", "0.1.0+test1")
    (again,) = build(*words, TZ="Asia/Tokyo", LC_ALL="C", HOME="/nonexistent").iterdir()
    assert again.read_bytes() == packages["arm64"].read_bytes()


def test_lintian_has_nothing_to_say(packages: dict[str, Path]) -> None:
    if not shutil.which("lintian"):
        pytest.skip("lintian is not installed")
    command: list[str | Path] = ["lintian", "--fail-on", "error,warning", packages["arm64"]]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def _field(deb: Path, name: str) -> str:
    command: list[str | Path] = ["dpkg-deb", "-f", deb, name]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def _files(root: Path) -> list[Path]:
    return [path for path in root.rglob("*") if path.is_file() and not path.is_symlink()]
