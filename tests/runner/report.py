"""What a run says at its end: tables, skips, every failure once more, and the sum last."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from tests.campaign.age import Age
from tests.runner.budget import Spent
from tests.runner.job import Done
from tests.runner.result import Result

SLOWEST = 10
MESSAGE_LINES = 60
"""Of a failure, at the end of the run; the log of its session has all of them."""


def folders(
    rows: Sequence[Spent], slower: float, others: float, *, is_judged: bool
) -> Iterator[str]:
    """Folder against budget. A machine that is slow or busy with something else is not judged."""
    verdict = "judged" if is_judged else "not judged"
    yield (
        f"folders against tests/budget.toml: {verdict} (a fixed piece of work takes {slower:.2f} "
        f"times as long as there, by which the seconds are divided; others use {others:.0%} of the "
        "processors)"
    )
    width = max((len(row.folder) for row in rows), default=0)
    yield f"{'folder':{width}}  tests  seconds  budget"
    for row in rows:
        budget = "none" if row.budget_s is None else f"{row.budget_s:.0f}"
        mark = "  too long" if row.is_beyond else ""
        yield f"{row.folder:{width}}  {row.tests:5}  {row.seconds:7.0f}  {budget:>6}{mark}"


def campaigns(ages: Iterable[Age]) -> Iterator[str]:
    """How old the last passing result of each is; the short form of an old one has run."""
    yield "campaigns, by commits since they last passed"
    for age in ages:
        commits = "-" if age.commits is None else str(age.commits)
        ran = "" if age.is_current else "; short form was run"
        yield f"{commits:>5}  {age.campaign:15} {age.why}{ran}"


def slowest(results: Iterable[Result]) -> Iterator[str]:
    """The tests that took longest, and the files."""
    ordered = sorted(results, key=lambda one: -one.seconds)[:SLOWEST]
    yield "slowest tests"
    yield from (f"{one.seconds:7.1f} s  {one.test}" for one in ordered)
    files: Counter[str] = Counter()
    for one in results:
        files[one.test.split("::", 1)[0]] += round(one.seconds * 1000)
    yield "slowest files"
    yield from (f"{total / 1000:7.1f} s  {file}" for file, total in files.most_common(SLOWEST))


def skips(skipped: Sequence[Result], unknown: Sequence[Result], *, is_root: bool) -> Iterator[str]:
    """What was not tested here, and why."""
    if not skipped:
        return
    without = "" if is_root else ", without root"
    yield f"{len(skipped)} tests did not run on this machine{without}"
    counted = Counter((one.reason, one in unknown) for one in skipped)
    for (reason, is_unknown), number in counted.most_common():
        mark = "  (not in tests/hardware.toml)" if is_unknown else ""
        yield f"{number:5}  {reason}{mark}"


def failures(failed: Sequence[Result], died: Sequence[Done]) -> Iterator[str]:
    """Every failure once more, with the folder that was kept."""
    for done in died:
        yield f"FAILED {done.job.name}: exit status {done.status} (log: {done.job.log})"
    for one in failed:
        yield ""
        yield f"FAILED {one.test}"
        yield from one.message.splitlines()[-MESSAGE_LINES:]
        yield f"folder: {one.folder or 'none'}"


def total(results: Iterable[Result], unstable: Sequence[Result], more_failed: int) -> str:
    """The last line. A test that passed alone counts as passed: it is named above."""
    counted = Counter(one.outcome for one in results)
    failed = counted["failed"] - len(unstable) + more_failed
    passed = counted["passed"] + len(unstable)
    return f"{passed} passed, {failed} failed, {counted['skipped']} skipped"
