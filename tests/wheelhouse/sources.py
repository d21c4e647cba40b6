"""Source folders of plugins that build without an index: their build backend lies beside."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

PLUGIN = '''
from nondum.sdk import Context, Fragment, Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("lamp", "light"),)

@hookimpl
def fragments():
    shine = "(:action shine :parameters (?u - light) :precondition (ready ?u))"
    return (Fragment("domain.pddl", f"(define (domain lamp) {shine})"),)

@behaviour("shine", action="(shine ?u - light)")
async def shine(ctx: Context, u: str) -> None:
    """Shine."""
'''

BACKEND = '''
"""Builds a wheel of the modules beside it, from `wheel.json`."""
import base64, hashlib, json, zipfile
from pathlib import Path

def build_wheel(folder, config_settings=None, metadata_directory=None):
    said = json.loads(Path("wheel.json").read_text())
    if said["fail"]:
        raise SystemExit(said["fail"])
    stem = f"{said['name'].replace('-', '_')}-{said['version']}"
    info = f"{stem}.dist-info"
    files = {path: Path(path).read_bytes() for path in said["files"]}
    lines = ["Metadata-Version: 2.1", f"Name: {said['name']}", f"Version: {said['version']}"]
    lines += [f"Requires-Dist: {r}" for r in said["requires"]]
    files[f"{info}/METADATA"] = ("\\n".join(lines) + "\\n").encode()
    wheel = ["Wheel-Version: 1.0", "Generator: t", "Root-Is-Purelib: true", "Tag: py3-none-any"]
    files[f"{info}/WHEEL"] = ("\\n".join(wheel) + "\\n").encode()
    files[f"{info}/entry_points.txt"] = said["entry_points"].encode()
    rows = []
    for path, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        rows.append(f"{path},sha256={digest},{len(data)}")
    files[f"{info}/RECORD"] = ("\\n".join([*rows, f"{info}/RECORD,,"]) + "\\n").encode()
    name = f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(Path(folder) / name, "w") as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path, (2026, 1, 1, 0, 0, 0)), data)
    return name
'''


def make_source(
    folder: Path,
    name: str = "blinker",
    *,
    files: Mapping[str, str] | None = None,
    requires: Sequence[str] = ("nondum-sdk",),
    entry_points: Mapping[str, str] | None = None,
    components: Sequence[str] = (),
    fail: str = "",
) -> Path:
    """A plugin's source folder; its only module is `plugin_<name>.py` unless `files` differ."""
    module = f"plugin_{name.replace('-', '_')}"
    sources = {f"{module}.py": PLUGIN} if files is None else files
    points = {name: module} if entry_points is None else entry_points
    folder.mkdir(parents=True)
    for path, text in sources.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    (folder / "pyproject.toml").write_text(
        "[build-system]\nrequires = []\n"
        'build-backend = "tiny_backend"\nbackend-path = ["."]\n'
        f'[project]\nname = "{name}"\nversion = "1.0"\n'
    )
    (folder / "tiny_backend.py").write_text(BACKEND)
    lines = "\n".join(f"{key} = {value}" for key, value in points.items())
    said = {
        "name": name,
        "version": "1.0",
        "files": list(sources),
        "requires": list(requires),
        "entry_points": f"[nondum.plugins]\n{lines}\n",
        "fail": fail,
    }
    (folder / "wheel.json").write_text(json.dumps(said))
    tables = "".join(
        f'[[component]]\nid = "{component}"\ndistribution = "{name}"\n'
        for component in (components or (name,))
    )
    (folder / "payload.toml").write_text(
        f'id = "org.example.{name}"\nname = "{name}"\n[requires]\n{tables}'
    )
    return folder
