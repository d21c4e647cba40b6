"""Shell completion."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from nondum.cli.root import COMPLETE, PROGRAM

SHELLS = ("bash", "fish", "zsh")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the script that completes commands in a shell.

    Components, units, streams and goals are completed from the running host.

    \b
    Examples: nondum completion bash > ~/.local/share/bash-completion/completions/nondum
              nondum completion fish > ~/.config/fish/completions/nondum.fish
              nondum completion zsh > "${fpath[1]}/_nondum"
    """
    kind = get_completion_class(shell)
    assert kind is not None  # click knows all of SHELLS
    root = ctx.find_root()
    click.echo(kind(root.command, {}, PROGRAM, COMPLETE).source())
