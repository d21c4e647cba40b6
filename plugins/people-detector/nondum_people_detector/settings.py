"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass

from nondum_people_detector.network import Layout


@dataclass(frozen=True, slots=True)
class Settings:
    """People are found by HOG where no weights are shown, otherwise by the network that they are
    of."""

    threshold: float = 0.3
    """How sure is sure enough: distance from the SVM's plane (HOG), or the network's score."""
    scale: float = 1.05
    """Step of HOG's image pyramid: 1.1 is twice as fast and misses a few more."""
    enlarge: float = 1.0
    """Factor for the image before HOG, which finds people from about 80 pixels of height on."""
    overlap: float = 0.5
    """Boxes that overlap more (intersection over union) mean the same person."""
    threads: int = 2
    """Threads that OpenCV may use."""
    weights_size: int = 640
    """Side of its square input in pixels."""
    weights_layout: Layout = "v8"
    """`v8` or `v5`: see the README."""
    weights_class: int = 0
    """Place of the class `person` among its classes."""

    def __post_init__(self) -> None:
        if not 1.01 <= self.scale <= 2:
            raise ValueError(f"scale is {self.scale}; it must lie between 1.01 and 2")
        if not 0.25 <= self.enlarge <= 4:
            raise ValueError(f"enlarge is {self.enlarge}; it must lie between 0.25 and 4")
        if self.threads < 1 or self.weights_size < 32 or self.weights_class < 0:
            raise ValueError("threads, weights_size and weights_class must be positive numbers")
