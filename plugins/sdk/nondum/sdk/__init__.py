"""What authors of nondum plugins import.

    from nondum.sdk import Context, behaviour, hookimpl

Names are imported from their modules when they are first used: a host's command line that needs
one error class does not pay for an event loop.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nondum.sdk.context import Context, InputStream, OutputStream
    from nondum.sdk.decorators import behaviour, condition
    from nondum.sdk.description import (
        Behaviour,
        Condition,
        DeviceNeed,
        Fragment,
        Input,
        Label,
        Output,
        Phrase,
        PluginDescription,
        Unit,
    )
    from nondum.sdk.errors import (
        BehaviourFailed,
        ConfigRefused,
        DriveGone,
        FragmentRefused,
        FrameUnknown,
        GoalRefused,
        HostUnreachable,
        InstallFailed,
        LinkClosed,
        MessageInvalid,
        NondumError,
        PayloadRefused,
        PlannerFailed,
        Problem,
        ProtocolViolation,
        WorkerFailed,
    )
    from nondum.sdk.geometry import FrameTree, Transform
    from nondum.sdk.hooks import hookimpl, hookspec
    from nondum.sdk.messages import (
        MESSAGES,
        Audio,
        Bearing,
        BoundingBox2D,
        CameraModel,
        Depth,
        Detection,
        Detections,
        Header,
        Image,
        Message,
        Points,
        Pose,
        Quaternion,
        Scalar,
        Text,
        Twist,
        Vector,
    )
    from nondum.sdk.planner import (
        AlreadyTrue,
        Answer,
        GaveUp,
        GroundAction,
        GroundTask,
        Plan,
        Planner,
        Unsolvable,
    )
    from nondum.sdk.plugin import Plugin, describe, load
    from nondum.sdk.threads import ThreadContext, ThreadInputStream, ThreadOutputStream
    from nondum.sdk.ticked import Status, TickedBehaviour
    from nondum.sdk.workplace import Device

_HOME = {
    "Context": "context",
    "InputStream": "context",
    "OutputStream": "context",
    "behaviour": "decorators",
    "condition": "decorators",
    "Behaviour": "description",
    "Condition": "description",
    "DeviceNeed": "description",
    "Fragment": "description",
    "Input": "description",
    "Label": "description",
    "Output": "description",
    "Phrase": "description",
    "PluginDescription": "description",
    "Unit": "description",
    "BehaviourFailed": "errors",
    "ConfigRefused": "errors",
    "DriveGone": "errors",
    "FragmentRefused": "errors",
    "FrameUnknown": "errors",
    "GoalRefused": "errors",
    "HostUnreachable": "errors",
    "InstallFailed": "errors",
    "LinkClosed": "errors",
    "MessageInvalid": "errors",
    "NondumError": "errors",
    "PayloadRefused": "errors",
    "PlannerFailed": "errors",
    "Problem": "errors",
    "ProtocolViolation": "errors",
    "WorkerFailed": "errors",
    "FrameTree": "geometry",
    "Transform": "geometry",
    "hookimpl": "hooks",
    "hookspec": "hooks",
    "Audio": "messages",
    "Bearing": "messages",
    "BoundingBox2D": "messages",
    "CameraModel": "messages",
    "Depth": "messages",
    "Detection": "messages",
    "Detections": "messages",
    "Header": "messages",
    "Image": "messages",
    "MESSAGES": "messages",
    "Message": "messages",
    "Points": "messages",
    "Pose": "messages",
    "Quaternion": "messages",
    "Scalar": "messages",
    "Text": "messages",
    "Twist": "messages",
    "Vector": "messages",
    "AlreadyTrue": "planner",
    "Answer": "planner",
    "GaveUp": "planner",
    "GroundAction": "planner",
    "GroundTask": "planner",
    "Plan": "planner",
    "Planner": "planner",
    "Unsolvable": "planner",
    "Plugin": "plugin",
    "describe": "plugin",
    "load": "plugin",
    "ThreadContext": "threads",
    "ThreadInputStream": "threads",
    "ThreadOutputStream": "threads",
    "Status": "ticked",
    "TickedBehaviour": "ticked",
    "Device": "workplace",
}
"""Public name → the module that it is defined in."""


if not TYPE_CHECKING:  # a checker that saw this would take any misspelt name for good

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        globals()[name] = value  # from now on without this function
        return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]


__all__ = [
    "MESSAGES",
    "AlreadyTrue",
    "Answer",
    "Audio",
    "Bearing",
    "Behaviour",
    "BehaviourFailed",
    "BoundingBox2D",
    "CameraModel",
    "Condition",
    "ConfigRefused",
    "Context",
    "Depth",
    "Detection",
    "Detections",
    "Device",
    "DeviceNeed",
    "DriveGone",
    "Fragment",
    "FragmentRefused",
    "FrameTree",
    "FrameUnknown",
    "GaveUp",
    "GoalRefused",
    "GroundAction",
    "GroundTask",
    "Header",
    "HostUnreachable",
    "Image",
    "Input",
    "InputStream",
    "InstallFailed",
    "Label",
    "LinkClosed",
    "Message",
    "MessageInvalid",
    "NondumError",
    "Output",
    "OutputStream",
    "PayloadRefused",
    "Phrase",
    "Plan",
    "Planner",
    "PlannerFailed",
    "Plugin",
    "PluginDescription",
    "Points",
    "Pose",
    "Problem",
    "ProtocolViolation",
    "Quaternion",
    "Scalar",
    "Status",
    "Text",
    "ThreadContext",
    "ThreadInputStream",
    "ThreadOutputStream",
    "TickedBehaviour",
    "Transform",
    "Twist",
    "Unit",
    "Unsolvable",
    "Vector",
    "WorkerFailed",
    "behaviour",
    "condition",
    "describe",
    "hookimpl",
    "hookspec",
    "load",
]
