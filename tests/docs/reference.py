"""The parts of docs/ (and what `nondum explain` quotes) that say what the code says: made from it.

    python -m tests.docs.reference        # writes them again

Each document begins with text that people write; what follows `MARK` comes from here.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from typing import Any, get_type_hints

import click
from tests.docs import codes, packages, sdk_reference
from tests.docs.dataclass_fields import field_docs

from nondum.cli import explain
from nondum.cli.root import cli
from nondum.host.config import host_config, parsing
from nondum.host.config import reference as keys_of
from nondum.host.config.effective import as_toml
from nondum.host.extension import hookspecs
from nondum.planning.pddl import tables
from nondum.sdk import hooks

DOCS = Path(__file__).parents[2] / "docs"
TOLD = Path(explain.__file__).with_name(explain.TOLD)
"""What `nondum explain` quotes; it ships with nondum, which does not read its own sources."""
KEYS = Path(keys_of.__file__).with_name(keys_of.KEYS)
"""What `nondum config explain` quotes."""
TABLES = Path(tables.__file__).parent / "grammar" / tables.TABLES
"""What lark makes of the grammar of PDDL."""
MARK = "<!-- What follows is written by `python -m tests.docs.reference`. -->\n"


def all_commands() -> Iterator[tuple[str, click.Command, click.Context]]:
    """Every command, by what a person types, in the order of the alphabet."""
    root = click.Context(cli, info_name="nondum")
    for name in cli.list_commands(root):
        found = cli.get_command(root, name)
        assert found is not None
        yield from _of(f"nondum {name}", found, click.Context(found, info_name=name, parent=root))


def _of(
    name: str, command: click.Command, context: click.Context
) -> Iterator[tuple[str, click.Command, click.Context]]:
    """A command; or those of a group, and the group where it does something by itself."""
    if not isinstance(command, click.Group) or command.invoke_without_command:
        yield name, command, context
    if isinstance(command, click.Group):
        for inner in sorted(command.commands):
            found = command.commands[inner]
            yield from _of(
                f"{name} {inner}", found, click.Context(found, info_name=inner, parent=context)
            )


def commands() -> str:
    """A section a command: usage, what it does, its options, its examples."""
    return "\n".join(_command(*found) for found in all_commands())


def configuration() -> str:
    """A section a table of the file, a row a key."""
    rows: dict[str, list[str]] = {}
    for section, key, default in host_config.documented():
        kind = type(getattr(host_config.HostConfig(), section))
        meaning = field_docs(kind)[key]
        rows.setdefault(section, []).append(f"| `{key}` | {_shown(default)} | {meaning} |")
    return "\n".join(_section(section, found) for section, found in rows.items())


def configuration_keys() -> str:
    """What `nondum config explain` tells, as JSON."""
    hints = {f.name: get_type_hints(f.default_factory) for f in fields(host_config.HostConfig)}
    told = {}
    for section, key, default in host_config.documented():
        name, shown = f"{section}.{key}", as_toml(default)
        told[name] = {
            "meaning": field_docs(type(getattr(host_config.HostConfig(), section)))[key],
            "kind": parsing.KINDS[hints[section][key]],
            "unit": keys_of.unit_of(key),
            "default": shown,
            "example": keys_of.EXAMPLES.get(name, shown),
        }
    return json.dumps(told, ensure_ascii=False, indent=1) + "\n"


def hook_signatures() -> str:
    """A section a hook: its signature and what it is for."""
    return "\n".join(
        [
            "## Hooks for plugins: describing\n",
            *(_hook(hooks, name) for name in hooks.DESCRIBING),
            "## Hooks for plugins: acting\n",
            *(_hook(hooks, name) for name in hooks.ACTING),
            "## Hooks for extensions of the host\n",
            *(_hook(hookspecs, name) for name in hookspecs.HOOKS),
            *_fields("host", hookspecs.Host),
            *_fields("member", hookspecs.FleetMember),
        ]
    )


DOCUMENTS: dict[str, Callable[[], str]] = {
    "bench.md": sdk_reference.bench,
    "core-words.md": sdk_reference.core_words,
    "messages.md": sdk_reference.messages,
    "cli.md": commands,
    "configuration.md": configuration,
    "hooks.md": hook_signatures,
}


def _command(name: str, command: click.Command, context: click.Context) -> str:
    about, _, examples = inspect.cleandoc(command.help or "").partition("Example")
    usage = " ".join([name, *command.collect_usage_pieces(context)])
    lines = [f"## {name}\n", f"    {usage}\n", about.replace("\b\n", "").strip(), ""]
    options = [
        record
        for param in command.get_params(context)
        if isinstance(param, click.Option) and (record := param.get_help_record(context))
        if "--help" not in param.opts
    ]
    if options:
        lines += ["| option | |", "|---|---|", *(f"| `{o}` | {text} |" for o, text in options), ""]
    shown = examples.partition(":")[2].strip().splitlines()
    lines += [*(f"    {line.strip()}" for line in shown), ""]
    return "\n".join(lines)


def _section(name: str, rows: list[str]) -> str:
    kind = type(getattr(host_config.HostConfig(), name))
    heads = ["| key | default | |", "|---|---|---|"]
    return "\n".join([f"## [{name}]\n", f"{inspect.getdoc(kind)}\n", *heads, *rows, ""])


def _shown(default: Any) -> str:
    """A default as the file would say it."""
    match default:
        case None:
            return "none"
        case _:
            return f"`{as_toml(default)}`"


def _fields(name: str, kind: type[Any]) -> Iterator[str]:
    docs = field_docs(kind)
    yield f"What `{name}` is: {inspect.getdoc(kind)}\n"
    yield from (f"- `{name}.{field.name}`: {docs[field.name]}" for field in fields(kind))
    yield ""


def _hook(module: ModuleType, name: str) -> str:
    function = getattr(module, name)
    kind = "async def" if inspect.iscoroutinefunction(function) else "def"
    signature = f"{kind} {name}{inspect.signature(function)}".replace("'", "")
    return f"### {name}\n\n    {signature}\n\n{inspect.getdoc(function)}\n"


def main() -> None:
    """Write again what follows the mark of each document."""
    for name, make in {**DOCUMENTS, "codes.md": codes.references}.items():
        path = DOCS / name
        words = path.read_text(encoding="utf-8").partition(MARK)[0]
        path.write_text(f"{words}{MARK}\n{make()}", encoding="utf-8")
    KEYS.write_text(configuration_keys(), encoding="utf-8")
    TOLD.write_text(codes.told_words(), encoding="utf-8")
    if not tables.are_current():
        TABLES.write_text(tables.made(), encoding="utf-8")
    packages.draw()


if __name__ == "__main__":
    main()
