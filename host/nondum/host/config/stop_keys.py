"""Names of keys and buttons. Source: Linux, include/uapi/linux/input-event-codes.h."""

from __future__ import annotations

import re

MOST = 0x2FF
"""KEY_MAX."""

_FIRST = """
ESC 1 2 3 4 5 6 7 8 9 0 MINUS EQUAL BACKSPACE TAB Q W E R T Y U I O P LEFTBRACE RIGHTBRACE ENTER
LEFTCTRL A S D F G H J K L SEMICOLON APOSTROPHE GRAVE LEFTSHIFT BACKSLASH Z X C V B N M COMMA DOT
SLASH RIGHTSHIFT KPASTERISK LEFTALT SPACE CAPSLOCK F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 NUMLOCK
SCROLLLOCK KP7 KP8 KP9 KPMINUS KP4 KP5 KP6 KPPLUS KP1 KP2 KP3 KP0 KPDOT
"""
"""From 1 on."""
_OTHERS = {
    "F11": 87,
    "F12": 88,
    "KPENTER": 96,
    "RIGHTCTRL": 97,
    "RIGHTALT": 100,
    "HOME": 102,
    "UP": 103,
    "PAGEUP": 104,
    "LEFT": 105,
    "RIGHT": 106,
    "END": 107,
    "DOWN": 108,
    "PAGEDOWN": 109,
    "INSERT": 110,
    "DELETE": 111,
    "MUTE": 113,
    "VOLUMEDOWN": 114,
    "VOLUMEUP": 115,
    "POWER": 116,
    "PAUSE": 119,
    "STOP": 128,
    "CANCEL": 223,
}
_BUTTONS = {
    "LEFT": 0x110,
    "RIGHT": 0x111,
    "MIDDLE": 0x112,
    "TRIGGER": 0x120,
    "SOUTH": 0x130,
    "EAST": 0x131,
    "NORTH": 0x133,
    "WEST": 0x134,
    "SELECT": 0x13A,
    "START": 0x13B,
    "MODE": 0x13C,
}
_BUTTON = re.compile(r"BTN_([0-9])")
_CODES = {
    **{f"KEY_{name}": code for code, name in enumerate(_FIRST.split(), start=1)},
    **{f"KEY_{name}": code for name, code in _OTHERS.items()},
    **{f"BTN_{name}": code for name, code in _BUTTONS.items()},
}


def code_of(name: str) -> int | None:
    """The code of a key by its name or number; None where there is no such key.

    >>> code_of("KEY_ESC"), code_of("KEY_SPACE"), code_of("KEY_KPDOT"), code_of("BTN_3")
    (1, 57, 83, 259)
    >>> code_of("119"), code_of("KEY_NO_SUCH"), code_of("0"), code_of("100000")
    (119, None, None, None)
    """
    if button := _BUTTON.fullmatch(name):
        return 0x100 + int(button[1])
    if name.isascii() and name.isdigit():
        return int(name) if 0 < int(name[:6]) <= MOST else None
    return _CODES.get(name)
