"""`./run campaign`: tests that take too long for every run, a few minutes at a time."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import secrets
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from tests.campaign import driver, page
from tests.campaign.age import Age, ages
from tests.campaign.driver import AlreadyRunning, Outcome
from tests.campaign.progress import Limit, minutes_of
from tests.campaign.registry import CAMPAIGNS

ROOT = Path(__file__).parents[2]
SHORTEST_MINUTES = 5.0
"""Less is not worth it, unless it is asked for: fewer campaigns get as much each."""
INTERRUPTED = 130
EXAMPLES = """\
examples:
  ./run campaign --minutes 120             those with the oldest results first, 120 minutes in all
  ./run campaign faults fuzz --minutes 20  these two, ten minutes each
  ./run campaign mutation                  this one, until all of it is done
  ./run campaign faults --seed 7           with the lots that were drawn in a former run
  ./run campaign --list                    what there is, and how old the results are

A campaign whose time is over goes on there the next time, unless what it covers has changed.
The last result of each is written into docs/reliability/campaigns.md.
"""


def main(words: Sequence[str], root: Path = ROOT) -> int:
    """Run what is asked for; 1 if anything failed."""
    if "--needs" in words:
        print(*sorted(needs([word for word in words if word != "--needs"])))
        return 0
    options = _options(words)
    if options.write:
        (root / page.PAGE).write_text(page.written(page.load(root)), encoding="utf-8")
        return 0
    if options.list:
        _list(root, as_json=options.json)
        return 0
    say = _to_stderr if options.json else _to_stdout
    outcomes: list[Outcome] = []
    try:
        for outcome in _run(root, options, say):
            outcomes.append(outcome)
            if outcome.was_interrupted:
                break
    except AlreadyRunning as error:
        say(f"{error} is running in this checkout already")
        return 2
    if options.json:
        print(json.dumps([asdict(one) for one in outcomes], indent=1))
    else:
        _table(outcomes)
    if any(one.was_interrupted for one in outcomes):
        return INTERRUPTED
    return 1 if any(one.result == page.FAILED for one in outcomes) else 0


def shares(
    minutes: float | None, left: int, elapsed_minutes: float, shortest: float = 0.0
) -> float | None:
    """How many minutes the next of `left` campaigns gets; 0: none are left.

    >>> shares(60, 3, 0.0), shares(60, 2, 10.0), shares(60, 10, 58.0, 5.0), shares(None, 3, 0.0)
    (20.0, 25.0, 2.0, None)
    >>> shares(12, 12, 0.0), shares(12, 12, 0.0, 5.0)
    (1.0, 5.0)
    """
    if minutes is None:
        return None
    rest = max(0.0, minutes - elapsed_minutes)
    return min(rest, max(shortest, rest / left))


def oldest_first(found: Iterable[Age], dates: dict[str, str]) -> list[str]:
    """Names: first of those that have to run, then of the others; those that ran last come last."""
    return [
        age.campaign
        for age in sorted(
            found, key=lambda age: (age.is_current, dates.get(age.campaign, ""), age.campaign)
        )
    ]


def _run(root: Path, options: argparse.Namespace, say: Callable[[str], None]) -> Iterable[Outcome]:
    limit = Limit(options.minutes)
    dates = {name: last.date for name, last in page.load(root).items()}
    names = options.names or oldest_first(ages(root), dates)
    for number, name in enumerate(names):
        shortest = 0.0 if options.names else SHORTEST_MINUTES
        share = shares(options.minutes, len(names) - number, limit.elapsed_s / 60, shortest)
        if share is not None and share < 0.1:
            say(f"no time is left for {', '.join(names[number:])}")
            return
        of = "until it is done" if share is None else f"{share:.0f} minutes"
        say(f"{limit} {name}: {CAMPAIGNS[name].sentence} ({of})")
        seed = options.seed if options.seed is not None else secrets.randbelow(2**31)
        outcome = driver.run(
            root,
            CAMPAIGNS[name],
            share,
            seed,
            again=options.again,
            is_seed_asked=options.seed is not None,
            say=say,
        )
        say(f"{limit} {name}: {outcome.result}{_evidence(outcome)}")
        yield outcome


def _evidence(outcome: Outcome) -> str:
    log = Path(outcome.evidence).with_name("log")
    return f" (evidence: {outcome.evidence}, {log})" if outcome.result == page.FAILED else ""


def _table(outcomes: Sequence[Outcome]) -> None:
    print(f"\n{'campaign':16} {'result':14} {'time':>8}  {'commit':12} seed")
    for one in outcomes:
        took = minutes_of(one.minutes * 60)
        print(f"{one.campaign:16} {one.result:14} {took:>8}  {one.commit:12} {one.seed}")
    for one in outcomes:
        for piece in one.failed:
            print(f"FAILED {one.campaign}: {piece} (evidence: {one.evidence})")


def _list(root: Path, *, as_json: bool) -> None:
    lasts = page.load(root)
    found = ages(root)
    if as_json:
        rows = [
            {
                **asdict(age),
                "sentence": CAMPAIGNS[age.campaign].sentence,
                "covers": CAMPAIGNS[age.campaign].covers,
                "last": asdict(lasts[age.campaign]) if age.campaign in lasts else None,
            }
            for age in found
        ]
        print(json.dumps(rows, indent=1))
        return
    for age in found:
        last = lasts.get(age.campaign)
        told = f"{last.result} at {last.commit}, {last.date}" if last else "never run"
        print(f"{age.campaign:16} {told}; {age.why}")
        print(f"{'':16} {CAMPAIGNS[age.campaign].sentence}")


def needs(words: Sequence[str]) -> set[str]:
    """What `set_up` of `./run` has to install beside the tests' own for these arguments.

    >>> sorted(needs(["faults"])), sorted(needs([])), sorted(needs(["--list"]))
    ([], ['fuzz', 'lab'], [])
    >>> sorted(needs(["no-such-campaign"]))
    []
    """
    unread = io.StringIO()
    try:
        with contextlib.redirect_stdout(unread), contextlib.redirect_stderr(unread):
            options = _options(words)
    except SystemExit:  # --help, or a mistake: told by the command itself, which runs nothing
        return set()
    chosen = () if options.list else options.names or CAMPAIGNS
    return {need for name in chosen for need in CAMPAIGNS[name].needs}


def _to_stdout(line: str) -> None:
    print(line, flush=True)


def _to_stderr(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        "./run campaign",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(CAMPAIGNS)} [default: all]"
    )
    parser.add_argument(
        "--minutes", type=_minutes, help="how long to go on in all [default: until all is done]"
    )
    parser.add_argument("--list", action="store_true", help="show what there is, run nothing")
    parser.add_argument("--json", action="store_true", help="the results as JSON")
    parser.add_argument("--seed", type=int, help="of what is drawn by lot [default: a random one]")
    parser.add_argument(
        "--again", action="store_true", help="begin again, also with what was done already"
    )
    parser.add_argument("--write", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(words)
    if unknown := [name for name in options.names if name not in CAMPAIGNS]:
        parser.error(f"no campaign is called {', '.join(unknown)}")
    return options


def _minutes(text: str) -> float:
    try:
        minutes = float(text)
    except ValueError:
        minutes = 0.0
    if not 0 < minutes < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} must be more than 0 minutes")
    return minutes


if __name__ == "__main__":
    for ending in (signal.SIGINT, signal.SIGTERM):
        signal.signal(ending, signal.default_int_handler)
    sys.exit(main(sys.argv[1:]))
