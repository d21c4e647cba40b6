"""Streams: who sends what to whom, and what is sent."""

from __future__ import annotations

import asyncio
from contextlib import closing
from typing import TYPE_CHECKING, Any

import click

from nondum.host.cli import complete, render
from nondum.host.cli.body import show
from nondum.host.cli.connection import Session, json_option
from nondum.host.cli.table import cell
from nondum.host.printable import printable

if TYPE_CHECKING:
    from nondum.sdk.messages import Message

LONGEST_FIELD = 60
"""Characters that are shown of one field of a message."""


@click.command()
@click.option(
    "--follow",
    "-f",
    "stream",
    metavar="STREAM",
    shell_complete=complete.streams,
    help="Print each message of this stream from now on, one line a message.",
)
@click.option(
    "--count", "-n", type=click.IntRange(min=1), help="With --follow: stop after so many messages."
)
@json_option
@click.pass_obj
def streams(session: Session, stream: str | None, count: int | None) -> None:
    """Who sends what to whom, and what is sent.

    A message is shown by its stamp (seconds since the host was switched on), its frame, its number
    in the stream, and its small fields. Slow readers get the newest: numbers may be left out.

    \b
    Examples: nondum streams
              nondum streams --follow panther__eye__image --count 10
              nondum streams --follow panther__eye__image --json
    """
    if stream is None:
        if count is not None:
            raise click.UsageError("--count is of use with --follow only")
        columns = ["stream", "type", "component", "flowing", "consumers"]
        show(session, session.ask("streams"), columns, "no streams")
    else:
        asyncio.run(_follow(session, stream, count))


async def _follow(session: Session, stream: str, count: int | None) -> None:
    from nondum.host.control.tap import numbered

    shown = 0
    with closing(session.connect()) as client:
        async for number, message in numbered(client, stream):
            if session.as_json:
                render.as_json_line(message_row(message, number))
            else:
                click.echo(message_line(message_row(message, number)))
            shown += 1
            if shown == count:
                return
    click.echo(f"{stream} has ended", err=True)


def message_row(message: Message, number: int) -> dict[str, Any]:
    """A message as plain data; of its bulk only the length. `seq` is what its author counts,
    `number` what the stream does."""
    fields, buffer = message.to_wire()
    header = fields.pop("header")
    row = {"stamp_s": header["stamp_s"], "frame_id": header["frame_id"], "seq": header["seq"]}
    row |= {"number": number, "type": message.TYPE, "fields": fields}
    if message.BUFFER is not None:
        row["bytes"] = 0 if buffer is None else memoryview(buffer).nbytes
    return row


def message_line(row: dict[str, Any]) -> str:
    """The same for people.

    >>> fields = {"value": 0.5, "unit": "1"}
    >>> message_line(
    ...     {"stamp_s": 12.5, "frame_id": "eye", "number": 3, "type": "scalar", "fields": fields}
    ... )
    '12.500000  eye  #3  value=0.5 unit=1'
    """
    fields = [f"{name}={_short(value)}" for name, value in row["fields"].items()]
    if "bytes" in row:
        fields.append(render.size(row["bytes"]))
    head = f"{row['stamp_s']:.6f}  {printable(row['frame_id']) or '-'}  #{row['number']}"
    return f"{head}  {' '.join(fields)}".rstrip()


def _short(value: Any) -> str:
    text = cell(value)
    if isinstance(value, list) and len(text) > LONGEST_FIELD:
        return f"{len(value)} items"
    return text if len(text) <= LONGEST_FIELD else f"{text[: LONGEST_FIELD - 1]}…"
