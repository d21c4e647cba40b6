"""A folder of packages that apt takes from, if the key signed it that its user was given."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.packages.conftest import ROOT

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, ("apt-get", "apt-ftparchive", "gpg", "dpkg-deb"))),
    reason="apt, apt-utils, gpg or dpkg are not here",
)
MAKER = "maker@example.org"
WRITE = """
import sys
from pathlib import Path
from nondum_deb import repository
repository.write(Path(sys.argv[1]), sys.argv[2])
"""
CONTROL = """\
Package: nondum
Version: {version}
Architecture: all
Maintainer: {maker}
Description: stands for the package
"""


@pytest.fixture
def keys(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """gpg's home, with the maker's key. Its path is short, as that of a socket must be."""
    home = tmp_path_factory.mktemp("k")
    home.chmod(0o700)
    monkeypatch.setenv("GNUPGHOME", str(home))
    words = ("--batch", "--passphrase", "", "--quick-generate-key", MAKER, "ed25519", "sign")
    subprocess.run(["gpg", "--quiet", *words], check=True, capture_output=True)
    return home


def write(place: Path) -> None:
    """As the builder does, which is no distribution that is installed."""
    command = [sys.executable, "-P", "-c", WRITE, str(place), MAKER]
    surroundings = {**os.environ, "PYTHONPATH": str(ROOT / "packaging/debian")}
    subprocess.run(command, env=surroundings, check=True)


@pytest.fixture
def folder(tmp_path: Path, keys: Path) -> Path:
    """A repository with two versions of a package."""
    place = tmp_path / "repository"
    place.mkdir()
    for version in ("0.1.0", "0.2.0"):
        tree = tmp_path / version
        (tree / "DEBIAN").mkdir(parents=True)
        (tree / "DEBIAN/control").write_text(CONTROL.format(version=version, maker=MAKER))
        deb = place / f"nondum_{version}_all.deb"
        subprocess.run(["dpkg-deb", "--build", tree, deb], check=True, capture_output=True)
    write(place)
    return place


def test_apt_finds_and_fetches_each_version(folder: Path, tmp_path: Path) -> None:
    apt = Apt(tmp_path / "apt", folder)
    assert apt.does("update")
    for version in ("0.2.0", "0.1.0"):
        assert apt.does("download", f"nondum={version}")
        fetched = apt.root / f"nondum_{version}_all.deb"
        assert fetched.read_bytes() == (folder / fetched.name).read_bytes()


def test_it_can_be_written_again(folder: Path, tmp_path: Path) -> None:
    (folder / "nondum_0.2.0_all.deb").unlink()
    write(folder)
    apt = Apt(tmp_path / "apt", folder)
    assert apt.does("update")
    assert apt.does("download", "nondum=0.1.0")
    assert not apt.does("download", "nondum=0.2.0")


@pytest.mark.parametrize("changed", ["Packages", "InRelease"])
def test_apt_refuses_what_its_maker_did_not_sign(
    folder: Path, tmp_path: Path, changed: str
) -> None:
    text = (folder / changed).read_text()
    (folder / changed).write_text(text.replace("nondum", "nonsum"))
    assert not Apt(tmp_path / "apt", folder).does("update")


class Apt:
    """This machine's, with a separate state folder and one source."""

    def __init__(self, root: Path, repository: Path) -> None:
        self.root = root
        for place in ("lists/partial", "archives/partial", "none"):
            (root / place).mkdir(parents=True)
        (root / "status").touch()
        (root / "sources.list").write_text(
            f"deb [signed-by={repository}/nondum.asc] file:{repository} ./\n"
        )

    def does(self, *words: str) -> bool:
        """Run apt-get; whether it succeeded."""
        options = {
            "Dir::State": self.root,
            "Dir::State::lists": self.root / "lists",
            "Dir::State::status": self.root / "status",
            "Dir::Etc::sourcelist": self.root / "sources.list",
            "Dir::Etc::sourceparts": self.root / "none",
            "Dir::Cache": self.root,
            "APT::Sandbox::User": "root",
            "APT::Update::Error-Mode": "any",
        }
        told = (f"-o{name}={value}" for name, value in options.items())
        command: list[str] = ["apt-get", "-q", "-y", *told, *words]
        done = subprocess.run(command, cwd=self.root, capture_output=True, text=True)
        return done.returncode == 0
