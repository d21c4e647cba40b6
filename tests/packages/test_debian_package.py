"""The Debian package: what is in it, for both architectures, and that it is the same every time.

In the full run only that of this machine is built, and only when something has changed of which it
is made.
"""

from __future__ import annotations

import functools
import platform
import re
import shutil
import subprocess
from collections.abc import Callable
from importlib.metadata import distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from tests.packages.checkout import copied
from tests.packages.conftest import ROOT, Build, Package

from nondum.host.config import host_config, parsing
from nondum.wheelhouse.wheels.elf import ARCHITECTURES, HEAD_BYTES, Elf

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),
    pytest.mark.skipif(not shutil.which("dpkg-deb"), reason="there is no dpkg here"),
]
MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
MINE = {machine: name for name, machine in MACHINES.items()}.get(platform.machine(), "amd64")
"""The architecture of this machine, or one that can only be looked at."""
long, short = pytest.mark.long("packages"), pytest.mark.short("packages")
both = pytest.mark.parametrize(
    "architecture",
    [pytest.param(name, marks=short if name == MINE else long) for name in MACHINES],
)
PYTHONS = ("3.11", "3.12", "3.13")
every_python = pytest.mark.parametrize("python", PYTHONS)
SHARED, SITE = "opt/nondum/lib/python3/site-packages", "opt/nondum/lib/python{}/site-packages"
SYSTEM = Path("/usr/bin/python3")
OF_DEBIAN = {
    **{"libc.so.6": "libc6", "libm.so.6": "libc6", "libdl.so.2": "libc6", "librt.so.1": "libc6"},
    **{"libpthread.so.0": "libc6", "ld-linux-x86-64.so.2": "libc6", "libutil.so.1": "libc6"},
    **{"ld-linux-aarch64.so.1": "libc6", "libgcc_s.so.1": "libgcc-s1", "libz.so.1": "zlib1g"},
    "libstdc++.so.6": "libstdc++6",
}
"""Libraries that wheels may find on a machine (PEP 600), and which package has them."""
Tree = Callable[[str], Path]


@pytest.fixture(scope="session")
def tree(package: Package, tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """What a package puts on a machine, and, in DEBIAN/, what dpkg is told."""

    @functools.cache
    def of(architecture: str) -> Path:
        root = tmp_path_factory.mktemp(architecture) / "root"
        subprocess.run(["dpkg-deb", "-R", package(architecture), root], check=True)
        return root

    return of


@both
def test_name_tells_version_and_architecture(package: Package, architecture: str) -> None:
    deb = package(architecture)
    assert deb.name == f"nondum_0.1.0+test1_{architecture}.deb"
    assert _field(deb, "Architecture") == architecture
    assert _field(deb, "Version") == "0.1.0+test1"


@both
def test_machine_code_is_of_its_architecture(tree: Tree, architecture: str) -> None:
    heads = (path.read_bytes()[:HEAD_BYTES] for path in _files(tree(architecture)))
    machines = {elf for head in heads if (elf := Elf.parse(head))}
    assert machines == {ARCHITECTURES[MACHINES[architecture]]}


@both
def test_depends_on_the_libraries_that_wheels_leave_out(
    tree: Tree, package: Package, architecture: str
) -> None:
    if not shutil.which("readelf"):
        pytest.skip("binutils are not installed")
    libraries = [p for p in _files(tree(architecture)) if ".so" in p.name]
    command: list[str | Path] = ["readelf", "-d", *libraries]
    said = subprocess.run(command, capture_output=True, text=True).stdout
    needed = {line.partition("[")[2].rstrip("]") for line in said.splitlines() if "NEEDED" in line}
    brought = {library.name for library in libraries}
    depended = {word.split()[0] for word in _field(package(architecture), "Depends").split(",")}
    assert {OF_DEBIAN[name] for name in needed - brought} <= depended


@both
@every_python
def test_own_distributions_and_planners_are_in_it(
    tree: Tree, architecture: str, python: str
) -> None:
    sites = _sites(tree(architecture), python)
    names = {found.name.replace("-", "_") for found in distributions(path=sites)}
    assert {"nondum", "nondum_sdk", "nondum_planner_pyperplan", "pyperplan", "isal"} <= names
    assert {"nondum_host_lamps", "nondum_lab", "nondum_pddl_workbench"} <= names
    assert {"nondum_host_zenoh", "eclipse_zenoh"} <= names
    for site in map(Path, sites):
        assert not list(site.rglob("*.pyc")), "what is compiled is for the machine to make"
        assert not (site / "bin").exists(), "others' programs are not ours to offer"


@both
@every_python
def test_each_python_finds_all_that_is_required(tree: Tree, architecture: str, python: str) -> None:
    """Resolved by another Python than it is for, by pip, which asks markers of that one."""
    version = {"python_version": python, "python_full_version": f"{python}.0"}
    environment = {**version, "platform_machine": MACHINES[architecture], "extra": ""}
    sites = _sites(tree(architecture), python)
    found = {canonicalize_name(one.name): one for one in distributions(path=sites)}
    for name, distribution in found.items():
        for requirement in map(Requirement, distribution.requires or ()):
            if requirement.marker is None or requirement.marker.evaluate(environment):
                needed = found[canonicalize_name(requirement.name)]
                assert requirement.specifier.contains(needed.version), (name, requirement)


@both
def test_what_all_pythons_have_alike_is_there_once(tree: Tree, architecture: str) -> None:
    root = tree(architecture)
    sites = (SHARED, *map(SITE.format, PYTHONS))
    shared, *alone = ({entry.name for entry in (root / site).iterdir()} for site in sites)
    assert {"nondum", "lark"} <= shared
    assert not any(shared & names for names in alone)
    assert all({"nondum.pth", "msgpack", "pyzmq.libs"} <= names for names in alone)


@both
@every_python
def test_all_that_a_distribution_says_it_has_lies_together(
    tree: Tree, architecture: str, python: str
) -> None:
    """Libraries of wheels find each other from where they lie."""
    for site in _sites(tree(architecture), python):
        for distribution in distributions(path=[site]):
            for file in distribution.files or ():
                assert Path(site, file).exists(), (distribution.name, file)


@both
def test_machine_code_of_a_python_is_for_that_one(tree: Tree, architecture: str) -> None:
    names = {
        python: {p.name for p in _files(tree(architecture) / SITE.format(python))}
        for python in PYTHONS
    }
    for python, there in names.items():
        tags = {name.split(".")[1] for name in there if ".cpython-" in name}
        assert tags == {f"cpython-{python.replace('.', '')}-{MACHINES[architecture]}-linux-gnu"}


@both
def test_configuration_is_a_conffile_that_the_daemon_reads(tree: Tree, architecture: str) -> None:
    root = tree(architecture)
    assert (root / "DEBIAN/conffiles").read_text() == f"{host_config.SYSTEM_FILE}\n"
    file = root / host_config.SYSTEM_FILE.relative_to("/")
    defaults = host_config.HostConfig()
    assert parsing.load(file, defaults) == defaults, "as delivered it changes nothing"


@both
def test_commented_keys_are_keys(tree: Tree, architecture: str) -> None:
    text = (tree(architecture) / host_config.SYSTEM_FILE.relative_to("/")).read_text()
    lines = [
        line[2:] if line.startswith("# ") and " = " in line else line for line in text.splitlines()
    ]
    parsing.parse("\n".join(lines), "host.toml", host_config.HostConfig())


@both
def test_every_unit_and_rule_of_the_checkout_is_in_it(tree: Tree, architecture: str) -> None:
    names = {path.name for path in _files(tree(architecture))}
    others = {"debian", "development"}  # what makes packages, and environments to develop in
    folders = (f for f in (ROOT / "packaging").iterdir() if f.name not in others)
    assert {path.name for folder in folders for path in _files(folder)} <= names


@both
def test_installing_asks_no_network(tree: Tree, architecture: str) -> None:
    for name in ("postinst", "prerm", "postrm"):
        script = (tree(architecture) / "DEBIAN" / name).read_text()
        assert not any(word in script for word in ("pip install", "http", "apt-get", "curl")), name
        subprocess.run(["sh", "-n", tree(architecture) / "DEBIAN" / name], check=True)


@both
def test_units_in_scripts_are_those_that_can_be_enabled(tree: Tree, architecture: str) -> None:
    units = (tree(architecture) / "lib/systemd/system").iterdir()
    enabled = {unit.name for unit in units if "[Install]" in unit.read_text()}
    for name in ("postinst", "postrm"):
        script = (tree(architecture) / "DEBIAN" / name).read_text()
        (line,) = (line for line in script.splitlines() if line.startswith("UNITS="))
        assert set(line.partition("=")[2].strip('"').split()) == enabled, name


@both
def test_all_that_is_compiled_at_installation_can_be(tree: Tree, architecture: str) -> None:
    script = (tree(architecture) / "DEBIAN/postinst").read_text()
    (left_out,) = re.findall(r"py3compile .*-X '(.*)'", script)
    modules = [path for path in _files(tree(architecture) / "opt") if path.suffix == ".py"]
    for path in (path for path in modules if not re.match(left_out, str(path))):
        compile(path.read_bytes(), str(path), "exec", dont_inherit=True)


@short
def test_command_of_the_tree_runs_wherever_it_lies(tree: Tree) -> None:
    """By whatever the machine calls python3: postinst makes the link that this test makes."""
    system = SYSTEM.readlink().name if SYSTEM.is_symlink() else ""
    if MACHINES[MINE] != platform.machine() or system not in [f"python{p}" for p in PYTHONS]:
        pytest.skip("neither architecture is this machine's, or its Python is none of them")
    python = tree(MINE) / "opt/nondum/bin/python"
    python.symlink_to(f"/usr/bin/{system}")
    command: list[str | Path] = [python, "-I", "-m", "nondum.cli"]
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert "0.1.0" in said.stdout
    completion = (tree(MINE) / "usr/share/bash-completion/completions/nondum").read_text()
    printed = subprocess.run([*command, "completion", "bash"], capture_output=True, text=True)
    assert completion == printed.stdout


@long
def test_every_build_makes_the_same_bytes(package: Package, build: Build, tmp_path: Path) -> None:
    words = ("--arch", "arm64", "--version", "0.1.0+test1")
    checkout = copied(tmp_path / "some where/else", umask=0o077, time_s=1_700_000_000)
    theirs = {"TZ": "Asia/Tokyo", "LC_ALL": "C", "HOME": "/nonexistent"}
    (again,) = build(*words, checkout=checkout, umask=0o077, **theirs).iterdir()
    assert again.read_bytes() == package("arm64").read_bytes()


@long
def test_lintian_has_nothing_to_say(package: Package) -> None:
    if not shutil.which("lintian"):
        pytest.skip("lintian is not installed")
    command: list[str | Path] = ["lintian", "--fail-on", "error,warning", package("arm64")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def _sites(root: Path, python: str) -> list[str]:
    """Where that Python looks, as `site` says of what is in the tree."""
    site = root / SITE.format(python)
    leads_to = (site / "nondum.pth").read_text().strip()
    return [str(site), str((site / leads_to).resolve())]


def _field(deb: Path, name: str) -> str:
    command: list[str | Path] = ["dpkg-deb", "-f", deb, name]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def _files(root: Path) -> list[Path]:
    return [path for path in root.rglob("*") if path.is_file() and not path.is_symlink()]
