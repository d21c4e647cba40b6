"""Shell completion."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from nondum.host.cli.failure import EXIT_BAD_INPUT


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> int:
    """Print the shell completion script.

    \b
    Example: nondum completion bash > ~/.local/share/bash-completion/completions/nondum
    """
    kind = get_completion_class(shell)
    if kind is None:
        return EXIT_BAD_INPUT
    root = ctx.find_root()
    click.echo(kind(root.command, {}, "nondum", "_NONDUM_COMPLETE").source())
    return 0
