"""A payload that brings no component, only data: what `nondum payload data` writes on a drive."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.build import build
from nondum.wheelhouse.build.build import Progress
from nondum.wheelhouse.format import contents, data, index, manifest, names

_OTHER = re.compile(r"[^a-z0-9]+")


def name_of(path: Path) -> str:
    """What data are called that are in a file or folder, unless somebody names them.

    >>> name_of(Path("models/YOLO v8_nano.onnx"))
    'yolo-v8-nano'
    """
    return _OTHER.sub("-", path.resolve().stem.lower()).strip("-")[:63]


def write(
    drive: Path,
    payload_id: str,
    brought: Sequence[Path],
    *,
    name: str,
    kind: str,
    version: str = "1",
    release: int | None = None,
    fleet: str = "",
    hosts: tuple[str, ...] = (),
    progress: Progress = lambda what, done, total: None,
    finish: Callable[[Path], object] = lambda folder: None,
) -> Path:
    """Write one of files, and of all that is in folders, and return its folder; replaces one of
    the same id. `finish` is done to it before a drive has it: signing.

    Raises `PayloadRefused` with what is wrong with the names, `InstallFailed`.
    """
    files = _files(brought)
    listed = ", ".join(f'"{path}"' for path in files)
    text = (
        f'id = "{payload_id}"\nname = "{name}"\n\n'
        f'[[data]]\nname = "{name}"\nkind = "{kind}"\nversion = "{version}"\nfiles = [{listed}]\n'
    )
    manifest.parse(text, manifest.NAME)
    with tempfile.TemporaryDirectory(prefix="nondum-data-") as temporary:
        folder = Path(temporary) / payload_id
        folder.mkdir()
        build.link_data(folder, {f"{data.FOLDER}/{name}/{path}": at for path, at in files.items()})
        (folder / manifest.NAME).write_text(text, encoding="utf-8")
        (folder / index.NAME).write_bytes(index.to_bytes({}))
        build.seal(folder, payload_id, version, release, fleet=fleet, hosts=hosts)
        finish(folder)
        return build.deliver(folder, drive, progress)


def _files(brought: Sequence[Path]) -> Mapping[str, Path]:
    """Path below the data's folder → where the file is. Raises `PayloadRefused`."""
    found: dict[str, Path] = {}
    for path in brought:
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        base = path if path.is_dir() else path.parent
        for file in inside:
            if not file.is_file():
                continue
            name = file.relative_to(base).as_posix()
            if flaw := names.path_flaw(name):
                _refuse("PATH_UNSAFE", f"{flaw}", str(file), "rename it")
            if name in found:
                text = f"two files would be called {name}"
                _refuse("MANIFEST_TWICE", text, str(file), "rename one, or give a folder of both")
            if file.stat().st_size > contents.MAX_FILE_BYTES:
                _refuse("TOO_LARGE", "is longer than 8 GiB", str(file), "split it")
            found[name] = file
    if not found:
        _refuse("FILE_MISSING", "there is no file in it", str(brought[0]), "give files")
    return found


def _refuse(code: str, text: str, where: str, fix: str) -> None:
    raise PayloadRefused(Problem(code, text, where=where, fix=fix))
