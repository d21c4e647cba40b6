"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Meaning = Literal["metres", "inverse"]
Colours = Literal["imagenet", "unit"]


@dataclass(frozen=True, slots=True)
class Settings:
    """How the network that is shown takes images, and what its answer means."""

    width: int = 256
    """Of its input in pixels."""
    height: int = 256
    colours: Colours = "imagenet"
    """How its input has colours: `imagenet` or `unit`."""
    output: Meaning = "metres"
    """`metres`, or `inverse`: the more, the nearer."""
    scale: float = 1.0
    """Factor for the network's answer, before `shift`."""
    shift: float = 0.0
    """Added to it: metres, or, of an inverse answer, their inverse."""
    furthest_m: float = 50.0
    """What is said to be further away is not known."""
    threads: int = 2
    """Threads that OpenCV may use."""

    def __post_init__(self) -> None:
        if self.width < 32 or self.height < 32 or self.threads < 1:
            raise ValueError("width and height must be at least 32, threads at least 1")
        if self.scale == 0 or self.furthest_m <= 0:
            raise ValueError("scale must not be 0, furthest_m must be above 0")
