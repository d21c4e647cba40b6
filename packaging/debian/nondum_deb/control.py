"""What dpkg is told of the package: deb-control(5), and documents that policy asks for."""

from __future__ import annotations

import hashlib
import time
from email.utils import formatdate
from importlib.metadata import PathDistribution
from pathlib import Path

from nondum_deb.architecture import Architecture
from nondum_deb.places import CHECKOUT, DEBIAN, PYTHONS
from nondum_deb.tree import DOCS, SHARED, SITES, compress

AFTER_THE_NEWEST = f"3.{int(PYTHONS[-1].removeprefix('3.')) + 1}"
MAINTAINER = "The nondum project <nondum@example.org>"
DEPENDS = (
    *(f"python3 (>= {PYTHONS[0]}~)", f"python3 (<< {AFTER_THE_NEWEST}~)"),
    *("libc6 (>= 2.36)", "libgcc-s1", "libstdc++6"),
    "zlib1g",
    *("init-system-helpers (>= 1.54)", "systemd (>= 252)", "udev", "libudev1", "bubblewrap"),
)
"""bubblewrap as well: without it workers are held in by less."""
RECOMMENDS = ("libusb-1.0-0",)
"""What devices without a driver of the kernel are read with."""
SUGGESTS = ("openssh-client",)
CONTROL = """\
Package: nondum
Version: {version}
Architecture: {architecture}
Maintainer: {maintainer}
Installed-Size: {kilobytes}
Depends: {depends}
Recommends: {recommends}
Suggests: {suggests}
Section: misc
Priority: optional
Description: rebuild a robot in the field: plug in a payload, and it plans with it
 A host that takes payloads (signed software on USB drives, devices, other
 computers) while it runs: it verifies and installs them offline, confines each
 in a separate process, merges what they say of themselves into one planning
 domain, and reaches goals with what there is. Pulled payloads leave nothing.
 .
 The daemon runs as a service, as the user nondum. It comes with its own
 Python environment under /opt/nondum, for each Python that it can be run by,
 and needs no network.
"""
CHANGELOG = """\
nondum ({version}) stable; urgency=medium

  * What is new is told in CHANGELOG.md.

 -- {maintainer}  {date}
"""
COPYRIGHT = """\
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: nondum
Comment:
 /opt/nondum holds Python distributions of others beside nondum's own; each has
 the text of its licence in its folder that ends in .dist-info.

Files: *
Copyright: {year} The nondum project
License: Apache-2.0

{others}
License: Apache-2.0
 On Debian systems, the full text of the Apache License, Version 2.0 can be
 found in the file /usr/share/common-licenses/Apache-2.0.
"""
OTHERS = """\
Files: opt/nondum/lib/*/{folder}/*
Copyright: {year} the authors of {name} {version}, and before
License: {licence}
Comment: its code lies beside that folder, which holds the text of the licence.
"""
SCRIPTS = ("postinst", "prerm", "postrm")
TRIGGERS = "interest-noawait /usr/bin/python3\n"
"""What dpkg calls postinst for besides: the system has another Python (deb-triggers(5))."""


def write(root: Path, version: str, architecture: Architecture, epoch: int) -> None:
    """Add DEBIAN/ and the documents to a finished tree."""
    _documents(root, version, epoch)
    control = root / "DEBIAN"
    files = sorted(p for p in root.rglob("*") if p.is_file() and not p.is_symlink())
    control.mkdir()
    sums = (f"{hashlib.md5(p.read_bytes()).hexdigest()}  {p.relative_to(root)}\n" for p in files)
    (control / "md5sums").write_text("".join(sums), encoding="utf-8")
    conffiles = (f"/{p.relative_to(root)}\n" for p in files if p.is_relative_to(root / "etc"))
    (control / "conffiles").write_text("".join(conffiles), encoding="utf-8")
    text = CONTROL.format(
        version=version,
        architecture=architecture.debian,
        maintainer=MAINTAINER,
        kilobytes=sum(-(-p.stat().st_size // 1024) for p in files),
        depends=", ".join(DEPENDS),
        recommends=", ".join(RECOMMENDS),
        suggests=", ".join(SUGGESTS),
    )
    (control / "control").write_text(text, encoding="utf-8")
    (control / "triggers").write_text(TRIGGERS, encoding="utf-8")
    for name in SCRIPTS:
        (control / name).write_bytes((DEBIAN / "scripts" / name).read_bytes())
        (control / name).chmod(0o755)


def _documents(root: Path, version: str, epoch: int) -> None:
    folder = root / DOCS
    date = formatdate(epoch)
    text = CHANGELOG.format(version=version, maintainer=MAINTAINER, date=date)
    compress(text, folder / "changelog.gz")
    compress((CHECKOUT / "CHANGELOG.md").read_text(encoding="utf-8"), folder / "CHANGELOG.md.gz")
    (folder / "copyright").write_text(_copyright(root, epoch), encoding="utf-8")


def _copyright(root: Path, epoch: int) -> str:
    others = []
    sites = (root / site for site in (SHARED, *SITES.values()))
    folders = {folder.name: folder for site in sites for folder in site.glob("*.dist-info")}
    for _, folder in sorted(folders.items()):
        told = PathDistribution(folder).metadata
        given = (told[key] for key in ("License-Expression", "License") if key in told)
        licence = next(filter(None, given), "see its folder")
        others.append(
            OTHERS.format(
                folder=folder.name,
                year=time.gmtime(epoch).tm_year,
                name=told["Name"],
                version=told["Version"],
                licence=licence.strip().splitlines()[0][:80],
            )
        )
    return COPYRIGHT.format(year=time.gmtime(epoch).tm_year, others="\n".join(others))
