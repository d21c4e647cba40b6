"""Payload folders made on the spot: tiny wheels, locks, manifest, index and contents list, no pip.

    folder = make_payload(tmp_path / "drive", Part("blinker", source=BLINKER, description=...))

What a plugin needs at run time (nondum-sdk, pluggy, msgpack) is wheeled once a session from what
this interpreter has installed or, for the SDK, from its source folder.
"""

from __future__ import annotations

import atexit
import base64
import functools
import hashlib
import importlib.metadata
import json
import os
import shutil
import tempfile
import types
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from nondum.sdk.description import PluginDescription
from nondum.sdk.plugin import describe, load
from nondum.wheelhouse.format.contents import Contents, Entry

SDK = Path(__file__).parents[2] / "plugins/sdk"
NOT_IN_WHEELS = {"INSTALLER", "REQUESTED", "RECORD", "direct_url.json"}


@dataclass(frozen=True)
class Part:
    """One component of a payload, and the plugin that it is."""

    id: str
    source: str
    """Source of the plugin's only module."""
    description: PluginDescription | None = None
    """What `index.json` says; None: what the plugin says."""
    version: str = "1.0"
    wheels: Sequence[Path] = ()
    """Further wheels in its lock."""
    tag: str = "py3-none-any"
    files: Mapping[str, str] = field(default_factory=dict)
    """Further files in the plugin's wheel."""
    manifest: str = ""
    """Further lines of its `[[component]]` table."""
    with_sdk: bool = True

    @property
    def distribution(self) -> str:
        """Name of its distribution."""
        return f"test-{self.id}"

    @property
    def module(self) -> str:
        """Name of its module."""
        return self.distribution.replace("-", "_")

    @property
    def index(self) -> PluginDescription:
        """What the plugin says about itself."""
        return self.description or self._described()

    def _described(self) -> PluginDescription:
        """What the plugin answers, asked in this process."""
        module = types.ModuleType(self.module)
        exec(compile(self.source, f"{self.module}.py", "exec"), module.__dict__)
        described = describe(load(module, self.distribution))
        return replace(described, version=self.version)


def make_payload(
    drive: Path,
    *parts: Part,
    payload_id: str = "org.example.test",
    version: str = "1.0",
    release: int = 1,
    requires: str = "",
    manifest: str | None = None,
    index: Mapping[str, Any] | None = None,
) -> Path:
    """Write `<drive>/nondum/<payload_id>` and return it. Whatever is given replaces the default."""
    folder = drive / "nondum" / payload_id
    wheels = folder / "wheels"
    wheels.mkdir(parents=True)
    for part in parts:
        locked = [
            make_wheel(
                wheels,
                part.distribution,
                part.version,
                {f"{part.module}.py": part.source, **part.files},
                tag=part.tag,
                entry_points={"nondum.plugins": {part.id: part.module}},
            ),
            *(_copied(wheel, wheels) for wheel in (*part.wheels, *_sdk_wheels(part.with_sdk))),
        ]
        (folder / f"pylock.{part.id}.toml").write_text(lock_text(locked), encoding="utf-8")
    text = manifest if manifest is not None else manifest_text(payload_id, parts, requires)
    (folder / "payload.toml").write_text(text, encoding="utf-8")
    described = {part.id: part.index.to_dict() for part in parts}
    document = index if index is not None else {"format": 1, "components": described}
    (folder / "index.json").write_text(json.dumps(document), encoding="utf-8")
    seal(folder, payload_id=payload_id, version=version, release=release)
    return folder


def seal(folder: Path, *, payload_id: str, version: str = "1.0", release: int = 1) -> None:
    """Write the contents list of what now lies in a payload folder."""
    files = sorted(
        (p for p in folder.rglob("*") if p.is_file() and p.name != "CONTENTS"),
        key=lambda path: path.relative_to(folder).as_posix(),
    )
    entries = tuple(
        Entry(sha256=sha256(p), size=p.stat().st_size, path=p.relative_to(folder).as_posix())
        for p in files
    )
    contents = Contents(
        payload_id=payload_id,
        version=version,
        release=release,
        fleet="",
        minimum_nondum="0.1",
        built="2026-01-01T00:00:00Z",
        entries=entries,
    )
    (folder / "CONTENTS").write_bytes(contents.to_bytes())


def manifest_text(payload_id: str, parts: Sequence[Part], requires: str = "") -> str:
    """A plain `payload.toml`."""
    components = "".join(
        f'\n[[component]]\nid = "{part.id}"\ndistribution = "{part.distribution}"\n{part.manifest}'
        for part in parts
    )
    return (
        f'id = "{payload_id}"\nname = "Test"\nsummary = "Made by a test"\n'
        f'authors = ["Test"]\nlicence = "Apache-2.0"\nhomepage = "https://example.org"\n'
        f"\n[requires]\n{requires}\n{components}"
    )


def make_wheel(
    folder: Path,
    name: str,
    version: str,
    files: Mapping[str, str | bytes],
    *,
    tag: str = "py3-none-any",
    requires: Sequence[str] = (),
    entry_points: Mapping[str, Mapping[str, str]] | None = None,
) -> Path:
    """Write a wheel of the given files, with metadata and RECORD as the specification says."""
    stem = f"{name.replace('-', '_')}-{version}"
    info = f"{stem}.dist-info"
    members: dict[str, bytes] = {
        path: text.encode() if isinstance(text, str) else text for path, text in files.items()
    }
    needed = "".join(f"Requires-Dist: {r}\n" for r in requires)
    members[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needed}".encode()
    )
    members[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\n{_tag_lines(tag)}".encode()
    )
    if entry_points:
        groups = (
            f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in points.items())
            for group, points in entry_points.items()
        )
        members[f"{info}/entry_points.txt"] = "\n".join(groups).encode()
    return _write_wheel(folder / f"{stem}-{tag}.whl", members, record=f"{info}/RECORD")


def lock_text(wheels: Sequence[Path]) -> str:
    """A PEP 751 lock of wheels that lie in `wheels/` beside it."""
    packages = []
    for wheel in wheels:
        name, version = wheel.name.split("-")[:2]
        packages.append(
            f'[[packages]]\nname = "{name.replace("_", "-").lower()}"\nversion = "{version}"\n'
            f'[[packages.wheels]]\nname = "{wheel.name}"\npath = "wheels/{wheel.name}"\n'
            f'size = {wheel.stat().st_size}\nhashes = {{ sha256 = "{sha256(wheel)}" }}\n'
        )
    return 'lock-version = "1.0"\ncreated-by = "test"\n\n' + "\n".join(packages)


def sha256(path: Path) -> str:
    """Hex digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


@functools.cache
def sdk_wheel() -> Path:
    """The SDK of this source tree as a wheel."""
    package = SDK / "nondum/sdk"
    files = {
        f"nondum/sdk/{p.relative_to(package).as_posix()}": p.read_bytes()
        for p in package.rglob("*")
        if p.is_file() and p.suffix != ".pyc"
    }
    needed = ("pluggy>=1.5", "msgpack>=1.1")
    return make_wheel(_cache(), "nondum-sdk", "0.1.0", files, requires=needed)


@functools.cache
def installed_wheel(name: str) -> Path:
    """A distribution of this interpreter, put back into the wheel that it came from."""
    distribution = importlib.metadata.distribution(name)
    members = {}
    for file in distribution.files or ():
        if ".." in file.parts or file.suffix == ".pyc" or file.name in NOT_IN_WHEELS:
            continue
        members[file.as_posix()] = Path(str(distribution.locate_file(file))).read_bytes()
    info = next(path.split("/")[0] for path in members if path.endswith(".dist-info/WHEEL"))
    lines = members[f"{info}/WHEEL"].decode().splitlines()
    tags = [line.removeprefix("Tag: ").split("-") for line in lines if line.startswith("Tag: ")]
    tag = "-".join(".".join(sorted(set(column))) for column in zip(*tags, strict=True))
    target = _cache() / f"{info.removesuffix('.dist-info')}-{tag}.whl"
    return _write_wheel(target, members, record=f"{info}/RECORD")


def _sdk_wheels(wanted: bool) -> tuple[Path, ...]:
    if not wanted:
        return ()
    return sdk_wheel(), installed_wheel("pluggy"), installed_wheel("msgpack")


def _copied(wheel: Path, folder: Path) -> Path:
    target = folder / wheel.name
    if not target.exists():
        target.write_bytes(wheel.read_bytes())
    return target


def _write_wheel(target: Path, members: Mapping[str, bytes], *, record: str) -> Path:
    rows = [f"{path},sha256={_record_hash(data)},{len(data)}" for path, data in members.items()]
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in members.items():
            archive.writestr(zipfile.ZipInfo(path, (2026, 1, 1, 0, 0, 0)), data)
        listing = "\n".join([*rows, f"{record},,"]) + "\n"
        archive.writestr(zipfile.ZipInfo(record, (2026, 1, 1, 0, 0, 0)), listing)
    return target


def _record_hash(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def _tag_lines(tag: str) -> str:
    interpreters, abis, platforms = (part.split(".") for part in tag.split("-"))
    return "".join(f"Tag: {i}-{a}-{p}\n" for i in interpreters for a in abis for p in platforms)


@functools.cache
def _cache() -> Path:
    folder, maker = Path(tempfile.mkdtemp(prefix="nondum-test-wheels-")), os.getpid()

    def remove() -> None:
        if os.getpid() == maker:  # not a child that was forked
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder
