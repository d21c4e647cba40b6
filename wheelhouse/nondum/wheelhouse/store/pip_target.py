"""What pip installs beside the libraries of wheels, deleted again: a venv has what the store has.

`pip install --target` moves scripts, headers and data into site-packages, where RECORD does not
name them: it says `../../bin/tool` of `bin/tool`. Start-up hooks would run in any interpreter of
the venv.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

from nondum.wheelhouse.wheels import wheel

MOVED = "../../"
"""How RECORD begins the path of a file that pip has moved into site-packages."""


def trim(site_packages: Path) -> None:
    """Delete scripts, headers, data and start-up hooks, and their rows of RECORD."""
    records = {path: _rows(path) for path in site_packages.glob("*.dist-info/RECORD")}
    libraries = {row[0] for rows in records.values() for row in rows if not _is_extra(row[0])}
    for record, rows in records.items():
        for path in (row[0].removeprefix(MOVED) for row in rows if _is_extra(row[0])):
            if path not in libraries:
                _delete(site_packages, path)
        _write(record, [row for row in rows if not _is_extra(row[0])])


def _is_extra(path: str) -> bool:
    return path.startswith(MOVED) or wheel.is_hook(path)


def _delete(root: Path, path: str) -> None:
    """Delete a file, and the folders that are empty without it."""
    file = root / path
    if not file.exists():  # two wheels had it
        return
    file.unlink()
    for folder in file.parents:
        if folder == root or any(folder.iterdir()):
            return
        folder.rmdir()


def _rows(record: Path) -> list[list[str]]:
    return [row for row in csv.reader(io.StringIO(record.read_text(encoding="utf-8"))) if row]


def _write(record: Path, rows: list[list[str]]) -> None:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    record.write_text(text.getvalue(), encoding="utf-8")
