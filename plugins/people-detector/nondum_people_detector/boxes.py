"""Boxes with scores, and what becomes of many that mean the same person."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Found:
    """Somebody, or something, in an image: a box in pixels and how sure the detector is."""

    left: float
    top: float
    width: float
    height: float
    score: float
    class_id: str = "person"

    @property
    def area(self) -> float:
        """Square pixels."""
        return self.width * self.height


def overlap(one: Found, other: Found) -> float:
    """Intersection over union, 0 to 1.

    >>> overlap(Found(0, 0, 10, 10, 1), Found(5, 0, 10, 10, 1))
    0.3333333333333333
    """
    shared = _intersection(one, other)
    union = one.area + other.area - shared
    return shared / union if union > 0 else 0.0


def merged(found: Iterable[Found], limit: float) -> tuple[Found, ...]:
    """Make one box of each heap of boxes that mean the same thing, best first.

    A box belongs to the best heap whose best box it overlaps by more than `limit` (intersection
    over union), or inside or around which it lies all but whole: HOG likes to answer a person also
    with a box twice their size. A heap's box is its best one, moved to the mean place of them all,
    weighted by score, which jitters less.
    """
    heaps: list[list[Found]] = []
    for box in sorted(found, key=lambda box: -box.score):
        mates = (heap for heap in heaps if _same(box, heap[0], limit))
        heap = next(mates, None)
        if heap is None:
            heaps.append([box])
        else:
            heap.append(box)
    return tuple(_mean(heap) for heap in heaps)


def _same(box: Found, best: Found, limit: float) -> bool:
    smaller = min(box.area, best.area)
    inside = _intersection(box, best) / smaller if smaller > 0 else 1.0
    return box.class_id == best.class_id and (overlap(box, best) > limit or inside > _INSIDE)


_INSIDE = 0.8


def _mean(heap: Sequence[Found]) -> Found:
    weights = [max(box.score, _LEAST_WEIGHT) for box in heap]
    total = sum(weights)

    def mean(values: Iterable[float]) -> float:
        return sum(weight * value for weight, value in zip(weights, values, strict=True)) / total

    return replace(
        heap[0],
        left=mean(box.left + box.width / 2 for box in heap) - heap[0].width / 2,
        top=mean(box.top + box.height / 2 for box in heap) - heap[0].height / 2,
    )


_LEAST_WEIGHT = 0.05


def _intersection(one: Found, other: Found) -> float:
    width = min(one.left + one.width, other.left + other.width) - max(one.left, other.left)
    height = min(one.top + one.height, other.top + other.height) - max(one.top, other.top)
    return max(width, 0.0) * max(height, 0.0)
