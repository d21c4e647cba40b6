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
    "KEY_F11": 87,
    "KEY_F12": 88,
    "KEY_KPENTER": 96,
    "KEY_RIGHTCTRL": 97,
    "KEY_RIGHTALT": 100,
    "KEY_HOME": 102,
    "KEY_UP": 103,
    "KEY_PAGEUP": 104,
    "KEY_LEFT": 105,
    "KEY_RIGHT": 106,
    "KEY_END": 107,
    "KEY_DOWN": 108,
    "KEY_PAGEDOWN": 109,
    "KEY_INSERT": 110,
    "KEY_DELETE": 111,
    "KEY_MUTE": 113,
    "KEY_VOLUMEDOWN": 114,
    "KEY_VOLUMEUP": 115,
    "KEY_POWER": 116,
    "KEY_PAUSE": 119,
    "KEY_STOP": 128,
    "KEY_CANCEL": 223,
    "BTN_LEFT": 0x110,
    "BTN_RIGHT": 0x111,
    "BTN_MIDDLE": 0x112,
    "BTN_TRIGGER": 0x120,
    "BTN_SOUTH": 0x130,
    "BTN_EAST": 0x131,
    "BTN_NORTH": 0x133,
    "BTN_WEST": 0x134,
    "BTN_SELECT": 0x13A,
    "BTN_START": 0x13B,
    "BTN_MODE": 0x13C,
}
_BUTTON = re.compile(r"BTN_([0-9])")
_CODES = {f"KEY_{name}": code for code, name in enumerate(_FIRST.split(), start=1)} | _OTHERS


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
