"""Settings of components as this host's integrator has them, over those of their payloads.

A file apart from the configuration, since keys to servers may be in it, and read again for each
payload. It has the form of payload.toml:

    [[component]]
    payload = "org.example.lamp"
    id = "lamp"
    settings = { brightness = 0.5 }
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from nondum.host.config import parsing
from nondum.sdk.errors import ConfigRefused, PayloadRefused
from nondum.wheelhouse.format import manifest, tables
from nondum.wheelhouse.format.tables import Table

ComponentSettings: TypeAlias = Mapping[tuple[str, str], Mapping[str, Any]]
"""Id of a payload, and of a component in it → its settings."""


def load(path: Path | None) -> ComponentSettings:
    """Read the file; None: there is none. Raises `ConfigRefused` with everything wrong in it."""
    return {} if path is None else parse(parsing.read(path), str(path))


def parse(text: str, where: str) -> ComponentSettings:
    """Read the text of one. Raises `ConfigRefused` with everything wrong in it."""
    try:
        root, report = tables.read(text, "CONFIG", where)
        found = [_component(table) for table in root.tables("component")]
        root.close()
        manifest.tell_twice(report, "component", (" of ".join(reversed(key)) for key, _ in found))
        report.raise_if_any()
    except PayloadRefused as refused:
        raise ConfigRefused(*refused.problems) from refused
    return dict(found)


def _component(table: Table) -> tuple[tuple[str, str], Mapping[str, Any]]:
    payload = table.text("payload", manifest.PAYLOAD_ID)
    component = table.text("id", manifest.COMPONENT_ID)
    settings = table.free("settings")
    table.close()
    return (payload, component), settings
