"""Cgroups: what all processes of one worker may use together, and their sure end."""

from nondum.host.cgroups.cage import CageLimits, Usage
from nondum.host.cgroups.cages import Cage, Cages

__all__ = ["Cage", "CageLimits", "Cages", "Usage"]
