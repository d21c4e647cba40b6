"""The configuration file: whether it is right, what holds, and what a key means."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.failure import EXIT_PROBLEMS, tell_problem
from nondum.cli.session import Session
from nondum.cli.table import table
from nondum.host.config import component_settings, host_config, reference
from nondum.host.config.effective import Asked, as_toml, effective, file_of, remarks, settings
from nondum.sdk.errors import ConfigRefused

_F = TypeVar("_F", bound=Callable[..., Any])


def asked_options(command: _F) -> _F:
    """Add the options that a daemon is configured with; the command gets them as `asked`."""
    return _with(_WHICH + _MORE, command)


def which_options(command: _F) -> _F:
    """Add the options that say which configuration is meant."""
    return _with(_WHICH, command)


def _with(options: tuple[Callable[[_F], _F], ...], command: _F) -> _F:
    # click lists options in the order in which they are added last.
    for option in reversed(options):
        command = option(command)
    return command


_WHICH = (
    click.option("--user", is_flag=True, help="As this user: no root, no systemd, own state."),
    click.option(
        "--config",
        "config_file",
        type=click.Path(path_type=Path),
        help=f"Configuration file [default: {host_config.SYSTEM_FILE}, none with --user].",
    ),
)
_MORE = (
    click.option("--name", help="The host's name, over the configuration's."),
    click.option(
        "--peer",
        "peers",
        multiple=True,
        metavar="HOST[:PORT]",
        help="Look for this host, too, where multicast does not reach; may be repeated.",
    ),
)


@click.group()
def config() -> None:
    """Check, show and explain the configuration, without a daemon.

    Example: nondum config check
    """


@config.command()
@click.argument("file", required=False, type=click.Path(path_type=Path))
@click.option("--user", is_flag=True, help="For `nondum host run --user`.")
@json_option
@click.pass_obj
def check(session: Session, file: Path | None, user: bool) -> int:
    """Tell all that is wrong with a configuration file. Exits with 3 when something is.

    Keys without effect are warned of. Without FILE, it is the one that the service reads.

    \b
    Examples: nondum config check
              nondum config check ./host.toml
    """
    asked = Asked(is_user=user, file=file)
    read = file_of(asked)
    try:
        chosen = effective(asked)
        _see_system_tree(chosen.host.system_tree)
        component_settings.load(chosen.workers.settings)
        warnings = tuple(remarks(asked))
    except ConfigRefused as refused:
        if session.as_json:
            told = [problem.to_dict() for problem in refused.problems]
            render.as_json({"ok": False, "file": str(read), "problems": told})
        else:
            for problem in refused.problems:
                tell_problem(problem)
        return EXIT_PROBLEMS
    if session.as_json:
        told = [problem.to_dict() for problem in warnings]
        file_read = str(read) if read else None
        render.as_json({"ok": True, "file": file_read, "problems": [], "warnings": told})
    else:
        for problem in warnings:
            tell_problem(problem, as_warning=True)
        said = f"{read} is right" if read else "there is no file: all is as by default, and right"
        click.echo(said)
    return 0


@config.command()
@asked_options
@click.option("--set", "only_set", is_flag=True, help="Only what is not as by default.")
@json_option
@click.pass_obj
def show(
    session: Session,
    user: bool,
    config_file: Path | None,
    name: str | None,
    peers: tuple[str, ...],
    only_set: bool,
) -> None:
    """Show what holds for a daemon that is started with these options, and who says so.

    \b
    Examples: nondum config show
              nondum config show --set
              nondum config show --user --name spot
    """
    found = [
        setting
        for setting in settings(Asked(user, config_file, name, peers))
        if not only_set or not setting.origin.startswith("default")
    ]
    if session.as_json:
        render.as_json({"settings": [setting.to_dict() for setting in found]})
        return
    rows = [{**setting.to_dict(), "value": as_toml(setting.value)} for setting in found]
    table(rows, ["key", "value", "from"], empty="All is as by default.")


def _completions(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    known = reference.keys()
    return [
        CompletionItem(key, help=known[key]["meaning"])
        for key in known
        if key.startswith(incomplete)
    ]


@config.command()
@click.argument("key", required=False, shell_complete=_completions)
@json_option
@click.pass_obj
def explain(session: Session, key: str | None) -> None:
    """Say what a key means, its unit, its default, and how it is written.

    Without KEY, all are listed.

    \b
    Examples: nondum config explain workers.memory_mb
              nondum config explain
    """
    if key is None:
        rows = [{"key": name, **told} for name, told in reference.keys().items()]
        if session.as_json:
            render.as_json({"keys": rows})
        else:
            table(rows, ["key", "default", "meaning"], empty="")
        return
    name, told = reference.find(key)
    if session.as_json:
        render.as_json({"key": name, **told})
        return
    section, _, short = name.partition(".")
    click.secho(f"[{section}] {short}", bold=True)
    render.sentence(told["meaning"])
    click.echo(f"  kind: {told['kind']}")
    if told["unit"]:
        click.echo(f"  unit: {told['unit']}")
    click.echo(f"  default: {told['default'] or 'from the machine, or none'}")
    click.echo(f"  example:\n    [{section}]\n    {short} = {told['example']}")


def _see_system_tree(name: str) -> None:
    from nondum.host.mind.system_tree import load_system_tree

    load_system_tree(name)
