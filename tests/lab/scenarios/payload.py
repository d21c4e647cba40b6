"""A payload of one's own (`nondum lab`) is plugged in, shown and pulled; nothing of it is left."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.daemon.plugins import talker
from tests.lab.drives import fat_stick
from tests.lab.followed import Followed
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.leftovers import seen, until_as_before

CONTENTS = "CONTENTS"
SHOWN = ("status", "components", "behaviours", "goals")
"""What the host is asked when the payload is active."""


def run(lab: Lab) -> str:
    """Without one, the talker of other scenarios is taken."""
    content = lab.folder() / "files"
    _take(lab.brought or lab.payload("talker", talker()), content / "nondum")
    names = sorted(folder.name for folder in (content / "nondum").iterdir())
    host = Followed.follow(lab.host())
    before = host.machine.until("an answer", lambda: seen(host))
    stick = host.bring(fat_stick(content.parent / "stick.img", content), names[0])
    for name in names[1:]:
        host.until_payload(name, "active")
    print(*(_shown(host, what) for what in SHOWN), sep="\n", flush=True)
    host.machine.pull(stick)
    until_as_before(host, before)
    return ", ".join(names)


def _take(source: Path, target: Path) -> None:
    """Copy the payloads of a drive, or the one payload that a folder is."""
    if (source / CONTENTS).is_file():
        shutil.copytree(source, target / source.name)
    else:
        shutil.copytree(source / "nondum", target)


def _shown(host: Installed, what: str) -> str:
    return f"$ nondum {what}\n{host.machine.attempt(f'nondum {what}').out}"
