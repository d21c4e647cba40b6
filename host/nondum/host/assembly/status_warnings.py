"""What every status warns of that its catalogue, its daemon and its parts know."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.catalogue import opening
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.records.safety import Safety
from nondum.host.lifecycle import safe_mode


def of_catalogue(catalogue: Catalogue, why_safe: str) -> Iterator[str]:
    """That payloads are left alone, and what is wrong with the catalogue's file."""
    if (safety := catalogue.snapshot().safety) is not Safety.OFF:
        yield str(safe_mode.problem(safety, why=why_safe))
    if catalogue.loss is not None:
        yield str(opening.problem_of(catalogue.loss, ()))
    if catalogue.unwritten is not None:
        yield str(catalogue.unwritten)
