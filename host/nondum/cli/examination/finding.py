"""One thing that was looked at, and how it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from nondum.sdk.frozen import frozen
from nondum.transport.discovery.doctor import Result

__all__ = ["Finding", "Result", "bad", "is_well", "ok", "row", "warn"]


@frozen
class Finding:
    """What was seen of one thing, and what to do about it."""

    check: str
    """What was looked at, in a word or two: the same on every machine."""
    result: Result
    """`BAD`: nondum does not do its work here as it should; `WARN`: part of it."""
    detail: str
    """What was seen, in words."""
    fix: str = ""
    """What a person can do; empty where nothing need be done."""
    subject: str = ""
    """Which one of many, such as an interface or a disk; empty: there is one."""


def ok(check: str, detail: str, *, subject: str = "") -> Finding:
    """All is well with it."""
    return Finding(check, Result.OK, detail, subject=subject)


def warn(check: str, detail: str, fix: str, *, subject: str = "") -> Finding:
    """Something does not work that may be expected to."""
    return Finding(check, Result.WARN, detail, fix, subject)


def bad(check: str, detail: str, fix: str, *, subject: str = "") -> Finding:
    """What nondum is for does not work."""
    return Finding(check, Result.BAD, detail, fix, subject)


def is_well(findings: Iterable[Finding]) -> bool:
    """Whether nothing is bad.

    >>> is_well([ok("clock", "it is right"), warn("sound", "there is none", "plug one in")])
    True
    """
    return all(finding.result is not Result.BAD for finding in findings)


def row(finding: Finding) -> dict[str, Any]:
    """Plain data for tables and JSON."""
    return {
        "check": finding.check,
        "subject": finding.subject,
        "result": finding.result.value,
        "detail": finding.detail,
        "fix": finding.fix,
    }
