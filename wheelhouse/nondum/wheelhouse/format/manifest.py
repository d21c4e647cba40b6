"""`payload.toml`: what a payload is, what it needs, and which components it brings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import Any

from packaging.specifiers import InvalidSpecifier, SpecifierSet

from nondum.sdk.description import DeviceNeed
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import confinement, data, limits, names, tables
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.data import BroughtData, DataNeed
from nondum.wheelhouse.format.device_rules import wrong_rules
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.format.tables import Form, Report, Table

NAME = "payload.toml"
GPU_KINDS = ("cuda", "opencl", "rocm", "v3d")
"""Ways in which programs use a GPU: NVIDIA's, Khronos', AMD's, and a Raspberry Pi's."""
PERMISSIONS = ("audio", "devices", "gpu", "network")
"""What components may ask for."""
GOALS = "goals"
"""The permission to give a host goals, which a payload asks for by having a goal.txt."""
DATA = "data"
"""The permission to bring data that components of other payloads read, too."""
GRANTABLE = (*PERMISSIONS, GOALS, DATA)
"""What a role may give."""

PAYLOAD_ID = Form(names.PAYLOAD_ID, "a reverse domain name like org.example.blinker")
_GPU_KIND = Form(re.compile(f"({'|'.join(GPU_KINDS)})?"), f"one of {', '.join(GPU_KINDS)}")
COMPONENT_ID = Form(
    names.COMPONENT_ID, "a component's id: lower-case letters, digits and single hyphens"
)
_DISTRIBUTION = Form(
    re.compile(r"[a-z0-9]+(-[a-z0-9]+)*"), "a normalised distribution name like my-plugin"
)
_LOCAL_NAME = Form(
    re.compile(r"[a-z0-9][a-z0-9_-]{0,62}"), "a name of lower-case letters, digits, _ and -"
)


@frozen
class Requires:
    """What a host must have."""

    python: str = ""
    """Version specifier (PEP 440); empty: any that the lock has wheels for."""
    disk_mb: int = 0
    memory_mb: int = 0
    """Of all its components together: at least the sum of what each of them asks for."""
    gpu_memory_mb: int = 0
    gpu_kind: str = ""
    """Of `GPU_KINDS`; empty: any GPU will do, if one is asked for."""
    confinement: Level = Level.NONE
    """The least level that its workers may run at."""
    alone: bool = False
    """Whether no other release of it may run beside it: an upgrade stops the old one first."""


@frozen
class UnitMount:
    """Where a unit sits by default on a body (REP-103; metres, radians)."""

    name: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]


@frozen
class ComponentManifest:
    """One component as its author packs it."""

    id: str
    distribution: str
    devices: tuple[DeviceNeed, ...] = ()
    units: tuple[UnitMount, ...] = ()
    permissions: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    limits: WorkerLimits = WorkerLimits()
    """What it asks for instead of what a host gives each worker."""
    data: tuple[DataNeed, ...] = ()


@frozen
class Manifest:
    """A parsed `payload.toml`."""

    id: str
    name: str
    summary: str
    authors: tuple[str, ...]
    licence: str
    homepage: str
    requires: Requires
    components: tuple[ComponentManifest, ...]
    data: tuple[BroughtData, ...] = ()
    startup_hooks: tuple[str, ...] = ()
    """Files of wheels that an interpreter would run at its start: their packer knows that workers
    do not, and that they are left out."""


def parse(text: str, where: str, *, brings_goals: bool = False) -> Manifest:
    """Check and parse a manifest; a payload that brings goals or data need not bring components.

    Raises `PayloadRefused` with everything wrong in it.
    """
    root, report = tables.read(text, "MANIFEST", where)
    requires = _requires(root.table("requires"))
    brought = tuple(data.parse(table) for table in root.tables("data"))
    brings_more = brings_goals or bool(brought)
    components = tuple(
        _component(table) for table in root.tables("component", required=not brings_more)
    )
    manifest = Manifest(
        id=root.text("id", PAYLOAD_ID),
        name=root.text("name"),
        summary=root.text("summary", default=""),
        authors=root.texts("authors"),
        licence=root.text("licence", default=""),
        homepage=root.text("homepage", default=""),
        requires=replace(requires, memory_mb=max(requires.memory_mb, _asked_mb(components))),
        components=components,
        data=brought,
        startup_hooks=root.texts("startup_hooks"),
    )
    root.close()
    if not (manifest.components or brings_more or report.problems):
        report.add("KEY", "a payload brings at least one [[component]] or [[data]]")
    tell_twice(report, "data", (d.name for d in manifest.data))
    tell_twice(report, "component", (c.id for c in manifest.components))
    for component in manifest.components:
        tell_twice(report, f"device of {component.id}", (d.name for d in component.devices))
        tell_twice(report, f"unit of {component.id}", (u.name for u in component.units))
        tell_twice(report, f"data of {component.id}", (d.name for d in component.data))
    report.raise_if_any()
    return manifest


def _requires(table: Table) -> Requires:
    gpu = table.table("gpu")
    kind = gpu.text("kind", _GPU_KIND, default=table.text("gpu_kind", _GPU_KIND, default=""))
    memory_mb = gpu.integer("memory_mb", table.integer("gpu_memory_mb", 0))
    gpu.close()
    requires = Requires(
        python=table.text("python", default=""),
        disk_mb=table.integer("disk_mb", 0),
        memory_mb=table.integer("memory_mb", 0),
        gpu_memory_mb=memory_mb,
        gpu_kind=kind,
        confinement=table.parsed("confinement", confinement.parse, Level.NONE),
        alone=table.flag("alone"),
    )
    try:
        SpecifierSet(requires.python)
    except InvalidSpecifier:
        table.wrong("python", f"{requires.python!r} is not a version specifier like '>=3.11'")
    table.close()
    return requires


def _component(table: Table) -> ComponentManifest:
    component = ComponentManifest(
        id=table.text("id", COMPONENT_ID),
        distribution=table.text("distribution", _DISTRIBUTION),
        devices=tuple(_device(device) for device in table.tables("device")),
        units=tuple(_unit(unit) for unit in table.tables("unit")),
        permissions=table.texts("permissions"),
        settings=table.free("settings"),
        limits=limits.parse(table.optional_table("limits")),
        data=tuple(data.parse_need(need) for need in table.tables("data")),
    )
    for permission in component.permissions:
        if permission not in PERMISSIONS:
            known = f"known: {', '.join(PERMISSIONS)}"
            table.wrong("permissions", f"there is no permission {permission!r}", known)
    table.close()
    return component


def _asked_mb(components: Iterable[ComponentManifest]) -> int:
    return sum(component.limits.memory_mb or 0 for component in components)


def _device(table: Table) -> DeviceNeed:
    need = DeviceNeed(
        name=table.text("name", _LOCAL_NAME),
        match=table.strings("match"),
        optional=table.flag("optional"),
    )
    for message, fix in wrong_rules(need.match):
        table.wrong("match", message, fix)
    table.close()
    return need


def _unit(table: Table) -> UnitMount:
    x, y, z = table.numbers("xyz", 3)
    roll, pitch, yaw = table.numbers("rpy", 3)
    mount = UnitMount(table.text("name", _LOCAL_NAME), (x, y, z), (roll, pitch, yaw))
    table.close()
    return mount


def tell_twice(report: Report, what: str, ids: Iterable[str]) -> None:
    """Note each that stands twice."""
    seen: set[str] = set()
    for id in ids:
        if id and id in seen:
            report.add("TWICE", f"{what} {id!r} stands twice")
        seen.add(id)
