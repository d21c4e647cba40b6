"""References say what the code says, and examples are commands that exist."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import click
import pytest
from tests.docs.dataclass_fields import field_docs
from tests.docs.reference import DOCS, DOCUMENTS, KEYS, MARK, all_commands, configuration_keys
from tests.docs.sdk_reference import core_words, message_classes

from nondum.cli.root import cli
from nondum.host.config import host_config, parsing, reference
from nondum.planning.merge.core import core
from nondum.sdk import hooks

ROOT = DOCS.parent
PAGES = sorted([*DOCS.rglob("*.md"), *ROOT.glob("*.md"), *ROOT.glob("plugins/*/README.md")])
LINK = re.compile(r"(?<!!)\[[^]]+\]\(([^)#\s]+)(#[^)]*)?\)")
EXAMPLE = re.compile(r"^(?:    |\$ |)nondum (?!\w+:)([a-z].*)$", re.MULTILINE)
BLOCK = re.compile(r"^```\w*\n(.*?)^```|((?:^    .*\n)+)", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_reference_says_what_the_code_says(name: str) -> None:
    written = (DOCS / name).read_text(encoding="utf-8").partition(MARK)[2].lstrip("\n")
    assert written == DOCUMENTS[name](), "run: python -m tests.docs.reference"


@pytest.mark.parametrize(
    ("name", "command", "context"), [pytest.param(*found, id=found[0]) for found in all_commands()]
)
def test_every_command_has_a_heading_and_its_usage(
    name: str, command: click.Command, context: click.Context
) -> None:
    written = (DOCS / "cli.md").read_text(encoding="utf-8")
    assert f"\n## {name}\n" in written
    assert f"    {name} {' '.join(command.collect_usage_pieces(context))}\n" in written


def test_every_key_of_the_configuration_has_a_row_with_its_meaning() -> None:
    written = (DOCS / "configuration.md").read_text(encoding="utf-8")
    for section, key, _ in host_config.documented():
        part = written.partition(f"\n## [{section}]\n")[2].partition("\n## ")[0]
        assert re.search(rf"^\| `{key}` \| \S.* \| \S.* \|$", part, re.MULTILINE), (section, key)


def test_what_is_explained_of_keys_is_what_the_code_says() -> None:
    written = KEYS.read_text(encoding="utf-8")
    assert written == configuration_keys(), "run: python -m tests.docs.reference"


def test_every_example_of_a_key_is_taken() -> None:
    for name, told in reference.keys().items():
        section, _, key = name.partition(".")
        assert told["example"], name
        parsing.parse(f"[{section}]\n{key} = {told['example']}\n", name, host_config.HostConfig())


def test_every_hook_is_documented() -> None:
    specified = {
        name
        for name in vars(hooks)
        if hasattr(getattr(hooks, name), f"{hooks.PROJECT}_spec") and not name.startswith("_")
    }
    assert specified == {*hooks.DESCRIBING, *hooks.ACTING}


@pytest.mark.parametrize("cls", message_classes(), ids=lambda cls: cls.__name__)
def test_every_field_of_a_message_says_what_it_holds(cls: type[object]) -> None:
    told = field_docs(cls)
    assert [f.name for f in fields(cls) if f.name != "header" and not told.get(f.name)] == []  # type: ignore[arg-type]  # all are dataclasses


def test_every_word_of_the_core_has_a_meaning() -> None:
    written = core_words()
    assert all(f"| `({p.name} " in written for p in core().predicates)
    assert all(f"`{t.name}`" in written for t in core().types)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for match in LINK.finditer(page.read_text(encoding="utf-8")):
        if "://" not in match[1]:
            assert (page.parent / match[1]).exists(), match[0]


def shown_commands() -> Iterator[tuple[Path, str]]:
    """Each command line in a block of code of any page."""
    for page in PAGES:
        for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
            for match in EXAMPLE.finditer(block[0]):
                yield page, re.split(r" [&|>#]| &&|  +#", match[1])[0].strip()


@pytest.mark.parametrize(
    ("page", "line"),
    [pytest.param(p, line, id=f"{p.name}: {line}") for p, line in shown_commands()],
)
def test_commands_that_are_shown_exist(page: Path, line: str) -> None:
    command: click.Command = cli
    context = click.Context(cli, info_name="nondum", resilient_parsing=True)
    words = shlex.split(line)
    while isinstance(command, click.Group):
        if command.invoke_without_command and (not words or words[0][0] in "-["):
            break  # it does something by itself, too
        assert words, line
        found = command.get_command(context, words.pop(0))
        assert found is not None, line
        command, context = found, click.Context(found, parent=context, resilient_parsing=True)
    known = {option for param in command.get_params(context) for option in param.opts}
    used = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
    assert "[OPTIONS]" in line or used <= known, (page, used - known)


def test_bench_begins_as_the_readme_of_a_new_package_says() -> None:
    template = (ROOT / "wheelhouse/nondum/wheelhouse/build/template/README.md").read_text("utf-8")
    bench = (ROOT / "docs/bench.md").read_text("utf-8")
    for command in ("pip install -e .", "pytest"):
        assert f"\n    {command}" in template
        assert f"\n    {command}" in bench
