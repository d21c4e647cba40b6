"""The manifest: typed values out, and every kind of mistake told with its line and a way out."""

from __future__ import annotations

import string
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.description import DeviceNeed
from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.format import manifest
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.manifest import UnitMount

PLAIN = """\
id = "org.example.blinker"
name = "Blinker"
summary = "Blinks"
authors = ["A. Author"]
licence = "Apache-2.0"
homepage = "https://example.org"

[requires]
python = ">=3.11"
memory_mb = 50

[[component]]
id = "blinker"
distribution = "example-blinker"
permissions = ["devices"]
settings = { rate_hz = 2 }

[[component.device]]
name = "lamp"
match = { ID_VENDOR_ID = "1a86", SUBSYSTEM = "tty" }
optional = true

[[component.unit]]
name = "lamp"
xyz = [0.1, 0, 0.2]
rpy = [0, 0, 1.57]

[[component]]
id = "buzzer"
distribution = "example-buzzer"
"""

DEVICE = '[[component.device]]\nname = "lamp"\nmatch = { SUBSYSTEM = "tty" }\n'
UNIT = '[[component.unit]]\nname = "lamp"\n'


def problems(text: str) -> tuple[Problem, ...]:
    with pytest.raises(PayloadRefused) as refused:
        manifest.parse(text, "payload.toml")
    return refused.value.problems


def test_a_plain_manifest_is_read() -> None:
    parsed = manifest.parse(PLAIN, "payload.toml")
    blinker, buzzer = parsed.components
    assert (parsed.id, parsed.licence, parsed.authors) == (
        "org.example.blinker",
        "Apache-2.0",
        ("A. Author",),
    )
    assert (parsed.requires.python, parsed.requires.memory_mb) == (">=3.11", 50)
    assert blinker.units == (UnitMount("lamp", (0.1, 0.0, 0.2), (0.0, 0.0, 1.57)),)
    assert blinker.devices == (
        DeviceNeed("lamp", {"ID_VENDOR_ID": "1a86", "SUBSYSTEM": "tty"}, optional=True),
    )
    assert (blinker.permissions, blinker.settings) == (("devices",), {"rate_hz": 2})
    assert (buzzer.devices, buzzer.units, buzzer.settings) == ((), (), {})


@pytest.mark.parametrize(
    ("value", "level"),
    [
        ('"sandboxed"', Level.SANDBOXED),
        ("3", Level.SANDBOXED),
        ("2", Level.SANDBOXED),
        ('"restricted"', Level.RESTRICTED),
        ("1", Level.RESTRICTED),
        ('"none"', Level.NONE),
        ("0", Level.NONE),
    ],
)
def test_a_level_of_confinement_is_demanded_by_name_or_number(value: str, level: Level) -> None:
    text = PLAIN.replace("memory_mb = 50", f"confinement = {value}")
    assert manifest.parse(text, "payload.toml").requires.confinement is level


def test_without_a_demand_any_confinement_will_do() -> None:
    assert manifest.parse(PLAIN, "payload.toml").requires.confinement is Level.NONE


WRONG = {
    "not-toml": ("MANIFEST_TOML", "", PLAIN.replace("[requires]", "[requires")),
    "key-twice": ("MANIFEST_TOML", "", 'name = "x"\n' + PLAIN),
    "table-twice": ("MANIFEST_TOML", "", PLAIN + "[requires]\n"),
    "unclosed-string": ("MANIFEST_TOML", "", PLAIN.replace('"Blinks"', '"Blinks')),
    "nested-bomb": ("MANIFEST_TOML", "", PLAIN + "x = " + "[" * 5000),
    "dotted-bomb": ("MANIFEST_TOML", "", ".".join("a" * 5000) + " = 1\n" + PLAIN),
    "digits-bomb": ("MANIFEST_TOML", "", PLAIN + "x = " + "9" * 5000),
    "too-long": ("TOO_LARGE", "", PLAIN + "#" * 65536),
    "unknown-key": ("MANIFEST_KEY", ":3", PLAIN.replace("summary", "sumary")),
    "unknown-table": ("MANIFEST_KEY", "", PLAIN + "[require]\n"),
    "unknown-in-requires": ("MANIFEST_KEY", ":10", PLAIN.replace("memory_mb", "memory-mb")),
    "gpu-of-no-kind": (
        "MANIFEST_VALUE",
        ":12",
        PLAIN.replace("memory_mb = 50", 'memory_mb = 50\n[requires.gpu]\nkind = "metal"'),
    ),
    "unknown-in-gpu": (
        "MANIFEST_KEY",
        "",
        PLAIN.replace("memory_mb = 50", "gpu = { memory = 50 }"),
    ),
    "unknown-in-component": ("MANIFEST_KEY", ":15", PLAIN.replace("permissions", "permission")),
    "unknown-in-device": ("MANIFEST_KEY", ":21", PLAIN.replace("optional", "option")),
    "match-by-no-word": ("MANIFEST_VALUE", ":20", PLAIN.replace("SUBSYSTEM", "subsytem")),
    "match-by-half-an-id": (
        "MANIFEST_VALUE",
        ":20",
        PLAIN.replace('ID_VENDOR_ID = "1a86"', 'usb = "1a86"'),
    ),
    "unknown-in-unit": ("MANIFEST_KEY", ":26", PLAIN.replace("rpy", "rpi")),
    "missing-id": ("MANIFEST_KEY", "", PLAIN.replace('id = "org.example.blinker"\n', "")),
    "missing-component": ("MANIFEST_KEY", "", PLAIN.partition("[[component]]")[0]),
    "missing-distribution": (
        "MANIFEST_KEY",
        ":28",
        PLAIN.replace('distribution = "example-buzzer"\n', ""),
    ),
    "id-with-capitals": ("MANIFEST_VALUE", ":1", PLAIN.replace("org.example", "Org.example")),
    "id-with-homoglyph": ("MANIFEST_VALUE", ":1", PLAIN.replace("org.", "оrg.")),
    "component-id-with-dot": ("MANIFEST_VALUE", ":13", PLAIN.replace('"blinker"', '"b.linker"')),
    "component-id-too-long": ("MANIFEST_VALUE", ":13", PLAIN.replace('"blinker"', f'"{"b" * 64}"')),
    "component-id-number": ("MANIFEST_VALUE", ":13", PLAIN.replace('"blinker"', "7")),
    "distribution-not-normal": ("MANIFEST_VALUE", ":14", PLAIN.replace("e-blinker", "e_Blinker")),
    "direction-override": ("MANIFEST_VALUE", ":2", PLAIN.replace('"Blinker"', '"B\u202elinker"')),
    "control-character": ("MANIFEST_VALUE", ":2", PLAIN.replace('"Blinker"', '"B\\u0007linker"')),
    "name-is-list": ("MANIFEST_VALUE", ":2", PLAIN.replace('"Blinker"', '["Blinker"]')),
    "authors-is-string": ("MANIFEST_VALUE", ":4", PLAIN.replace('["A. Author"]', '"A. Author"')),
    "authors-is-letter": ("MANIFEST_VALUE", ":4", PLAIN.replace('["A. Author"]', '"A"')),
    "author-is-number": ("MANIFEST_VALUE", ":4", PLAIN.replace('"A. Author"', '"A. Author", 1')),
    "author-with-escape": ("MANIFEST_VALUE", ":4", PLAIN.replace("A. Author", "A\\u001b[2J")),
    "requires-is-string": (
        "MANIFEST_VALUE",
        ":8",
        PLAIN.replace('[requires]\npython = ">=3.11"\nmemory_mb = 50', 'requires = "a lot"'),
    ),
    "component-is-table": (
        "MANIFEST_VALUE",
        "",
        PLAIN.partition("[[component]]")[0] + '[component]\nid = "blinker"\n',
    ),
    "components-are-text": (
        "MANIFEST_VALUE",
        ":1",
        'component = ["blinker"]\n' + PLAIN.partition("[[component]]")[0],
    ),
    "component-is-empty": (
        "MANIFEST_VALUE",
        ":1",
        "component = {}\n" + PLAIN.partition("[[component]]")[0],
    ),
    "no-components": (
        "MANIFEST_KEY",
        "",
        "component = []\n" + PLAIN.partition("[[component]]")[0],
    ),
    "python-not-specifier": ("MANIFEST_VALUE", ":9", PLAIN.replace('">=3.11"', '"newest"')),
    "memory-negative": ("MANIFEST_VALUE", ":10", PLAIN.replace("= 50", "= -50")),
    "memory-text": ("MANIFEST_VALUE", ":10", PLAIN.replace("= 50", '= "50 MB"')),
    "memory-true": ("MANIFEST_VALUE", ":10", PLAIN.replace("= 50", "= true")),
    **{
        f"confinement-{name}": (
            "MANIFEST_VALUE",
            ":10",
            PLAIN.replace("memory_mb = 50", f"confinement = {value}"),
        )
        for name, value in {
            "level": "9",
            "word": '"high"',
            "true": "true",
            "list": '["none"]',
            "huge": f"0x{'f' * 5000}",
        }.items()
    },
    "memory-is-huge": (
        "MANIFEST_VALUE",
        ":10",
        PLAIN.replace("memory_mb = 50", f"memory_mb = 0x{'f' * 5000}"),
    ),
    "alone-is-huge": (
        "MANIFEST_VALUE",
        ":10",
        PLAIN.replace("memory_mb = 50", f"alone = 0x{'f' * 5000}"),
    ),
    "permissions-are-huge": (
        "MANIFEST_VALUE",
        ":15",
        PLAIN.replace('["devices"]', f"[0x{'f' * 5000}]"),
    ),
    "permission-unknown": ("MANIFEST_VALUE", ":15", PLAIN.replace('["devices"]', '["root"]')),
    "settings-is-list": ("MANIFEST_VALUE", ":16", PLAIN.replace("{ rate_hz = 2 }", "[2]")),
    "device-without-match": (
        "MANIFEST_VALUE",
        ":20",
        PLAIN.replace('{ ID_VENDOR_ID = "1a86", SUBSYSTEM = "tty" }', "{}"),
    ),
    "device-match-is-text": (
        "MANIFEST_VALUE",
        ":20",
        PLAIN.replace('{ ID_VENDOR_ID = "1a86", SUBSYSTEM = "tty" }', '"tty"'),
    ),
    "device-match-number": ("MANIFEST_VALUE", ":20", PLAIN.replace('"1a86"', "1086")),
    "optional-is-text": ("MANIFEST_VALUE", ":21", PLAIN.replace("= true", '= "yes"')),
    "mount-of-two-numbers": ("MANIFEST_VALUE", ":25", PLAIN.replace("[0.1, 0, 0.2]", "[0.1, 0]")),
    "mount-of-text": ("MANIFEST_VALUE", ":26", PLAIN.replace("[0, 0, 1.57]", '["0", 0, 0]')),
    "mount-not-a-number": ("MANIFEST_VALUE", ":26", PLAIN.replace("1.57", "nan")),
    "mount-infinite": ("MANIFEST_VALUE", ":25", PLAIN.replace("0.2", "inf")),
    "component-twice": ("MANIFEST_TWICE", "", PLAIN.replace('"buzzer"', '"blinker"')),
    "device-twice": ("MANIFEST_TWICE", "", PLAIN.replace(UNIT, DEVICE + UNIT)),
    "unit-twice": ("MANIFEST_TWICE", "", PLAIN.replace(UNIT, UNIT * 2)),
    "settings-with-date": ("MANIFEST_VALUE", ":16", PLAIN.replace("= 2 }", "= 2026-01-01 }")),
    "settings-with-nan": ("MANIFEST_VALUE", ":16", PLAIN.replace("= 2 }", "= [{ a = nan }] }")),
    "settings-with-huge": ("MANIFEST_VALUE", ":16", PLAIN.replace("= 2 }", f"= {2**63} }}")),
    "mount-huge": ("MANIFEST_VALUE", ":25", PLAIN.replace("0.2", "1" * 400)),
}


@pytest.mark.parametrize(("code", "line", "text"), WRONG.values(), ids=WRONG)
def test_a_mistake_is_told_where_it_is(code: str, line: str, text: str) -> None:
    (problem,) = problems(text)
    assert (problem.code, problem.where) == (code, f"payload.toml{line}")
    assert problem.message


def test_an_unknown_key_gets_the_nearest_known() -> None:
    (problem,) = problems(PLAIN.replace("summary", "sumary"))
    assert "'summary'" in problem.fix


def test_everything_wrong_is_told_at_once() -> None:
    text = PLAIN.replace("summary", "sumary").replace("= 50", "= -50").replace("xyz", "xzy")
    assert [(p.code, p.where.rpartition(":")[2]) for p in problems(text)] == [
        ("MANIFEST_VALUE", "10"),
        ("MANIFEST_KEY", "25"),
        ("MANIFEST_KEY", "3"),
    ]


def test_dotted_keys_cost_no_time() -> None:
    begun = time.process_time()
    problems(" . ".join(f"a{n}" for n in range(10_000)) + " = 1\n")
    problems("'a'." * 10_000 + "b = 1\n")
    assert time.process_time() - begun < 1


@given(st.text(max_size=200))
def test_noise_is_refused_and_nothing_else_raised(noise: str) -> None:
    for text in (noise, PLAIN + noise, noise + PLAIN):
        try:
            manifest.parse(text, "payload.toml")
        except PayloadRefused as refused:
            assert all(p.code.startswith("MANIFEST_") for p in refused.problems)


VALUES = st.recursive(
    st.one_of(
        st.integers(-(2**70), 2**70).map(str),
        st.booleans().map(lambda flag: str(flag).lower()),
        st.floats().map(str),
        st.text(string.ascii_letters + " .-_", max_size=20).map(lambda text: f'"{text}"'),
        st.just("2026-01-01"),
    ),
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]")
        | inner.map(lambda item: f"{{ a = {item} }}")
    ),
    max_leaves=5,
)
ASSIGNMENTS = [n for n, line in enumerate(PLAIN.splitlines()) if " = " in line]


@given(st.sampled_from(ASSIGNMENTS), VALUES)
def test_any_value_anywhere_is_taken_or_refused(number: int, value: str) -> None:
    lines = PLAIN.splitlines()
    lines[number] = f"{lines[number].partition(' = ')[0]} = {value}"
    try:
        manifest.parse("\n".join(lines), "payload.toml")
    except PayloadRefused as refused:
        assert all(p.where.startswith("payload.toml") for p in refused.problems)
