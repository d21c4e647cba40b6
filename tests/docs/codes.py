"""The table of codes, `nondum.sdk.codes`, beside the places in the sources where they are told."""

from __future__ import annotations

import ast
import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from nondum.sdk import codes
from nondum.sdk.codes import Code

ROOT = Path(__file__).parents[2]
TABLE = "plugins/sdk/nondum/sdk/codes"
FOLDERS = (
    "host/nondum",
    "planning/nondum",
    "plugins/host-lamps/nondum_host_lamps",
    "plugins/host-zenoh/nondum_host_zenoh",
    "plugins/lab/nondum_lab",
    "plugins/pddl-workbench/nondum_pddl_workbench",
    "plugins/sdk/nondum",
    "transport/nondum",
    "wheelhouse/nondum",
)
CODE = re.compile(r"[A-Z][A-Z0-9]+(_[A-Z0-9]+)*")
LIKELY = re.compile(r"[A-Z][A-Z0-9]+(?:_[A-Z0-9]+)+(?= |$)")
"""What a string in the sources begins with when it is most probably a code."""
NO_CODES = frozenset(
    {
        *("ID_BUS", "ID_FS_TYPE", "ID_FS_UUID", "ID_PART_ENTRY_TYPE", "ID_SERIAL"),
        *("SC_PAGE_SIZE", "SC_PHYS_PAGES", "SYNTH_UUID", "USEC_INITIALIZED"),
        *("ID_MODEL", "ID_MODEL_ID", "ID_MODEL_FROM_DATABASE", "ID_SERIAL_SHORT", "ID_V4L_PRODUCT"),
        *("ID_VENDOR", "ID_VENDOR_ID", "ID_VENDOR_FROM_DATABASE", "ID_INPUT_KEYBOARD"),
        *("ID_INPUT_MOUSE", "ID_INPUT_POINTINGSTICK", "ID_INPUT_TOUCHPAD", "ID_INPUT_TOUCHSCREEN"),
        *("LC_ALL", "LISTEN_FDS", "LISTEN_PID", "NO_COLOR", "SOURCE_DATE_EPOCH"),
        *("MALLOC_ARENA_MAX", "SCHED_IDLE", "VECLIB_MAXIMUM"),
        *("NONDUM_CONTROL", "NONDUM_LAB", "NONDUM_PLACEHOLDER"),
        *("NONDUM_SPARE_OF", "NONDUM_WORKER"),
        *("NONDUM_CODE", "NONDUM_EVENT", "NONDUM_LOGGER", "NONDUM_LOST", "SYSLOG_IDENTIFIER"),
        *("CODE_FILE", "CODE_FUNC", "CODE_LINE", "JOURNAL_STREAM"),
        *("NOTIFY_SOCKET", "WATCHDOG_PID", "WATCHDOG_USEC"),
        *("SC_CLK_TCK", "SC_OPEN_MAX", "SC_PAGE_SIZE"),
        *("XDG_CACHE_HOME", "XDG_RUNTIME_DIR", "XDG_STATE_HOME"),
    }
)
"""Strings that only look like codes: variables of the environment, properties of devices."""
PUT_TOGETHER = frozenset(
    {
        *(
            f"{file}_{kind}"
            for file in ("MANIFEST", "TRUST")
            for kind in ("KEY", "TOML", "TWICE", "VALUE")
        ),
        *(f"{kind}_UNKNOWN" for kind in ("COMPONENT", "INPUT", "PAYLOAD", "STREAM", "UNIT")),
        *(f"CGROUP_{kind}_MISSING" for kind in ("CPU", "MEMORY", "PIDS")),
    }
)
"""Codes that no source has in one piece."""
TELLERS = re.compile(r"Problem|problem|_(refuse|refused|flaw|short|violation|told|failure)")
"""What makes a problem: the class itself, or a function of the module that fills it in."""
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True)
class Told:
    """One place where a code is given."""

    path: str
    """The file, from the root of the repository."""
    code: str
    words: str
    """The message, `…` for what differs; empty where it is put together elsewhere."""
    remedy: str


def references() -> str:
    """A section an area, a row a code."""
    told: dict[str, list[Told]] = defaultdict(list)
    for found in all_told():
        told[found.code].append(found)
    sections = (_section(area, declared, told) for area, declared in codes.areas().items())
    return "\n".join(sections)


def told_words() -> str:
    """The sentences of each code, as JSON."""
    words: dict[str, dict[str, None]] = defaultdict(dict)
    for told in all_told():
        if told.words:
            words[told.code][told.words] = None
    rows = {code: list(said) for code, said in sorted(words.items())}
    return json.dumps(rows, ensure_ascii=False, indent=0) + "\n"


@cache
def all_told() -> tuple[Told, ...]:
    """Every place, by file."""
    return tuple(
        told
        for path, tree in _trees().items()
        for scope in [tree, *(node for node in ast.walk(tree) if isinstance(node, FUNCTIONS))]
        for told in _told_in(list(_nodes_of(scope)), path)
    )


@cache
def mentioned() -> Mapping[str, str]:
    """Every string of the sources that looks like a code, and a file that has it."""
    return {
        likely[0]: path
        for path, tree in _trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if (likely := LIKELY.match(node.value))
    }


@cache
def _trees() -> Mapping[str, ast.Module]:
    """The sources, by their place in the repository."""
    paths = (p for folder in FOLDERS for p in sorted((ROOT / folder).rglob("*.py")))
    sources = (p for p in paths if "template" not in p.parts and ROOT / TABLE not in p.parents)
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sources
    }


def _nodes_of(scope: ast.AST) -> Iterator[ast.AST]:
    """What is in a function (or, for a module, in none), in the order of the text."""
    for node in ast.iter_child_nodes(scope):
        if not isinstance(node, FUNCTIONS):
            yield node
            yield from _nodes_of(node)


def _told_in(nodes: Sequence[ast.AST], path: str) -> Iterator[Told]:
    named: dict[str, str] = {}
    for node in nodes:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            named[node.targets[0].id] = _words(node.value, named)
        if not isinstance(node, ast.Call) or not TELLERS.fullmatch(_name(node.func)):
            continue
        code = _words(node.args[0], named) if node.args else ""
        if CODE.fullmatch(code):
            said = (_words(argument, named) for argument in node.args[1:])
            fixes = [k.value for k in node.keywords if k.arg == "fix"]
            remedy = _words(fixes[0], named) if fixes else ""
            yield Told(path, code, next((w for w in said if " " in w), ""), remedy)


def _name(function: ast.expr) -> str:
    return function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")


def _words(node: ast.expr, named: Mapping[str, str]) -> str:
    """A string as it is written, with `…` for each of its parts that differ."""
    match node:
        case ast.Constant(str(text)):
            return text
        case ast.JoinedStr(values):
            return "".join(_words(v, named) if isinstance(v, ast.Constant) else "…" for v in values)
        case ast.Name(id):
            return named.get(id, "")
    return ""


def _section(area: str, declared: Sequence[Code], told: Mapping[str, Sequence[Told]]) -> str:
    heads = [f"## {area}\n", "| code | what it means | what to do |", "|---|---|---|"]
    rows = (_row(code, told[code.name]) for code in sorted(declared, key=lambda code: code.name))
    return "\n".join([*heads, *rows, ""])


def _row(code: Code, places: Sequence[Told]) -> str:
    words = "; ".join(dict.fromkeys(place.words for place in places if place.words))
    meaning = f"{code.meaning} Said: {words}" if words else code.meaning
    remedy = f"{code.remedy} (usual causes: {code.causes})" if code.causes else code.remedy
    return f"| `{code.name}` | {_cell(meaning)} | {_cell(remedy)} |"


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("<", "&lt;")
