"""The streams: their producers, readers and messages."""

from __future__ import annotations

import asyncio
from contextlib import closing
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import complete, render
from nondum.cli.body import show
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.table import cell, table
from nondum.host.core.printable import printable

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
    "--count", "-n", type=click.IntRange(min=1), help="With --follow: stop after this number."
)
@click.option("--inputs", is_flag=True, help="Show the optional inputs only.")
@click.option(
    "--connect",
    metavar="INPUT STREAM",
    nargs=2,
    shell_complete=complete.inputs,
    help="Have an optional input get this stream and no other, until --disconnect.",
)
@click.option(
    "--disconnect",
    metavar="INPUT",
    shell_complete=complete.inputs,
    help="Let the host pick what an optional input gets.",
)
@json_option
@click.pass_obj
def streams(
    session: Session,
    stream: str | None,
    count: int | None,
    inputs: bool,
    connect: tuple[str, str] | None,
    disconnect: str | None,
) -> None:
    """The streams: their producers, readers and messages.

    RATE is messages a second of late, as the component itself counts them.

    A message is shown by its stamp (seconds since the host was switched on), its frame, its number
    in the stream, and its small fields. Slow readers get the newest: numbers may be left out.

    Plans say which streams actions read. Optional inputs are in no plan: each gets a stream of its
    type that tells of what it asks for; where several do, --connect decides, and is remembered.

    \b
    Examples: nondum streams
              nondum streams --follow panther__eye__image --count 10
              nondum streams --follow panther__eye__image --json
              nondum streams --connect eye.camera.odometry panther__base__odometry
    """
    if count is not None and stream is None:
        raise click.UsageError("--count is of use with --follow only")
    if sum(map(bool, (stream, inputs, connect, disconnect))) > 1:
        raise click.UsageError("one of --follow, --inputs, --connect, --disconnect at a time")
    if connect is not None:
        _connect(session, *connect)
    elif disconnect is not None:
        _connect(session, disconnect, None)
    elif stream is not None:
        asyncio.run(_follow(session, stream, count))
    else:
        _show(session, with_streams=not inputs)


def _show(session: Session, *, with_streams: bool) -> None:
    if with_streams:
        columns = ["stream", "type", "component", "flowing", "rate", "consumers"]
        found = session.ask("streams")
        if session.as_json:
            render.as_json(found)
            return
        table([with_rate(row) for row in session.short(found)], columns, empty="no streams")
    rows = session.ask("inputs")
    if rows and with_streams:
        click.echo()
    if rows or not with_streams:
        show(session, rows, ["input", "stream", "why"], "no optional inputs")


def _connect(session: Session, name: str, stream: str | None) -> None:
    connected = session.ask("connect", input=name, stream=stream)
    if session.as_json:
        render.as_json(connected)
    elif stream is None:
        click.echo(f"{name}: the host picks again what it gets")
    else:
        click.echo(session.short(f"{name} gets {stream} from now on, and nothing else"))


def with_rate(row: dict[str, Any]) -> dict[str, Any]:
    """A stream's row with its rate as people read it."""
    return {**row, "rate": row["rate_hz"] and f"{row['rate_hz']:.3g}/s"}


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
