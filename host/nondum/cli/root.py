"""The root group. `nondum --help` must answer in under 0.2 s, so no command module is imported
before it is needed: names and one-line helps stand here, and a test holds them to the commands'
own. Other distributions bring more commands (`installed_commands`)."""

from __future__ import annotations

import os
import socket
import sys
from importlib import import_module
from typing import Any

import click
from click.shell_completion import CompletionItem, shell_complete

from nondum.cli import failure
from nondum.cli.connection import control_option
from nondum.cli.installed_commands import installed_commands, load, summary
from nondum.cli.session import Session
from nondum.sdk.errors import NondumError, Problem

PROGRAM = "nondum"
COMPLETE = "_NONDUM_COMPLETE"
"""The variable by which a shell asks for completions."""

COMMANDS: dict[str, tuple[str, str]] = {
    "advise": ("advise", "Which payloads would make a goal possible, and by which plan."),
    "behaviours": ("body", "What the robot can do."),
    "completion": ("shell", "Print the script that completes commands in a shell."),
    "components": ("body", "What the robot is made of at this moment."),
    "config": ("config", "Check, show and explain the configuration, without a daemon."),
    "data": ("body", "Models, maps and other data that are here, and which components see them."),
    "devices": ("devices", "What is plugged in, and who has it."),
    "doctor": ("doctor", "Look for what is wrong around this host, without a daemon."),
    "explain": ("explain", "Say what a code means, where it comes from, and what to do."),
    "facts": ("mind", "What the robot believes, and why."),
    "goal": ("act", "Give the robot a goal, in words or in PDDL."),
    "goals": ("mind", "What can be asked for now, and what was."),
    "halt": ("act", "Halt what the robot is doing."),
    "host": ("host", "Run the daemon."),
    "journal": ("past", "What happened on this host, oldest first."),
    "keys": ("keys", "Whose payloads robots run, and which hosts a fleet certifies."),
    "logs": ("past", "What components have written."),
    "mount": ("act", "Tell where on the body a unit is mounted."),
    "payload": ("payload", "Make, judge and install payloads."),
    "peers": ("peers", "Other hosts: which are here, and which this host trusts."),
    "place": ("place", "Payloads that run on another host, and where one is to run."),
    "plan": ("mind", "The plans that are being carried out, that of the most urgent goal first."),
    "retry": ("act", "Try again what was refused or quarantined."),
    "say": ("act", "Say something to the robot, as if it had heard it."),
    "status": ("status", "The host, its payloads and its goals at a glance."),
    "stop": ("act", "Stop this host and its peers at once."),
    "store": ("body", "The wheels and data that this host keeps."),
    "streams": ("streams", "The streams: their producers, readers and messages."),
    "tree": ("tree", "The behaviour tree as it is being ticked, and why."),
    "units": ("body", "What the robot has to act with."),
    "watch": ("watch", "One live screen: what is wrong, goals, plan, parts, streams."),
    "why": ("mind", "Why the robot does what it does, or why it cannot."),
}


class LazyGroup(click.Group):
    """Knows its commands by name, and imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(_helps())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            module = import_module(f"nondum.cli.{COMMANDS[cmd_name][0]}")
            command: click.Command = getattr(module, cmd_name)
            return command
        entry = installed_commands().get(cmd_name)
        return None if entry is None else load(entry)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and args[0] not in installed_commands():
            import difflib  # as slow to import as the rest of this module

            near = difflib.get_close_matches(args[0], self.list_commands(ctx), n=1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            ctx.fail(f"No such command {args[0]!r}.{hint}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        found = {name: told for name, told in _helps().items() if name.startswith(incomplete)}
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(name, help=told) for name, told in found.items()), *options]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_helps().items()))


def _helps() -> dict[str, str]:
    """The one-line help of each command, in the order of the alphabet."""
    others = {name: summary(entry) for name, entry in installed_commands().items()}
    return dict(sorted((others | {name: told for name, (_, told) in COMMANDS.items()}).items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exits with 0: done, 1: refused or failed, 2: wrong usage or bad input, 3: problems "
    "found, 4: no daemon.",
)
@control_option
@click.version_option(package_name="nondum")
def cli() -> None:
    """Rebuild a robot in the field: plug in a payload, and the robot plans with it.

    \b
    Example: nondum host run --user &
             nondum payload install DRIVE
             nondum goals
    """


def run(arguments: list[str], asked_to_stop: tuple[str, socket.socket] | None) -> None:
    """Run the command line and exit: 0 done, 1 refused or failed, 2 wrong usage or bad input,
    3 problems found, 4 no daemon, 130 interrupted, 141 the reader of the output has left.

    `asked_to_stop`: what `ask_to_stop` gave, if that was asked already.
    """
    try:
        code = _run(arguments, Session(asked_to_stop=asked_to_stop))
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has left, as after `| head`
        # Nothing can be written, but the interpreter would try, and complain, at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = failure.EXIT_BROKEN_PIPE
    sys.exit(code)


def _run(arguments: list[str], session: Session) -> int:
    """What click's own `main` would do, but for pipes, which it closes with the wrong code."""
    if instruction := os.environ.get(COMPLETE):
        return shell_complete(cli, {"obj": session}, PROGRAM, COMPLETE, instruction)
    color = False if os.environ.get("NO_COLOR") else None
    try:
        with cli.make_context(PROGRAM, arguments, obj=session, color=color) as ctx:
            code: Any = cli.invoke(ctx)
    except click.exceptions.Exit as end:  # --help and --version
        return end.exit_code
    except (click.exceptions.Abort, KeyboardInterrupt):
        return failure.EXIT_INTERRUPTED
    except click.ClickException as error:
        if session.as_json:
            failure.tell(NondumError(Problem("USAGE", error.format_message())), as_json=True)
        else:
            error.show()
        return failure.EXIT_BAD_INPUT
    except NondumError as error:
        return failure.tell(error, as_json=session.as_json)
    except OSError as error:
        if isinstance(error, BrokenPipeError) or error.filename is None:
            raise
        problem = Problem("FILE", error.strerror or str(error), where=str(error.filename))
        return failure.tell(NondumError(problem), as_json=session.as_json)
    return code if isinstance(code, int) else 0
