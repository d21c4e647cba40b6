"""A plugin with one behaviour; it imports what it is delivered with: OpenCV, numpy and more."""

from __future__ import annotations

import cv2
import msgpack
import numpy as np
import serial
import zmq

from nondum.sdk import Context, Fragment, Phrase, Unit, behaviour, hookimpl


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Says which libraries came with it."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("scale", "sensor"),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("bench_big", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("weigh the big payload", "(weighed-big self)"),)


@behaviour("weigh", action="(weigh ?u - sensor ?h - host)")
async def weigh(ctx: Context, u: str, h: str) -> None:
    """Say which libraries are here."""
    ctx.log.info("OpenCV %s, numpy %s", cv2.__version__, np.__version__)
    versions = (serial.__version__, zmq.__version__, msgpack.version)
    ctx.log.info("serial %s, zmq %s, msgpack %s", *versions)
