"""A GPS receiver on a serial line: knows where the body is, and tells it."""

from __future__ import annotations

import asyncio

from nondum.sdk import (
    BehaviourFailed,
    Context,
    Device,
    DeviceNeed,
    Fragment,
    GpsFix,
    Header,
    Output,
    OutputStream,
    Phrase,
    Problem,
    Unit,
    behaviour,
    condition,
    hookimpl,
    serial_line,
)
from nondum.sdk.serial_line import SerialLine
from nondum.sdk.settings import parse_settings
from nondum_gps.reading import Reading
from nondum_gps.reception import Reception
from nondum_gps.settings import Settings

RECEIVER = "receiver"
"""The unit, and the device that is known by its identity."""
ADAPTER = "adapter"
"""A serial adapter that the machine's owner has named: it may have anything at its other end."""
KNOWN = "position-known"
_AGAIN_S = 0.5
"""How often is looked whether the device has come or gone, and whether the fix is too old."""


class Gps:
    """The plugin. The condition listens; the behaviour says what it has heard."""

    def __init__(self) -> None:
        self._settings = Settings()
        self._reception = Reception(self._settings, 0.0)
        self._trouble = ""
        """Why the line is not open."""

    @hookimpl
    def describe(self) -> dict[str, str]:
        """What it is."""
        return {"summary": "Knows where the body is, by a GPS receiver on a serial line."}

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        """What senses."""
        return (Unit(RECEIVER, "sensor", outputs=(Output("fix", "gps-fix", always=True),)),)

    @hookimpl
    def devices(self) -> tuple[DeviceNeed, ...]:
        """What it opens; payload.toml asks for the same."""
        return (
            DeviceNeed(RECEIVER, {"usb": "1546:01a*", "subsystem": "tty"}, optional=True),
            DeviceNeed(ADAPTER, {"NONDUM_GPS": "1", "subsystem": "tty"}, optional=True),
        )

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        """What it can do for a plan, and what it knows."""
        return (Fragment.from_package("nondum_gps", "domain.pddl"),)

    @hookimpl
    def phrases(self) -> tuple[Phrase, ...]:
        """How people ask."""
        patterns = ("where are you", "[please] tell me where you are", "what is your position")
        return tuple(Phrase(pattern, "(position-told self)", kind="do") for pattern in patterns)

    @hookimpl
    async def start(self, ctx: Context) -> None:
        """Refuse wrong settings."""
        self._settings = parse_settings(Settings, ctx.settings, where=ctx.component)
        self._reception = Reception(self._settings, _now_s())

    @condition("position", predicates=(KNOWN,))
    async def position(self, ctx: Context) -> None:
        """Listen to whatever receiver is there, for as long as it is there."""
        output = ctx.output("fix")
        while True:
            device = _device(ctx)
            if device is not None:
                await self._listen(ctx, device, output)
            await ctx.sleep(_AGAIN_S)

    async def _listen(self, ctx: Context, device: Device, output: OutputStream) -> None:
        self._reception = Reception(self._settings, _now_s())
        try:
            with SerialLine(device.node, self._settings.baud) as line:
                self._trouble = ""
                await self._follow(ctx, device, line, output)
        except BehaviourFailed as lost:
            if lost.code != serial_line.FAILED:
                raise
            trouble = lost.problems[0].message
            if trouble != self._trouble:  # it is tried again and again
                ctx.log.warning("%s: %s", device.node, trouble)
            self._trouble = trouble
        finally:
            self._reception = Reception(self._settings, _now_s())
            ctx.forget(KNOWN, ctx.host)

    async def _follow(
        self, ctx: Context, device: Device, line: SerialLine, output: OutputStream
    ) -> None:
        """Send every reading, and keep the fact true while there is a fix."""
        reception, number, was_lost = self._reception, 0, False
        while _device(ctx) == device:
            data = await _received(line)
            for reading in reception.take(data, _now_s()):
                number += 1
                fix = _message(reading, Header(frame_id=ctx.objects[RECEIVER], seq=number))
                output.send(fix)
                if reading.is_fix:
                    ctx.know(KNOWN, ctx.host, value=fix)
            is_lost = reception.is_lost(_now_s())
            if is_lost and not was_lost:
                ctx.forget(KNOWN, ctx.host)
                ctx.log.warning("%s", reception.problem(_now_s()))
            was_lost = is_lost

    @behaviour("tell-position", action="(tell-position ?u - sensor ?h - host)")
    async def tell_position(self, ctx: Context, u: str, h: str) -> str:
        """Answer where the body is.

        Fails with DEVICE_MISSING, SERIAL_FAILED, GPS_SILENT and GPS_NO_FIX.
        """
        device = _device(ctx)
        if device is None:
            raise _failed("DEVICE_MISSING", "no receiver is plugged in", "plug one in")
        if self._trouble:
            raise _failed(serial_line.FAILED, f"{device.node}: {self._trouble}", "check the cable")
        fix = self._reception.fix(_now_s())
        if fix is None:
            raise BehaviourFailed(self._reception.problem(_now_s()))
        return fix.in_words()


def _device(ctx: Context) -> Device | None:
    return ctx.device(RECEIVER) or ctx.device(ADAPTER)


def _now_s() -> float:
    return asyncio.get_running_loop().time()


async def _received(line: SerialLine) -> bytes:
    """What has come; nothing where nothing comes for a while."""
    try:
        async with asyncio.timeout(_AGAIN_S):
            return await line.receive()
    except TimeoutError:
        return b""


def _message(reading: Reading, header: Header) -> GpsFix:
    east, north, up = reading.variances_m2 or (0.0, 0.0, 0.0)
    covariance = (east, 0.0, 0.0, 0.0, north, 0.0, 0.0, 0.0, up)
    return GpsFix(
        header,
        latitude_deg=reading.place.latitude_deg,
        longitude_deg=reading.place.longitude_deg,
        altitude_m=reading.ellipsoid_m,
        covariance=covariance if reading.variances_m2 else None,
        status=reading.status,
    )


def _failed(code: str, message: str, fix: str) -> BehaviourFailed:
    return BehaviourFailed(Problem(code, message, where="gps", fix=fix))
