"""A lamp that shines."""

from __future__ import annotations

from nondum.sdk import Context, Fragment, Phrase, Unit, behaviour, hookimpl

from $module.lamp import Lamp


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("lamp", "light"),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment.from_package("$module", "domain.pddl"),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("shine the $words", "(lit self)", kind="maintain"),)


@behaviour("shine", action="(shine ?u - light ?h - host)", lasting=True)
async def shine(ctx: Context, u: str, h: str) -> None:
    """Shine until halted; fails when the lamp goes out."""
    period_s = float(ctx.settings.get("check_period_s", 0.5))
    lamp = Lamp(ctx.log)
    lamp.switch_on()
    try:
        await ctx.established()
        while True:
            await ctx.sleep(period_s)
            lamp.check()
    finally:
        lamp.switch_off()
