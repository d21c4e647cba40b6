"""A recording as a camera that pans with the body; a V4L2 camera where there is one."""

from __future__ import annotations

from functools import partial

from nondum.sdk import Context, DeviceNeed, Fragment, Input, Output, Unit, behaviour, hookimpl
from nondum.sdk.settings import parse_settings
from nondum_panorama.settings import CameraSettings
from nondum_panorama.streaming import open_recording, opened, play, relay

DEVICE = "camera"


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Plays a recording as a camera that pans, or streams a real one."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (
        Unit(
            "camera",
            "camera",
            outputs=(Output("image", "image"),),
            inputs=(Input("odometry", "pose", of="base"),),
        ),
    )


@hookimpl
def devices() -> tuple[DeviceNeed, ...]:
    match = {"SUBSYSTEM": "video4linux", "ID_V4L_CAPABILITIES": "*:capture:*"}
    return (DeviceNeed(DEVICE, match, optional=True),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_recorded_camera", "domain.pddl"),)


@hookimpl
async def start(ctx: Context) -> None:
    """Refuse wrong settings."""
    parse_settings(CameraSettings, ctx.settings, where="recorded-camera")


@behaviour("stream", action="(stream ?u - camera ?o - image ?h - host)", lasting=True)
async def stream(ctx: Context, u: str, o: str, h: str) -> None:
    """Stream colour images (bgr8) with their camera model, until halted.

    Fails with CAMERA_FAILED and RECORDING_UNREADABLE.
    """
    settings = parse_settings(CameraSettings, ctx.settings, where="recorded-camera")
    device = ctx.device(DEVICE)
    if device is not None:
        await relay(ctx, o, settings, device.node)
    else:
        clip = settings.read_clip()
        recording = await opened(ctx.progress, partial(open_recording, clip))
        await play(ctx, o, settings, clip, recording.frame)
