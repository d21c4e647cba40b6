"""Texts of locks, and hosts that choose wheels by them."""

from __future__ import annotations

from packaging.tags import Tag, compatible_tags, cpython_tags

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
