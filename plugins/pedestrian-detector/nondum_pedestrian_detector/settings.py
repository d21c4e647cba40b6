"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """How people are looked for."""

    threshold: float = 1.0
    """How sure is sure enough: distance from the SVM's plane."""
    scale: float = 1.1
    """Step of the image pyramid: 1.05 takes twice the time and finds hardly more."""
    overlap: float = 0.65
    """Two windows that share more of the smaller one mean the same person."""
    threads: int = 1
    """Threads that OpenCV may use."""

    def __post_init__(self) -> None:
        if self.threshold <= 0:
            raise ValueError(f"threshold is {self.threshold}; it must be positive")
        if not 1.01 <= self.scale <= 2:
            raise ValueError(f"scale is {self.scale}; it must lie between 1.01 and 2")
        if not 0 < self.overlap < 1:
            raise ValueError(f"overlap is {self.overlap}; it must lie between 0 and 1")
        if self.threads < 1:
            raise ValueError(f"threads is {self.threads}; it must be positive")
