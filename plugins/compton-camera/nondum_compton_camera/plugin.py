"""A Compton camera on a serial line: finds the bearing of a radiation source."""

from __future__ import annotations

import asyncio
import math

from nondum.sdk import (
    Bearing,
    BehaviourFailed,
    Context,
    DeviceNeed,
    Fragment,
    Header,
    Label,
    Phrase,
    Problem,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.serial_line import SerialLine
from nondum_compton_camera.kinematics import Instrument
from nondum_compton_camera.observation import Observation
from nondum_compton_camera.settings import Settings

DEVICE = "list-mode"
_SILENCE_S = 5.0


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Finds the bearing of a radiation source with a Compton camera."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("gamma-eye", "sensor", users=1),)


@hookimpl
def devices() -> tuple[DeviceNeed, ...]:
    match = {"SUBSYSTEM": "tty", "ID_VENDOR_ID": "0403", "ID_MODEL": "Compton_List_Mode*"}
    return (DeviceNeed(DEVICE, match),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    names = ("domain.pddl", "problem.pddl")
    return tuple(Fragment.from_package("nondum_compton_camera", name) for name in names)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("[please] locate {t:target}", "(bearing-known ?t self)"),)


@hookimpl
def labels() -> tuple[Label, ...]:
    words = ("the radiation source", "radiation source", "the source of radiation")
    return tuple(Label("radiation-source", word) for word in words)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings."""
    Settings.parse(ctx.settings)


@behaviour("localise", action="(localise ?u - sensor ?t - target ?h - host)")
async def localise(ctx: Context, u: str, t: str, h: str) -> None:
    """Listen until the source's bearing is known well enough.

    Fails with DEVICE_MISSING, SERIAL_FAILED, COMPTON_SILENT (no valid frame on the line) and
    COMPTON_NO_SOURCE (time is up).
    """
    settings = Settings.parse(ctx.settings)
    device = ctx.device(DEVICE)
    if device is None:
        raise _failed("DEVICE_MISSING", "the camera is not plugged in", "plug it in")
    observation = Observation(Instrument(line_kev=settings.line_kev))
    with SerialLine(device.node, int(settings.baud)) as line:
        try:
            async with asyncio.timeout(settings.timeout_s):
                await _observe(ctx, line, observation, math.radians(settings.accuracy_deg))
        except TimeoutError:
            raise _no_source(observation, settings) from None
    found = observation.estimate
    if found is not None:
        header = Header(frame_id=u)
        ctx.know("bearing-known", t, h, value=Bearing(header, found.direction, found.sigma_rad))


async def _observe(
    ctx: Context, line: SerialLine, observation: Observation, accuracy_rad: float
) -> None:
    while not observation.is_good(accuracy_rad):
        observation.add(await _received(line, observation))
        if observation.is_due:
            await asyncio.to_thread(observation.look)
            _tell(ctx, observation, accuracy_rad)


async def _received(line: SerialLine, observation: Observation) -> bytes:
    try:
        async with asyncio.timeout(_SILENCE_S):
            return await line.receive()
    except TimeoutError:
        raise _failed(
            "COMPTON_SILENT",
            f"nothing came for {_SILENCE_S:g} s after {observation.events} events",
            "switch the camera on, check its cable",
        ) from None


def _tell(ctx: Context, observation: Observation, accuracy_rad: float) -> None:
    seen = observation.estimate
    if seen is None or not math.isfinite(seen.sigma_rad):
        return
    fraction = min(1.0, (accuracy_rad / seen.sigma_rad) ** 2)
    words = f"{math.degrees(seen.sigma_rad):.1f}° after {observation.events} events"
    ctx.progress(fraction, words)


def _no_source(observation: Observation, settings: Settings) -> BehaviourFailed:
    seen = observation.estimate
    if not observation.events:
        words = f"no event among {observation.discarded} bytes that are no list-mode frames"
        return _failed("COMPTON_SILENT", words, "check that the device is a Compton camera")
    cones = seen.events if seen else 0
    sigma = f"{math.degrees(seen.sigma_rad):.1f}°" if seen else "no direction at all"
    words = (
        f"after {settings.timeout_s:g} s: {observation.events} events, {cones} of them at "
        f"{settings.line_kev:g} keV, known to {sigma}"
    )
    return _failed("COMPTON_NO_SOURCE", words, "go nearer, or set the line of the isotope")


def _failed(code: str, message: str, fix: str) -> BehaviourFailed:
    return BehaviourFailed(Problem(code, message, where="compton-camera", fix=fix))
