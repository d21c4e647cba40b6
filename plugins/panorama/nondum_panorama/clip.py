"""A clip: a recording, and what is stated about it in the TOML file beside it."""

from __future__ import annotations

import csv
import dataclasses
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Clip:
    """A recording that is played as a panorama, and the geometry it is taken to have.

    Columns are proportional to azimuth (a strip of a cylinder); azimuth grows to the left, as
    heading does in REP-103.
    """

    video: Path
    reference: Path | None
    """CSV `frame,column` of one person's true place, for judging; nothing that steers reads it."""
    frames_per_s: float
    first: int
    """First frame that is played, and the one a stream begins with."""
    last: int
    """Last frame that is played, included."""
    rest_s: float
    """How long the first and the last frame stand still before the recording turns."""
    field_of_view_deg: float
    """Azimuth that the full width spans."""
    width: int
    height: int
    horizon_row: float
    """Row at elevation zero."""
    ahead_column: float
    """Column that lies straight ahead of the body when a stream begins."""

    @property
    def pixels_per_rad(self) -> float:
        """Focal length of the cylinder, in pixels."""
        return self.width / math.radians(self.field_of_view_deg)

    def azimuth(self, column: float) -> float:
        """Radians to the left of straight ahead at the start.

        >>> clip = stated(Path("x.avi"), width=768, ahead_column=384.0, field_of_view_deg=90.0)
        >>> round(math.degrees(clip.azimuth(0.0)), 6)
        45.0
        """
        return (self.ahead_column - column) / self.pixels_per_rad

    def column(self, azimuth: float) -> float:
        """The column that lies `azimuth` radians to the left of straight ahead at the start."""
        return self.ahead_column - azimuth * self.pixels_per_rad


def stated(
    video: Path,
    *,
    reference: Path | None = None,
    frames_per_s: float = 10.0,
    first: int = 0,
    last: int = 0,
    rest_s: float = 0.0,
    field_of_view_deg: float = 90.0,
    width: int,
    height: int = 576,
    horizon_row: float | None = None,
    ahead_column: float | None = None,
) -> Clip:
    """A clip with plain defaults: the middle of the frame lies ahead and on the horizon.

    Raises `ValueError` for a stretch or a field of view that cannot be.
    """
    if not 0 <= first <= last:
        raise ValueError(f"a stretch from frame {first} to frame {last} cannot be played")
    if not 0 < field_of_view_deg <= 360:
        raise ValueError(f"a field of view of {field_of_view_deg} degrees cannot be")
    return Clip(
        video=video,
        reference=reference,
        frames_per_s=frames_per_s,
        first=first,
        last=last,
        rest_s=rest_s,
        field_of_view_deg=field_of_view_deg,
        width=width,
        height=height,
        horizon_row=height / 2 if horizon_row is None else horizon_row,
        ahead_column=width / 2 if ahead_column is None else ahead_column,
    )


def read_clip(notes: Path) -> Clip:
    """Read the TOML file beside a recording; paths in it are relative to it.

    Raises `ValueError` for unknown or impossible statements, `OSError` when it cannot be read.
    """
    said = tomllib.loads(notes.read_text(encoding="utf-8"))
    unknown = sorted(set(said) - {field.name for field in dataclasses.fields(Clip)})
    if unknown:
        raise ValueError(f"{notes}: unknown statement {unknown[0]!r}")
    video = notes.parent / said.pop("video")
    reference = said.pop("reference", None)
    return stated(video, reference=notes.parent / reference if reference else None, **said)


def packaged_clip() -> Clip:
    """The clip that this distribution carries: people walking, 15 s."""
    return read_clip(Path(__file__).with_name("data") / "pedestrians.toml")


def read_reference(path: Path) -> dict[int, float]:
    """Frame number → column of the reference person, from `frame,column` rows."""
    with path.open(newline="", encoding="utf-8") as lines:
        return {int(row["frame"]): float(row["column"]) for row in csv.DictReader(lines)}
