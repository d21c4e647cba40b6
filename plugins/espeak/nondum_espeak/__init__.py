"""eSpeak NG's voices, and ways for what they say to leave the machine."""

from nondum_espeak.espeak import Espeak, Spoken, VoiceUnknown
from nondum_espeak.outlets import Folder, Outlet, Player, find_outlet, find_player

__all__ = [
    "Espeak",
    "Folder",
    "Outlet",
    "Player",
    "Spoken",
    "VoiceUnknown",
    "find_outlet",
    "find_player",
]
