"""What authors of plugins look up: fields of messages, words of nondum-core, calls of the bench."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from importlib import resources
from typing import Any, get_args, get_type_hints

from tests.docs.dataclass_fields import field_docs

from nondum.planning.merge.core import core, core_value_types
from nondum.sdk.bench import Bench, Call, WorkerFactory
from nondum.sdk.messages import MESSAGES, Message

HEADER = "when and in which frame: `Header`, below"
WHO = {"H": "the host", "P": "plugins"}
PREDICATE = re.compile(
    r"^\s*(?:\(:predicates\s*)?(\([a-z][^()]*\))\)*\s*; ([HP]) (.+)$", re.MULTILINE
)


def messages() -> str:
    """A section a message type: its fields, and those of the values in them."""
    sections = [_message(f"## {kind}", cls) for kind, cls in sorted(MESSAGES.items())]
    return "\n".join([*sections, *(_message("## Part", cls) for cls in message_parts())])


def message_classes() -> list[type[Any]]:
    """Every class whose fields authors fill in."""
    return [*(cls for _, cls in sorted(MESSAGES.items())), *message_parts()]


def message_parts() -> list[type[Any]]:
    """The dataclasses that fields of messages hold, each once."""
    found: dict[str, type[Any]] = {}
    waiting = [cls for _, cls in sorted(MESSAGES.items())]
    while waiting:
        hints = get_type_hints(waiting.pop(0)).values()
        for part in (part for hint in hints for part in (hint, *get_args(hint))):
            is_part = is_dataclass(part) and isinstance(part, type)
            if is_part and not issubclass(part, Message) and part.__name__ not in found:
                found[part.__name__] = part
                waiting.append(part)
    return [found[name] for name in sorted(found)]


def _message(head: str, cls: type[Any]) -> str:
    docs, source = field_docs(cls), inspect.getdoc(cls)
    rows = [_field(field, docs) for field in fields(cls)]
    table = ["| field | type | default | |", "|---|---|---|---|", *rows, ""]
    return "\n".join([f"{head} `{cls.__name__}`\n", f"{source}\n", *table])


def _field(field: Field[Any], docs: dict[str, str]) -> str:
    """A row; a type alias stays as it stands in the sources."""
    name = HEADER if field.name == "header" else docs.get(field.name, "")
    kind = str(field.type).replace("|", "\\|")
    return f"| `{field.name}` | `{kind}` | {_default(field)} | {name} |"


def _default(field: Field[Any]) -> str:
    if field.default_factory is not MISSING:
        return "now" if field.name == "stamp_s" else "empty"
    return "" if field.default is MISSING else f"`{field.default!r}`"


def core_words() -> str:
    """The types and the predicates, with who says them."""
    text = (resources.files("nondum.planning.merge") / "nondum-core.pddl").read_text(
        encoding="utf-8"
    )
    by_parent: dict[str, list[str]] = {}
    for declared in core().types:
        by_parent.setdefault(" ".join(declared.types), []).append(f"`{declared.name}`")
    types = [f"| `{parent}` | {', '.join(names)} |" for parent, names in by_parent.items()]
    predicates = [_predicate(*found.groups()) for found in PREDICATE.finditer(text)]
    return "\n".join(
        [
            *("## Types\n", "| a kind of | |", "|---|---|", *types, ""),
            *("## Predicates\n", "| predicate | said by | |", "|---|---|---|", *predicates, ""),
        ]
    )


def _predicate(declared: str, who: str, meaning: str) -> str:
    value = core_value_types().get(declared[1:].split()[0], "")
    carried = f"; its value is a [{value}](messages.md#{value}-{value})" if value else ""
    return f"| `{declared}` | {WHO[who]} | {meaning}{carried} |"


def bench() -> str:
    """A section a class of the bench: its calls with their signatures."""
    made = [f"## worker\n\n    worker{_signature(Bench.__init__, {'scratch'})}\n"]
    made.append(f"{inspect.getdoc(Bench.__init__)}\n")
    made.append(f"### worker.check\n\n    worker.check{_signature(WorkerFactory.check)}\n")
    made.append(f"{inspect.getdoc(WorkerFactory.check)}\n")
    return "\n".join([*made, *_class("## Bench", Bench), *_class("## Call", Call)])


def _class(head: str, cls: type[Any]) -> Iterator[str]:
    yield f"{head}\n\n{inspect.getdoc(cls)}\n"
    for name, member in vars(cls).items():
        if name.startswith("_") or name == "on_loop":
            continue
        if isinstance(member, property):
            assert member.fget is not None
            kind = inspect.signature(member.fget).return_annotation
            yield f"### {name}\n\n    {name}: {kind}\n\n{inspect.getdoc(member)}\n"
        elif inspect.isfunction(member):
            yield f"### {name}\n\n    {name}{_signature(member)}\n\n{inspect.getdoc(member)}\n"


def _signature(function: Any, without: frozenset[str] | set[str] = frozenset()) -> str:
    """A method's signature as its caller sees it."""
    signature = inspect.signature(function)
    kept = [
        p.replace(annotation=_Bare(p.annotation))
        for name, p in signature.parameters.items()
        if name not in {"self", *without}
    ]
    answer = signature.return_annotation
    shown = signature.replace(parameters=kept, return_annotation=_Bare(answer))
    return str(shown).removesuffix(" -> None")


class _Bare(str):
    """An annotation as it stands in the source, without the quotes of a string."""

    def __repr__(self) -> str:
        return str(self)
