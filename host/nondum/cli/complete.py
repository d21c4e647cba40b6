"""What a shell may complete from the running host: asked quickly, and silent when none answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import click
from click.shell_completion import CompletionItem

from nondum.cli.session import Session
from nondum.sdk.errors import NondumError

PATIENCE_S = 0.5
"""A person waits at the prompt."""

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def names(verb: str, key: str, about: str = "") -> Completer:
    """Completes values of one column of a verb's rows; another column says what each is."""

    def complete(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
        rows = _rows(_asked(ctx, verb))
        pairs = {str(row[key]): str(row.get(about) or "") for row in rows}
        return list(_items(pairs.items(), incomplete))

    return complete


components = names("components", "component", "state")
units = names("units", "unit", "type")
peers = names("peers", "peer", "state")
streams = names("streams", "stream", "type")
inputs = names("inputs", "input", "type")


def goal_ids(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes ids of goals that are not over."""
    given = _rows((_asked(ctx, "goals") or {}).get("given"))
    pairs = [(row["id"], row["text"]) for row in given if row["state"] not in ("reached", "halted")]
    return list(_items(pairs, incomplete))


def halted_ids(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes ids of goals that can be resumed."""
    given = _rows((_asked(ctx, "goals") or {}).get("given"))
    return list(_items([(r["id"], r["text"]) for r in given if r["resumable"]], incomplete))


def goal_words(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes the next word of what can be asked for now."""
    said = [word.lower() for word in ctx.params.get("words") or ()]
    offers = _rows((_asked(ctx, "goals") or {}).get("can"))
    pairs: dict[str, str] = {}
    for offer in offers:
        words = str(offer["words"]).split()
        if [word.lower() for word in words[: len(said)]] == said and len(words) > len(said):
            pairs.setdefault(words[len(said)], str(offer["words"]))
    return list(_items(pairs.items(), incomplete))


def subjects(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes what the journal has rows about, for its usual subjects."""
    view = _asked(ctx, "status") or {}
    payloads, drives = _rows(view.get("payloads")), _rows(view.get("drives"))
    pairs = {row["payload"]: row["state"] for row in payloads}
    pairs |= {id: "component" for row in payloads for id in row["components"]}
    pairs |= {row["drive"]: "drive" for row in drives}
    return list(_items(pairs.items(), incomplete))


def troubled(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes payloads that may be tried again."""
    payloads = _rows((_asked(ctx, "status") or {}).get("payloads"))
    pairs = [(row["payload"], row["state"]) for row in payloads if row["problems"]]
    return list(_items(pairs, incomplete))


def movable(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes payloads that may run on other hosts."""
    payloads = _rows((_asked(ctx, "status") or {}).get("payloads"))
    pairs = [(p["payload"], p["state"]) for p in payloads if "installed/" not in p["drive"]]
    return list(_items(pairs, incomplete))


def installed(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes payloads that were installed for good."""
    payloads = _rows((_asked(ctx, "status") or {}).get("payloads"))
    pairs = [(p["payload"], p["version"]) for p in payloads if "installed/" in p["drive"]]
    return list(_items(pairs, incomplete))


def upgraded(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes payloads that have an earlier release to go back to."""
    payloads = _rows((_asked(ctx, "status") or {}).get("payloads"))
    active = {p["payload"]: p for p in payloads if p["state"] == "active"}
    ids = (p["payload"] for p in payloads if p["state"] in ("superseded", "refused"))
    pairs = {id: active[id]["version"] for id in ids if id in active}
    return list(_items(pairs.items(), incomplete))


def trusted(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes hosts and fleets that are trusted."""
    view = _asked(ctx, "peers_trust") or {}
    rows = [*_rows(view.get("paired")), *_rows(view.get("fleets"))]
    pairs = {row["name"]: row["fingerprint"] for row in rows}
    return list(_items(pairs.items(), incomplete))


def former(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Completes payloads that were here and are remembered."""
    seen = _rows((_asked(ctx, "composition") or {}).get("seen"))
    return list(_items({row["payload"]: row["version"] for row in seen}.items(), incomplete))


def _asked(ctx: click.Context, verb: str) -> Any:
    """The daemon's answer, or None. Completion never fails: the shell would show it."""
    try:
        return ctx.ensure_object(Session).ask(verb, timeout_s=PATIENCE_S)
    except NondumError:
        return None


def _rows(answer: Any) -> list[dict[str, Any]]:
    return answer if isinstance(answer, list) else []


def _items(pairs: Iterable[tuple[str, str]], incomplete: str) -> Iterator[CompletionItem]:
    for value, about in pairs:
        if value.lower().startswith(incomplete.lower()):
            yield CompletionItem(value, help=about or None)
