"""A simulated thermal camera that pans with the body; a real one where it is plugged in."""

from __future__ import annotations

from functools import partial

from nondum.sdk import Context, DeviceNeed, Fragment, Input, Output, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_panorama.settings import CameraSettings
from nondum_panorama.streaming import opened, play, relay
from nondum_thermal_camera.simulation import open_simulation

DEVICE = "camera"


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Simulates a thermal camera that pans, or streams a real one."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (
        Unit(
            "thermal-eye",
            "camera",
            outputs=(Output("warmth", "image"),),
            inputs=(Input("odometry", "pose", of="base"),),
        ),
    )


@hookimpl
def devices() -> tuple[DeviceNeed, ...]:
    match = {
        "SUBSYSTEM": "video4linux",
        "ID_V4L_CAPABILITIES": "*:capture:*",
        "ID_V4L_PRODUCT": "*[Tt]hermal*",
    }
    return (DeviceNeed(DEVICE, match, optional=True),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_thermal_camera", "domain.pddl"),)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings."""
    parse_settings(CameraSettings, ctx.settings, where="thermal-camera")


@behaviour("stream", action="(stream ?u - camera ?o - image ?h - host)", lasting=True)
async def stream(ctx: Context, u: str, o: str, h: str) -> None:
    """Stream white-hot images with their camera model, until halted: simulated ones (mono8), or
    what a real camera gives.

    Fails with CAMERA_FAILED and RECORDING_UNREADABLE.
    """
    settings = parse_settings(CameraSettings, ctx.settings, where="thermal-camera")
    device = ctx.device(DEVICE)
    if device is not None:
        await relay(ctx, o, settings, device.node)
    else:
        clip = settings.read_clip()
        simulation = await opened(ctx.progress, partial(open_simulation, clip))
        await play(ctx, o, settings, clip, simulation.frame)
