"""Codes of refusals: what stops the robot."""

from nondum.sdk.codes.code import Code

AREA = "Stopping"
CODES = (
    Code(
        "STOP_KEY",
        "The key that stops the robot cannot be listened to.",
        "plug its device in, and see `device` and `key` under [stop]",
    ),
)
