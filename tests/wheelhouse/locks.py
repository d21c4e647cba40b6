"""Texts of locks, and hosts that choose wheels by them."""

from __future__ import annotations

from packaging.tags import Tag, compatible_tags, cpython_tags

from nondum.wheelhouse.format import lock
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.lock import Lock
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.memory import Memory

SHA = "b" * 64


HEAD = 'lock-version = "1.0"\ncreated-by = "test"\n'


def wheel(name: str, *, path: str | None = None, rest: str | None = None) -> str:
    place = f'path = "{path or f"wheels/{name}"}"'
    hashes = rest if rest is not None else f'size = 3\nhashes = {{ sha256 = "{SHA}" }}'
    return f'[[packages.wheels]]\nname = "{name}"\n{place}\n{hashes}\n'


def package(name: str, version: str, *wheels: str, more: str = "") -> str:
    return f'[[packages]]\nname = "{name}"\nversion = "{version}"\n{more}' + "".join(wheels)


def host(python: tuple[int, int], machine: str) -> tuple[dict[str, str], list[Tag]]:
    platforms = [f"manylinux_2_28_{machine}", f"manylinux_2_17_{machine}", f"linux_{machine}"]
    text = ".".join(map(str, python))
    environment = {
        "implementation_name": "cpython",
        "implementation_version": f"{text}.0",
        "os_name": "posix",
        "platform_machine": machine,
        "platform_python_implementation": "CPython",
        "platform_release": "6.1",
        "platform_system": "Linux",
        "platform_version": "1",
        "python_full_version": f"{text}.0",
        "python_version": text,
        "sys_platform": "linux",
    }
    tags = [
        *cpython_tags(python, platforms=platforms),
        *compatible_tags(python, f"cp{python[0]}{python[1]}", platforms),
    ]
    return environment, tags


ENVIRONMENT, TAGS = host((3, 11), "x86_64")
FACTS = HostFacts(
    architecture="x86_64",
    python="3.11.4",
    environment=ENVIRONMENT,
    tags=tuple(TAGS),
    free_disk_mb=1000,
    memory=Memory(1000),
    confinement=Level.RESTRICTED,
    nondum="0.1.0",
)


def unpacks_to(size: int, filename: str = "dist_a-1.0-py3-none-any.whl") -> str:
    return f'[packages.tool.nondum.unpacked]\n"{filename}" = {size}\n'


def locked(component: str, tag: str = "py3-none-any", more: str = "", size: int = 3) -> Lock:
    one = wheel(f"dist_{component}-1.0-{tag}.whl").replace("size = 3", f"size = {size}")
    text = HEAD + package(f"dist-{component}", "1.0", one, more=more)
    return lock.parse(text, f"pylock.{component}.toml")
