"""Where every unit sits: the mount table as a tree of frames.

Axes are those of REP-103 (x forward, y left, z up), metres and radians. The body's frame has the
host's name, a unit's frame the unit's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.snapshot import Snapshot
from nondum.sdk.geometry import FrameTree, Transform

MAX_DISTANCE_M = 5.0
"""Nothing is mounted farther from the middle of a body that a person can hand a drive to."""
MAX_ANGLE_RAD = math.tau


def transforms(host: str, mounts: Iterable[MountPose]) -> Mapping[str, tuple[str, Transform]]:
    """Each unit's frame → its parent and its pose in it."""
    return {m.unit: (host, Transform.from_rpy(m.xyz, m.rpy)) for m in mounts}


def frame_tree(host: str, mounts: Iterable[MountPose]) -> FrameTree:
    """The frames of a body."""
    return FrameTree(transforms(host, mounts))


def mounts_to_wire(host: str, mounts: Iterable[MountPose]) -> dict[str, list[object]]:
    """The mount table as workers are told it: `{frame: [parent, xyz, xyzw]}`."""
    return {
        frame: [parent, list(pose.translation), list(pose.rotation)]
        for frame, (parent, pose) in transforms(host, mounts).items()
    }


def mounts_of_all(snapshot: Snapshot) -> dict[str, list[object]]:
    """The mount tables of this host and its peers; each peer is a separate body."""
    found = mounts_to_wire(snapshot.host, snapshot.mounts)
    for peer in snapshot.peers:
        found |= mounts_to_wire(peer.name, peer.mounts)
    return found


def implausible(mount: MountPose) -> Iterator[str]:
    """Sentences about a pose that a person should look at again."""
    distance_m = math.dist(mount.xyz, (0.0, 0.0, 0.0))
    if not math.isfinite(distance_m) or distance_m > MAX_DISTANCE_M:
        yield f"{mount.unit} is mounted {distance_m:.3g} m from the body's frame; metres are meant"
    if any(not math.isfinite(angle) or abs(angle) > MAX_ANGLE_RAD for angle in mount.rpy):
        angles = " ".join(f"{angle:.4g}" for angle in mount.rpy)
        yield f"{mount.unit} is turned by {angles} rad; radians are meant, not degrees"


def mount_warnings(mounts: Iterable[MountPose]) -> tuple[str, ...]:
    """All that is doubtful in a mount table."""
    return tuple(sentence for mount in mounts for sentence in implausible(mount))
