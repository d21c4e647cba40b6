"""Payloads that are wrong, each in one way."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tests.kit.host import LAMP
from tests.kit.payloads import Part, make_payload, make_wheel, manifest_text, seal

from nondum.host.core.records.step import Step
from nondum.sdk.description import PluginDescription

BAD = "org.example.bad"
NOTHING = PluginDescription(name="test-bad", version="1.0")


def bare(source: str) -> Part:
    """A plugin whose index says nothing, whatever its source does."""
    return Part("bad", source, description=NOTHING)


def spoil(change: Callable[[Path], None]) -> Callable[[Path], None]:
    """A sound payload that something happened to afterwards."""

    def write(drive: Path) -> None:
        change(make_payload(drive, Part("bad", LAMP), payload_id=BAD))

    return write


def of(part: Part, **options: Any) -> Callable[[Path], None]:
    def write(drive: Path) -> None:
        make_payload(drive, part, payload_id=BAD, **options)

    return write


def flip(folder: Path) -> None:
    wheel = next((folder / "wheels").glob("test_bad-*.whl"))
    data = bytearray(wheel.read_bytes())
    with zipfile.ZipFile(wheel) as archive:
        plugin = next(entry for entry in archive.infolist() if entry.filename.endswith(".py"))
    data[plugin.header_offset + 30 + len(plugin.filename) + plugin.compress_size // 2] ^= 0xFF
    wheel.write_bytes(data)


def flip_and_seal(folder: Path) -> None:
    """The list vouches for a wheel that is damaged inside."""
    flip(folder)
    lock = folder / "pylock.bad.toml"
    wheel = next((folder / "wheels").glob("test_bad-*.whl"))
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    lines = lock.read_text().splitlines()
    after = next(i for i, line in enumerate(lines) if wheel.name in line and "path" in line)
    at = next(i for i in range(after, len(lines)) if "sha256" in lines[i])
    lines[at] = f'hashes = {{ sha256 = "{digest}" }}'
    lock.write_text("\n".join(lines))
    seal(folder, payload_id=BAD)


def without_list(folder: Path) -> None:
    (folder / "CONTENTS").unlink()


def with_link(folder: Path) -> None:
    index = folder / "index.json"
    index.rename(folder / "real.json")
    index.symlink_to("real.json")


def without_wheel(folder: Path) -> None:
    next((folder / "wheels").glob("test_bad*")).unlink()


def needs_absent(drive: Path) -> None:
    drive.mkdir()
    helper = make_wheel(
        drive, "helper", "1.0", {"helper.py": ""}, requires=["not-on-this-drive>=2"]
    )
    make_payload(drive, replace(bare(""), wheels=[helper]), payload_id=BAD)


def with_hook(drive: Path) -> None:
    part = replace(bare(""), files={"evil.pth": "import os; os.system('touch /tmp/canary')\n"})
    make_payload(drive, part, payload_id=BAD)


def shadowing(drive: Path) -> None:
    make_payload(drive, replace(bare(""), files={"json/__init__.py": ""}), payload_id=BAD)


SLEEPS = "import time\ntime.sleep(3600)\n"
HANGS_AT_START = """from nondum.sdk import hookimpl
@hookimpl
def start(ctx):
    import time
    time.sleep(3600)
"""
RAISES = """from nondum.sdk import hookimpl
@hookimpl
def units():
    raise RuntimeError("no units today")
"""
RAISES_AT_START = """from nondum.sdk import hookimpl
@hookimpl
async def start(ctx):
    raise RuntimeError("cannot start")
"""
EXITS_LATER = """import os
from nondum.sdk import hookimpl
@hookimpl
async def start(ctx):
    ctx.spawn(leave(ctx))
async def leave(ctx):
    await ctx.sleep(0.1)
    os._exit(3)
"""


@dataclass(frozen=True)
class Bad:
    """One way to be wrong."""

    id: str
    write: Callable[[Path], None]
    code: str
    step: Step = Step.REFUSED
    hangs: bool = False
    """Whether it is judged only when the time for its start is over."""


WAYS = (
    Bad(
        "architecture", of(replace(bare(""), tag="cp311-cp311-linux_riscv64")), "WHEEL_INCOMPATIBLE"
    ),
    Bad("python", of(bare(""), requires='python = ">=3.99"'), "PYTHON_VERSION"),
    Bad("memory", of(bare(""), requires="memory_mb = 99999999"), "NO_MEMORY"),
    Bad("gpu", of(bare(""), requires="gpu_memory_mb = 99999999"), "NO_GPU_MEMORY"),
    Bad("disk", of(bare(""), requires="disk_mb = 999999999"), "DISK_FULL"),
    Bad("confinement", of(bare(""), requires="confinement = 3"), "CONFINEMENT"),
    Bad("dependency", needs_absent, "LOCK_INCOMPLETE"),
    Bad("toml", of(bare(""), manifest="id = [\n"), "MANIFEST_TOML"),
    Bad("unknown-key", of(replace(bare(""), manifest="colour = 1")), "MANIFEST_KEY"),
    Bad("wrong-type", of(bare(""), requires='disk_mb = "much"'), "MANIFEST_VALUE"),
    Bad("no-component", of(bare(""), manifest=f'id = "{BAD}"\nname = "x"\n'), "MANIFEST_KEY"),
    Bad(
        "wrong-id", of(bare(""), manifest=manifest_text("Not An Id", [bare("")])), "MANIFEST_VALUE"
    ),
    Bad("index-format", of(bare(""), index={"format": 99}), "INDEX_INVALID"),
    Bad("index-empty", of(bare(""), index={"format": 1, "components": {}}), "INDEX_INVALID"),
    Bad("no-list", spoil(without_list), "CONTENTS_MISSING"),
    Bad("flipped-byte", spoil(flip), "HASH_MISMATCH"),
    Bad("damaged-wheel", spoil(flip_and_seal), "WHEEL_RECORD"),
    Bad("missing-file", spoil(without_wheel), "FILE_MISSING"),
    Bad("symlink", spoil(with_link), "PATH_UNSAFE"),
    Bad("startup-hook", with_hook, "WHEEL_STARTUP_HOOK"),
    Bad("shadowing", shadowing, "WHEEL_SHADOWS"),
    Bad("import", of(bare("import no_such_module")), "IMPORT_FAILED", Step.QUARANTINED),
    Bad("hook", of(bare(RAISES)), "HOOK_FAILED", Step.QUARANTINED),
    Bad("start", of(bare(RAISES_AT_START)), "HOOK_FAILED", Step.QUARANTINED),
    Bad("lie", of(Part("bad", LAMP, description=NOTHING)), "INDEX_MISMATCH", Step.QUARANTINED),
    Bad("hang", of(bare(SLEEPS)), "WORKER_HUNG", Step.QUARANTINED, hangs=True),
    Bad("hang-at-start", of(bare(HANGS_AT_START)), "WORKER_HUNG", Step.QUARANTINED, hangs=True),
    Bad("exit", of(bare("import os\nos._exit(3)")), "WORKER_START_FAILED", Step.QUARANTINED),
)
