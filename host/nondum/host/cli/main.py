"""The root group. `nondum --help` must answer in under 0.2 s, so no command module is imported
before it is needed: names and one-line helps stand here, and a test holds them to the commands'
own."""

from __future__ import annotations

import difflib
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from nondum.host.cli import failure
from nondum.sdk.errors import NondumError

COMMANDS: dict[str, tuple[str, str]] = {
    "behaviours": ("look", "What the robot can do."),
    "completion": ("shell", "Print the shell completion script."),
    "components": ("look", "What the robot is made of at this moment."),
    "facts": ("look", "What the robot believes, and why."),
    "goal": ("act", "Give the robot a goal, in words or in PDDL."),
    "goals": ("look", "What can be asked for now, and what was."),
    "halt": ("act", "Halt what the robot is doing."),
    "host": ("host", "Run the daemon."),
    "journal": ("look", "What happened on this host, oldest first."),
    "logs": ("look", "What components have written."),
    "mount": ("act", "Tell where on the body a unit is mounted."),
    "payload": ("payload", "Make, judge and install payloads."),
    "plan": ("look", "The plan that is being carried out."),
    "status": ("look", "The host, its payloads and its task at a glance."),
    "store": ("look", "The wheels that this host keeps."),
    "streams": ("look", "Who sends what to whom."),
    "tree": ("look", "The behaviour tree as it is being ticked."),
    "units": ("look", "What the robot has to act with."),
    "why": ("look", "Why the robot does what it does, or why it cannot."),
}


class LazyGroup(click.Group):
    """Knows its commands by name, and imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"nondum.host.cli.{COMMANDS[cmd_name][0]}")
        command: click.Command = getattr(module, cmd_name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS:
            near = difflib.get_close_matches(args[0], COMMANDS, n=1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            ctx.fail(f"No such command {args[0]!r}.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][1]) for name in sorted(COMMANDS)])


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: nondum host run --user & nondum payload install DIR && nondum goals",
)
@click.option(
    "--control",
    type=click.Path(path_type=Path),
    envvar="NONDUM_CONTROL",
    help="The daemon's control socket [default: this user's, else the system's].",
)
@click.version_option(package_name="nondum")
@click.pass_context
def cli(ctx: click.Context, control: Path | None) -> None:
    """Rebuild a robot in the field: plug in a payload, and the robot plans with it."""
    ctx.obj = control


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 refused or failed, 2 wrong usage or bad input,
    3 problems found, 4 no daemon."""
    try:
        code: Any = cli.main(args=arguments, prog_name="nondum", standalone_mode=False)
    except click.exceptions.Abort:
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except NondumError as error:
        sys.exit(failure.tell(error))
    except BrokenPipeError:
        sys.exit(141)  # the reader of a pipe has left, as after `| head`
    sys.exit(code if isinstance(code, int) else 0)
