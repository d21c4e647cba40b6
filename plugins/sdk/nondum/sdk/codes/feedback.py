"""Codes of refusals: what shows people the host's state."""

from nondum.sdk.codes.code import Code

AREA = "Feedback"
CODES = (
    Code(
        "PROGRAM_FAILED",
        "A program that is told what happens cannot be run, or ended with an error.",
        "run it by hand with the same arguments; see `hook` under [feedback] or [stop]",
    ),
    Code(
        "PROGRAM_OVERDUE",
        "A program that is told what happens did not end, and was killed.",
        "have it end sooner, or raise `hook_deadline_s` of its table",
    ),
    Code(
        "LAMP_MISSING",
        "There is no lamp of that name.",
        "choose one of /sys/class/leds for `lamps` under [feedback], or plug it in",
    ),
    Code(
        "LAMP_TRIGGER",
        "The kernel has no module that blinks a lamp so.",
        "load it: `modprobe ledtrig-timer ledtrig-heartbeat`, and see to it at every boot",
    ),
    Code(
        "LAMP_UNREACHABLE",
        "A lamp may not be set by this user.",
        "run the helper, or the daemon as root",
    ),
    Code(
        "SOUND_FAILED",
        "The program that plays sounds cannot be run, or does not play.",
        "see `player` under [feedback]; the daemon's user must be allowed to open the sound card",
    ),
)
