"""What the package puts on a machine: a venv under /opt/nondum, units, configuration, completion.

The venv is made without running anything of its architecture: `pip install --target` unpacks wheels
for any, and a venv is little else than a link to Python and a file beside it (PEP 405). It serves
several Pythons: what is the same for all lies in a folder that each one's own leads to by a file of
`site`; the link to the machine's Python is made where the package is configured.
"""

from __future__ import annotations

import csv
import gzip
import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from nondum_deb import lock
from nondum_deb.architecture import Architecture
from nondum_deb.command import PIP, BuildFailed, call
from nondum_deb.places import CHECKOUT, DEBIAN, DISTRIBUTIONS, EXTRAS, PACKAGING, PYTHONS, project

PREFIX = "opt/nondum"
SHARED = f"{PREFIX}/lib/python3/site-packages"
"""What every Python has alike."""
SITES = {python: f"{PREFIX}/lib/python{python}/site-packages" for python in PYTHONS}
"""Where each Python begins to look."""
LEADS_TO_SHARED = "../../python3/site-packages\n"
"""A line of a `.pth` file is a folder, from where that file lies (docs.python.org, `site`)."""
PYVENV = """\
home = /usr/bin
include-system-site-packages = false
"""
LAUNCHER = """\
#!/opt/nondum/bin/python -I
import sys

from nondum.cli import main

sys.exit(main())
"""
"""`-I`: what the caller's folder and variables hold is not run."""
DOCS = "usr/share/doc/nondum"
NOT_INSTALLED = (DEBIAN, PACKAGING / "development")
"""What makes packages and development environments."""
FOLDERS = {
    "systemd": "lib/systemd/system",
    "systemd/user": f"{DOCS}/examples/user",
    "modules-load.d": "usr/lib/modules-load.d",
    "sysusers.d": "usr/lib/sysusers.d",
    "tmpfiles.d": "usr/lib/tmpfiles.d",
    "udev": "lib/udev/rules.d",
    "journald.conf.d": "usr/lib/systemd/journald.conf.d",
}
"""Folders of packaging/, and where on a machine their files belong."""
COMPLETIONS = {
    "bash": "usr/share/bash-completion/completions/nondum",
    "fish": "usr/share/fish/vendor_completions.d/nondum.fish",
    "zsh": "usr/share/zsh/vendor-completions/_nondum",
}


def make(root: Path, architecture: Architecture, own: Path) -> None:
    """Fill an empty folder with all files of the package but those of dpkg. `own` holds the wheels
    that `own_wheels` made."""
    _libraries(root, architecture, own)
    _venv(root)
    _machine_files(root)
    _completions(root)


def own_wheels(folder: Path) -> None:
    """Build the checkout's distributions: they are the same for every architecture.

    Without pip's isolation, which would fetch whatever is the newest to build them with.
    """
    places = [CHECKOUT / place for place in DISTRIBUTIONS]
    with tempfile.TemporaryDirectory(prefix="nondum-backend-") as backend:
        lock.install_backend(Path(backend))
        surroundings = {**os.environ, "PYTHONPATH": backend}
        held = ("--no-deps", "--no-build-isolation", "--no-index")
        call(*PIP, "wheel", *held, "-w", folder, *places, env=surroundings)


def compress(text: str, path: Path) -> None:
    """Write a text as gzip does, but the same whenever and wherever it is written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.encode(), 9, mtime=0))


def _libraries(root: Path, architecture: Architecture, own: Path) -> None:
    for python, site in SITES.items():
        with tempfile.TemporaryDirectory(prefix="nondum-wheels-") as others:
            lock.locked_wheels(architecture, python, Path(others))
            _unpack(root / site, architecture, python, own, Path(others))
        _without_programs(root / site)
    _share(root / SHARED, [root / site for site in SITES.values()])


def _share(shared: Path, sites: Sequence[Path]) -> None:
    """Have those distributions once that are the same in all folders: whole ones, since libraries
    find each other from where they lie."""
    first, *others = sites
    for record in sorted(first.glob("*.dist-info/RECORD")):
        name = record.relative_to(first)
        if all(_is_same(record, other / name) for other in others):
            for path in _recorded(record):
                (shared / path).parent.mkdir(parents=True, exist_ok=True)
                (first / path).rename(shared / path)
                for other in others:
                    (other / path).unlink()
    for site in sites:
        _delete_empty(site)
        _write(site / "nondum.pth", LEADS_TO_SHARED)


def _is_same(record: Path, other: Path) -> bool:
    """Whether two RECORDs tell of the same files: they have the hash of each."""
    return other.exists() and record.read_bytes() == other.read_bytes()


def _recorded(record: Path) -> list[str]:
    with record.open(encoding="utf-8", newline="") as rows:
        return [row[0] for row in csv.reader(rows)]


def _delete_empty(site: Path) -> None:
    folders = [path for path in site.rglob("*") if path.is_dir()]
    for folder in sorted(folders, reverse=True):
        if not any(folder.iterdir()):
            folder.rmdir()


def _unpack(site: Path, architecture: Architecture, python: str, *wheels: Path) -> None:
    places = (f"--find-links={folder}" for folder in wheels)
    wanted = (_requirement(place) for place in DISTRIBUTIONS)
    told = ("--no-index", "--no-compile", "--no-warn-conflicts", *architecture.of_pip(python))
    call(*PIP, "install", "--target", site, *told, *places, *wanted)


def _requirement(place: str) -> str:
    table = project(place)
    extras = ",".join(EXTRAS.get(str(table["name"]), ()))
    return f"{table['name']}[{extras}]=={table['version']}"


def _without_programs(site: Path) -> None:
    """Other people's programs are not nondum's to offer; what was said of them goes, too."""
    shutil.rmtree(site / "bin", ignore_errors=True)
    for record in site.glob("*.dist-info/RECORD"):
        lines = record.read_text(encoding="utf-8").splitlines(keepends=True)
        kept = (line for line in lines if not line.startswith(("../../bin/", "bin/")))
        record.write_text("".join(kept), encoding="utf-8")


def _venv(root: Path) -> None:
    _write(root / PREFIX / "pyvenv.cfg", PYVENV)
    programs = root / PREFIX / "bin"
    _write(programs / "nondum", LAUNCHER, 0o755)
    (root / "usr/bin").mkdir(parents=True)
    (root / "usr/bin/nondum").symlink_to(f"/{PREFIX}/bin/nondum")


def _machine_files(root: Path) -> None:
    for file in (f for f in sorted(PACKAGING.rglob("*")) if f.is_file()):
        if not any(map(file.is_relative_to, NOT_INSTALLED)):
            folder = str(file.parent.relative_to(PACKAGING))
            if folder not in FOLDERS:
                raise BuildFailed(f"{file}: FOLDERS does not say where on a machine this belongs")
            _write(root / FOLDERS[folder] / file.name, file.read_text(encoding="utf-8"))
    _write(root / "etc/nondum/host.toml", (DEBIAN / "host.toml").read_text(encoding="utf-8"))
    overrides = (DEBIAN / "lintian-overrides").read_text(encoding="utf-8")
    _write(root / "usr/share/lintian/overrides/nondum", overrides)
    manual = (DEBIAN / "nondum.1").read_text(encoding="utf-8")
    compress(manual, root / "usr/share/man/man1/nondum.1.gz")


def _completions(root: Path) -> None:
    """As this checkout's own command prints them: they ask nothing of an architecture."""
    command = (sys.executable, "-P", "-m", "nondum.cli", "completion")
    for shell, path in COMPLETIONS.items():
        _write(root / path, call(*command, shell))


def _write(path: Path, text: str, mode: int = 0o644) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)
