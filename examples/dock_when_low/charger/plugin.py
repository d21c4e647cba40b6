"""The charger as a plugin: a condition and a behaviour."""

from __future__ import annotations

from charger.battery import FULL, SimulatedBattery
from nondum.sdk import Context, Fragment, Unit, behaviour, condition, hookimpl

PERIOD_S = 0.1
DISCHARGED, CHARGED = 0.002, 0.1
"""By how much the simulated battery changes in each period."""


class Charger:
    """One charger and its battery."""

    def __init__(self) -> None:
        self.battery = SimulatedBattery()

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        return (Unit("dock", "charger"),)

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        return (Fragment.from_package("charger", "domain.pddl"),)

    @condition("battery", predicates=("low-battery",))
    async def watch(self, ctx: Context) -> None:
        """Tell when the battery is low. It discharges meanwhile, from the setting `charge` on."""
        self.battery.charge = float(ctx.settings.get("charge", 1.0))
        while True:
            self.battery.change(-DISCHARGED)
            if self.battery.is_low:
                ctx.know("low-battery", ctx.host)
            else:
                ctx.forget("low-battery", ctx.host)
            await ctx.sleep(PERIOD_S)

    @behaviour("dock", action="(dock ?u - charger ?h - host)")
    async def dock(self, ctx: Context, u: str, h: str) -> None:
        """Charge until the battery is full."""
        while self.battery.charge < FULL:
            self.battery.change(CHARGED)
            ctx.progress(self.battery.charge, "charged")
            await ctx.sleep(PERIOD_S)
