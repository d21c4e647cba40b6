"""What a drive carries: lists, manifests, locks, wheels, indexes."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from packaging.tags import sys_tags
from tests.fuzz.target import LONGEST, Target, of_text, with_endless_numbers
from tests.fuzz.tokens import JSON, TOML
from tests.kit.payloads import lock_text, make_wheel
from tests.wheelhouse.hostile import WHEELS
from tests.wheelhouse.hostile_wheels import NAME, WheelBuilder

from nondum.sdk.description import Behaviour, Fragment, PluginDescription
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import contents, goals, index, lock, manifest
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.wheels import archive, wheel

SHA256 = "0123456789abcdef" * 4
WHERE = "fuzzed"


def _contents() -> list[bytes]:
    entries = tuple(Entry(SHA256, size, f"wheels/a-{size}.whl") for size in (1, 2, 3))
    listed = Contents(
        "org.example.lamp", "1.0", 7, "survey", "0.1.0", "2026-01-01T00:00:00Z", entries
    )
    return [listed.to_bytes()]


MANIFEST = b"""\
id = "org.example.blinker"
name = "Blinker"
summary = "Blinks"
authors = ["A. Author"]
licence = "Apache-2.0"

[requires]
python = ">=3.11"
memory_mb = 50

[[component]]
id = "blinker"
distribution = "example-blinker"
permissions = ["network"]
settings = { rate_hz = 2, names = ["a", "b"] }

[[component.device]]
name = "lamp"
match = { ID_VENDOR_ID = "1a86", SUBSYSTEM = "tty" }
optional = true

[[component.unit]]
name = "lamp"
xyz = [0.1, 0, 0.2]
rpy = [0, 0, 1.57]
"""

MARKERS = (b"extra ", b"extras", b"os_name", b"~=", b"===", b" not in ", b" or ", b"(")
"""Of environment markers (PEP 508)."""


def _locks() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        made = [make_wheel(Path(folder), name, "1.0", {f"{name}.py": ""}) for name in ("a", "b")]
        plain = lock_text(made)
    head, _, packages = plain.partition("[[packages]]")
    bounds = 'requires-python = ">=3.9"\nenvironments = ["python_version >= \'3.9\'"]\n\n'
    marker = "marker = \"python_full_version >= '3.9'\""
    return [plain.encode(), f"{head}{bounds}[[packages]]\n{marker}{packages}".encode()]


def _read_lock(text: str) -> object:
    return lock.select(lock.parse(text, WHERE), _environment(), tuple(sys_tags()))


def _environment() -> Mapping[str, str]:
    from packaging.markers import default_environment

    return {key: str(value) for key, value in default_environment().items()}


def _wheels() -> list[bytes]:
    plain = WheelBuilder(files={"evil/__init__.py": b"X = 1\n", "evil/data.txt": b"0" * 500})
    with tempfile.TemporaryDirectory() as folder:
        scripts = {"evil": {"evil": "evil:main"}}
        made = make_wheel(Path(folder), "evil", "1.0", {"evil.py": "X=1"}, entry_points=scripts)
        return [plain.bytes(), made.read_bytes()]


def _read_wheel(data: bytes) -> object:
    """As `verify` and the store read it: laid out, what it needs told, every member unpacked."""
    view = memoryview(data)
    layout = wheel.lay_out(view, NAME)
    wheel.refuse_if_any(layout.problems)
    for file in layout.files:
        try:
            for _ in archive.unpack(view, file.member):
                pass
        except ValueError as error:  # `archive.unpack` raises it for a damaged member
            raise PayloadRefused(wheel.damaged(file, NAME, str(error))) from error
    return layout.needs.requirements


def _hostile_wheels() -> list[bytes]:
    made = (case.build(Path("canary")) for case in WHEELS if case.filename == NAME)
    return [data for data in made if len(data) <= LONGEST]


def _described() -> PluginDescription:
    fragment = Fragment("domain.pddl", "(define (domain lamp))")
    behaviour = Behaviour("point", "(point ?u - pointer ?t - thing)", lasting=True)
    return PluginDescription("lamp", "1.0", behaviours=(behaviour,), fragments=(fragment,))


def _indexes() -> list[bytes]:
    return [index.to_bytes({"lamp": _described()})]


TARGETS = (
    Target(
        "contents list",
        lambda data: contents.parse(data, WHERE),
        _contents,
        lambda: with_endless_numbers(_contents()),
        tokens=(b"release: ", b"../", b"\n\n", b"  ", SHA256.encode()),
        cases=1_000_000,
        longest=4 * LONGEST,
    ),
    Target(
        "manifest", of_text(lambda t: manifest.parse(t, WHERE)), lambda: [MANIFEST], tokens=TOML
    ),
    Target(
        "lock",
        of_text(_read_lock),
        _locks,
        tokens=(*TOML, *MARKERS, b"hashes", b"vcs", b"archive", b"url"),
    ),
    Target(
        "wheel",
        _read_wheel,
        _wheels,
        _hostile_wheels,
        tokens=(b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06", b"PK\x06\x06", b"\xff\xff\xff\xff"),
    ),
    Target("goal file", lambda data: goals.parse(data, WHERE), lambda: [b"follow me\n# no\n"]),
    Target("index", lambda data: index.parse(data, WHERE), _indexes, tokens=JSON),
)
