"""Cgroups: what all processes of one worker may use together, and their sure end."""

from nondum.host.sandbox.cgroups.groups import Cgroup, Cgroups
from nondum.host.sandbox.cgroups.limits import CgroupLimits, Usage

__all__ = ["Cgroup", "CgroupLimits", "Cgroups", "Usage"]
