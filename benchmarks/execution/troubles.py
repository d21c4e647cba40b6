"""What goes wrong in a simulated world, and how often."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Troubles:
    """Chances, of an action or of a moment. An action takes a moment."""

    silent: float = 0.0
    """A finishing action says that it has succeeded, and has done nothing."""
    changes: float = 0.0
    """In a moment, somebody else carries out some finishing action that is possible."""
    deaths: float = 0.0
    """In a moment, a lasting behaviour that is established ends by itself."""
    losses: float = 0.0
    """In a moment, some unit goes away, with all that it does; it is back 3 to 8 moments later."""

    def __str__(self) -> str:
        rates = {
            "of actions do nothing": self.silent,
            "of moments see a change from outside": self.changes,
            "of a lasting behaviour's moments are its last": self.deaths,
            "of moments see a unit go": self.losses,
        }
        return (
            ", ".join(f"{rate:.0%} {what}" for what, rate in rates.items() if rate)
            or "all goes well"
        )


KINDS = {
    "none": Troubles(),
    "silent actions": Troubles(silent=0.05),
    "outside changes": Troubles(changes=0.1),
    "deaths and losses": Troubles(deaths=0.02, losses=0.05),
    "everything": Troubles(silent=0.05, changes=0.1, deaths=0.02, losses=0.05),
}
EVERYTHING = "everything"
