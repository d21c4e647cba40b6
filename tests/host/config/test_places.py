"""Every table and key of a TOML file is found where it stands."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.config.places import Places, places

TEXT = '''# A comment, and [no.header]
top = 1

[host]
name = "spot" # [drives]
"state" = """
[drives]
slots = 1
"""

[drives]
slots = [
  # allow_unsigned = true
  "/a", # ]
]
allow_unsigned = false
[ peers ]
'static' = []
'''


def test_keys_are_found_however_their_values_are_written() -> None:
    assert places(TEXT) == {
        ("top",): 2,
        ("host",): 4,
        ("host", "name"): 5,
        ("host", "state"): 6,
        ("drives",): 11,
        ("drives", "slots"): 12,
        ("drives", "allow_unsigned"): 16,
        ("peers",): 17,
        ("peers", "static"): 18,
    }


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('\nhost.name = "spot"', 2),
        ('\n\nhost = { name = "spot", state = "/x" }', 3),
        ('[host]\r\n\r\nname = "spot"\r\n', 3),
        ('[a]\nb = "\u2028"\n[host]\nname = "spot"', 4),
        ('[[a]]\n[[a]]\n[host]\nname = "spot"', 4),
        ('[a.b.c]\nname = 1\n[host]\nname = "spot"', 4),
    ],
    ids=["dotted", "inline", "carriage returns", "odd line ends", "arrays", "deep"],
)
def test_a_key_is_found_in_every_way_to_write_it(text: str, line: int) -> None:
    assert tomllib.loads(text)["host"]["name"] == "spot"
    assert places(text)[("host", "name")] == line


def test_what_is_not_there_has_the_files_name_only() -> None:
    found = Places("host.toml", TEXT)
    assert found.of("drives", "slots") == "host.toml:12"
    assert found.of("drives", "single_function") == "host.toml"
    assert (found.has("host"), found.has("router")) == (True, False)


NAMES = st.from_regex(r"[a-z]{1,4}", fullmatch=True)
VALUES = st.sampled_from(["1", '"[x]"', "[\n1,\n2\n]", "'''\n[y]\nz = 1\n'''", "{ k = 1 }"])
TABLES = st.dictionaries(NAMES, st.dictionaries(NAMES, VALUES, max_size=4), max_size=4)


@given(TABLES, st.lists(st.sampled_from(["", "# x = 1", "# [t]"]), max_size=3))
def test_every_key_of_any_file_is_found_on_its_line(
    tables: dict[str, dict[str, str]], between: list[str]
) -> None:
    lines: list[str] = []
    expected: dict[tuple[str, ...], int] = {}
    for table, keys in tables.items():
        lines += [*between, f"[{table}]"]
        expected[table,] = len(lines)
        for key, value in keys.items():
            lines += between
            expected[table, key] = len(lines) + 1
            lines += f"{key} = {value}".split("\n")
    assert places("\n".join(lines)) == expected
