"""Estimates how far away things are in the images of one camera."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from nondum.sdk import (
    BehaviourFailed,
    CameraModel,
    Context,
    Data,
    Depth,
    Fragment,
    Image,
    Output,
    Phrase,
    ThreadContext,
    Unit,
    behaviour,
    hookimpl,
)
from nondum.sdk.settings import parse_settings
from nondum_depth_estimator.network import DepthNetwork, Distances
from nondum_depth_estimator.settings import Settings


@hookimpl
def describe() -> dict[str, str]:
    return {"summary": "Estimates how far away things are in the images of one camera."}


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("estimator", "depth-estimator", outputs=(Output("depth", "depth"),)),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("nondum_depth_estimator", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("[please] estimate distances", "(distances-known self)", kind="maintain"),)


@hookimpl
def start(ctx: ThreadContext) -> None:
    """Refuse wrong settings before anybody plans with them."""
    parse_settings(Settings, ctx.settings, where=ctx.component)


@behaviour(
    "estimate",
    action="(estimate ?u - depth-estimator ?i - image ?o - depth ?h - host)",
    lasting=True,
)
async def estimate(ctx: Context, u: str, i: str, o: str, h: str) -> None:
    """Estimate distances in the newest image, over and over, until halted; by other weights from
    the image on before which those are shown.

    Fails with DATA_MISSING and WEIGHTS_UNREADABLE.
    """
    settings = parse_settings(Settings, ctx.settings, where=ctx.component)
    cv2.setNumThreads(settings.threads)
    weights, network, is_established = _shown(ctx), None, False
    output = ctx.output(o)
    async for image in ctx.input(i):
        if network is None or (ctx.data("weights") or weights) != weights:
            weights = _shown(ctx)
            network = await asyncio.to_thread(DepthNetwork, weights.path, settings)
        distances = await asyncio.to_thread(network.distances, pixels(image))
        output.send(depth(image, distances))
        if not is_established:
            await ctx.established()
            is_established = True


def pixels(image: Image) -> npt.NDArray[np.uint8]:
    """An image as blue, green and red of 8 bits."""
    array: Any = image.array()
    if image.encoding == "rgb8":
        array = array[:, :, ::-1]
    elif image.encoding == "mono16":
        array = array >> 8
    if array.ndim == 2:
        array = cv2.cvtColor(array.astype(np.uint8), cv2.COLOR_GRAY2BGR)
    return np.ascontiguousarray(array, dtype=np.uint8)


def depth(image: Image, distances: Distances) -> Depth:
    """Distances as a message, with the image's stamp, frame and camera, whose pixels are fewer."""
    height, width = distances.shape
    camera = image.camera and _scaled(image.camera, width / image.width, height / image.height)
    return Depth.from_array(image.header, distances, "32FC1", camera)


def _scaled(camera: CameraModel, across: float, down: float) -> CameraModel:
    return replace(
        camera,
        width=round(camera.width * across),
        height=round(camera.height * down),
        fx=camera.fx * across,
        fy=camera.fy * down,
        cx=camera.cx * across,
        cy=camera.cy * down,
    )


def _shown(ctx: Context) -> Data:
    weights = ctx.data("weights")
    if weights is None:
        raise BehaviourFailed("no weights are here", code="DATA_MISSING")
    return weights
