"""Manifests that are wrong, ask for too much, or were made to exhaust their reader."""

from __future__ import annotations

from collections.abc import Callable

from tests.faults.hostile.case import MANIFEST, HostileDrive, edited, spoilt
from tests.faults.hostile.payload_files import PayloadFiles

TOML, KEY, VALUE, TWICE = "MANIFEST_TOML", "MANIFEST_KEY", "MANIFEST_VALUE", "MANIFEST_TWICE"


def text(name: str, code: str, change: Callable[[str], str]) -> HostileDrive:
    """With another text, made of the right one."""
    return spoilt(name, code, lambda made: made.with_file(MANIFEST, change(made.text(MANIFEST))))


def whole(name: str, code: str, data: str | bytes) -> HostileDrive:
    return spoilt(name, code, lambda made: made.with_file(MANIFEST, data))


def top(name: str, code: str, line: str) -> HostileDrive:
    """With one more line before all tables."""
    return text(name, code, lambda good: f"{line}\n{good}")


def component(name: str, code: str, lines: str) -> HostileDrive:
    """With more lines in its only component."""
    return text(name, code, lambda good: f"{good}\n{lines}\n")


def requires(name: str, code: str, line: str) -> HostileDrive:
    return edited(name, code, MANIFEST, "[requires]\n", f"[requires]\n{line}\n")


def named(name: str, value: str, code: str = VALUE) -> HostileDrive:
    return edited(name, code, MANIFEST, 'name = "Test"', f'name = "{value}"')


def of_another(made: PayloadFiles) -> PayloadFiles:
    return made.edited(MANIFEST, f'id = "{made.id}"', 'id = "org.example.innocent"')


def same_twice(made: PayloadFiles) -> PayloadFiles:
    good = made.text(MANIFEST)
    return made.with_file(MANIFEST, good + good[good.index("[[component]]") :])


DRIVES: tuple[HostileDrive, ...] = (
    whole("manifest-empty", KEY, ""),
    whole("manifest-cut", TOML, "id = ["),
    whole("manifest-binary", "NOT_UTF8", bytes(range(128, 256))),
    whole("manifest-utf-16", "NOT_UTF8", "id = 1".encode("utf-16")),
    text("manifest-with-mark", TOML, lambda good: "\ufeff" + good),
    text("manifest-with-nul", TOML, lambda good: good + "# \0\n"),
    top("manifest-key-unknown", KEY, "install_script = 'setup.sh'"),
    top("manifest-key-of-tomorrow", KEY, "format = 2"),
    top("manifest-key-near", KEY, "licens = 'MIT'"),
    top("manifest-key-twice", TOML, 'name = "other"'),
    requires("requires-unknown", KEY, "root = true"),
    component("component-unknown", KEY, "privileged = true"),
    component("component-command", KEY, "command = ['sh', '-c', 'id']"),
    component("settings-too-big", VALUE, f"[component.settings]\nnumber = {10**40}"),
    component("settings-infinite", VALUE, "[component.settings]\nnumber = inf"),
    component("settings-not-a-number", VALUE, "[component.settings]\nnumber = nan"),
    component("settings-a-date", VALUE, "[component.settings]\nday = 1979-05-27"),
    component("permission-unknown", VALUE, "permissions = ['root']"),
    component("permissions-a-word", VALUE, "permissions = 'network'"),
    component("device-without-match", VALUE, "[[component.device]]\nname = 'a'\n"),
    component("device-empty-match", VALUE, "[[component.device]]\nname='a'\nmatch={}"),
    component("device-climbs", VALUE, "[[component.device]]\nname='../sda'\nmatch={ID_BUS='usb'}"),
    component("device-odd-rule", VALUE, "[[component.device]]\nname='a'\nmatch={a='b'}"),
    component(
        "device-with-path",
        KEY,
        "[[component.device]]\nname='a'\nmatch={ID_BUS='usb'}\nnode='/dev/sda'",
    ),
    component("unit-at-nowhere", VALUE, "[[component.unit]]\nname='a'\nxyz=[nan,0,0]"),
    component("unit-flat", VALUE, "[[component.unit]]\nname='a'\nxyz=[0,0]"),
    component("unit-twice", TWICE, "[[component.unit]]\nname='a'\n[[component.unit]]\nname='a'"),
    edited("id-not-text", VALUE, MANIFEST, 'name = "Test"', "name = 7"),
    edited("authors-a-word", VALUE, MANIFEST, '["Test"]', '"Test"'),
    edited("component-in-capitals", VALUE, MANIFEST, 'id = "ID"', 'id = "Lamp"'),
    edited("component-climbs", VALUE, MANIFEST, 'id = "ID"', 'id = "../../etc"'),
    edited("component-with-dots", VALUE, MANIFEST, 'id = "ID"', 'id = "a.b"'),
    edited("component-empty", VALUE, MANIFEST, 'id = "ID"', 'id = ""'),
    edited("component-too-long", VALUE, MANIFEST, 'id = "ID"', f'id = "{"a" * 64}"'),
    edited("component-lookalike", VALUE, MANIFEST, 'id = "ID"', 'id = "lаmp"'),
    edited("distribution-a-path", VALUE, MANIFEST, '"test-ID"', '"/etc/passwd"'),
    edited("distribution-an-option", VALUE, MANIFEST, '"test-ID"', '"--index-url=http://evil"'),
    spoilt("id-of-another", VALUE, of_another),
    spoilt("component-twice", TWICE, same_twice),
    edited("component-a-table", VALUE, MANIFEST, "[[component]]", "[component]"),
    text("no-component", KEY, lambda good: good[: good.index("[[component]]")]),
    named("name-that-turns", "\u202egnp.exe"),
    named("name-with-escape", "\\u001b[2Jgone"),
    named("name-without-end", "x" * 5000),
    named("name-on-two-lines", "\\n\\n"),
    requires("python-in-words", VALUE, 'python = "newest"'),
    requires("confinement-ninety-nine", VALUE, "confinement = 99"),
    requires("memory-negative", VALUE, "memory_mb = -1"),
    requires("memory-in-words", VALUE, 'memory_mb = "all"'),
    requires("python-of-tomorrow", "PYTHON_VERSION", 'python = ">=4"'),
    requires("memory-of-a-mainframe", "NO_MEMORY", "memory_mb = 99999999"),
    requires("disk-of-a-mainframe", "DISK_FULL", "disk_mb = 9999999999"),
    requires("gpu-of-a-mainframe", "NO_GPU_MEMORY", "gpu_memory_mb = 99999999"),
    whole("bomb-of-tables", TOML, "a" + ".a" * 20_000 + " = 1"),
    whole("bomb-of-headers", TOML, "[a" + ".a" * 20_000 + "]"),
    whole("bomb-of-brackets", TOML, "a = " + "[" * 30_000),
    whole("bomb-of-braces", TOML, "a = " + "{a=" * 15_000),
    whole("bomb-of-digits", TOML, "a = " + "9" * 60_000),
    whole("bomb-of-tables-in-arrays", KEY, "[[a]]\n" * 10_000),
    whole("manifest-a-byte-too-long", "TOO_LARGE", "#" * (64 * 1024 + 1)),
    whole("manifest-of-megabytes", "TOO_LARGE", "# hello\n" * 2**18),
)
