"""Cgroups: what all processes of one worker may use together, and their sure end."""

from nondum.host.sandbox.cgroups.groups import Cage, Cages
from nondum.host.sandbox.cgroups.limits import CageLimits, Usage

__all__ = ["Cage", "CageLimits", "Cages", "Usage"]
