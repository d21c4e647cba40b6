"""The steps of verification: every condition under which something foreign is refused.

Refusing is raising, telling a problem, or returning what is wrong. A step is what leads to it:

- the condition of an `if`, or the guard of a `case`, whose body does nothing but refuse; of
  `a or b` each is a separate step, and of `not (a and b)` and `not 0 < a <= 9`, too;
- the condition that must hold if the refusal that follows, or stands in `else`, is not to come;
- a `case` or `except` that does nothing but refuse, and the loop that finds what to tell;
- the call by which the flaws that another function finds are told with the others;
- a row of a table of what workers are refused (`TABLES`).

In modules by which a process confines itself, or is confined (`CONFINING`), more is a step: each
call that is made for what it does, and each check that it was done; each flag of a mount, right and
scope; each loop; each row of a table; each option of bubblewrap that takes something away.

Without the step, the refusal never comes; what its condition reads on the way is still read.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

_TELLS = re.compile(
    r"(^|_)(problem|refuse|refused|flaw|violation|malformed|unsafe|refusal|wrong|contradiction)s?$"
    r"|^_twice$"
)
"""What a function or class is called that makes or tells a problem."""
_CHECKS = re.compile(
    r"\._?(check|verify|require|raise_if|tell_twice|forked_trial\.run)(_|$)|_if_any$"
)
"""What one is called that raises or tells what is wrong, and returns nothing."""
_REFUSALS = re.compile(r"\bProblem\b|Refused|Failed|Gone|Violation|Malformed|NoReturn|NondumError")
"""What those return that make or tell one, whatever they are called."""
_TOLD = frozenset({"problem", "problems", "flaw", "flaws"})
_MACHINE = frozenset(
    {"OSError", "TimeoutError", "BlockingIOError", "InterruptedError", "subprocess.TimeoutExpired"}
)
"""What these tell went wrong in this machine, and not with what was plugged in."""
_JUDGES = re.compile(r"(flaw|overlap|use|excess|contradiction|twice)s?$")
"""What functions are called that return what is wrong as text."""

_CONFINEMENT = "host/nondum/host/sandbox/levels"
TABLES: Mapping[str, tuple[str, ...]] = {
    f"{_CONFINEMENT}/refusals.py": (
        *("GROUPS", "WITHOUT_NAMESPACES", "SOCKETS_OF_THE_HOST"),
        *("WITH_THE_HOSTS_USER", "TRUNCATION"),
    ),
    f"{_CONFINEMENT}/bubblewrap.py": ("NAMESPACES", "SEALED", "PROTECTED"),
}
"""Module → its tables that say, row by row, what workers are kept from."""
_INSIDE = "host/nondum/host/sandbox/inside"
CONFINING = frozenset(
    {
        *(f"{_INSIDE}/{name}.py" for name in ("bootstrap", "init", "inspect_self", "kernel")),
        *(f"{_INSIDE}/{name}.py" for name in ("limits", "mounts", "restrict")),
        *(f"{_CONFINEMENT}/{name}.py" for name in ("bubblewrap", "landlock", "host_children")),
        "host/nondum/host/peers/streams/process.py",
        "host/nondum/host/rpc/channel.py",
    }
)
"""Modules that do hardly anything but take away what a process could do."""
_FLAG = re.compile(
    r"(kernel\.)?MS_(RDONLY|NOSUID|NODEV|NOEXEC|SLAVE)|_(BIND|CONNECT)_TCP|_ABSTRACT_SOCKETS|_SIGNALS|CLONE_NEW\w+"
)
"""Flags, rights and scopes that say what is taken away."""
_OPTION = re.compile(r"f?\"(--unshare-user|-[ISB]|(size|mode)=.*)\"")
"""What does in the words of a command, or of a mount's options."""
_INSTEAD = {"--ro-bind": "--bind", "--ro-bind-try": "--bind-try"}
"""What stands in the place of an option that another one must follow."""

_Function = ast.FunctionDef | ast.AsyncFunctionDef
_Branch = ast.If | ast.match_case | ast.ExceptHandler


@dataclass(frozen=True, slots=True)
class Step:
    """What leads to a refusal, and where it stands in the text."""

    module: str
    """Path from the root of the checkout."""
    line: int
    condition: str
    """When it refuses, in the words of the source."""
    start: int
    end: int
    """In characters of the module's text."""
    instead: str
    """What stands there without the step."""

    @property
    def name(self) -> str:
        """What it is called in lists: `wheelhouse/…/lock.py:12`."""
        return f"{self.module}:{self.line}"

    def removed(self, text: str) -> str:
        """The module without this step."""
        return f"{text[: self.start]}{self.instead}{text[self.end :]}"


class _Found(NamedTuple):
    """A step in the tree: where, what stands there instead, and when it refuses. In both texts `{}`
    is for the source."""

    start: tuple[int, int]
    end: tuple[int, int]
    """Line and column, as the parser counts."""
    instead: str
    told: str = "{}"


def steps_of(module: str, text: str) -> tuple[Step, ...]:
    """Every step of a module, in order.

    >>> steps_of("m.py", "if a > 1:\\n    raise Refused()\\n")[0].removed("if a > 1: …")
    'if ((a > 1) and False): …'
    """
    starts = _line_starts(text)
    steps: dict[tuple[int, int], Step] = {}
    tree = ast.parse(text)
    found = list(_Finder().found(tree))
    if module in TABLES:
        found += _rows(tree, TABLES[module])
    if module in CONFINING:
        found += [one for node in ast.walk(tree) for one in _taken_away(node)]
    for from_, to, instead, told in found:
        start, end = _offset(*from_, starts, text), _offset(*to, starts, text)
        source = text[start:end]
        condition = " ".join(told.replace("{}", source).split())
        line = text.count("\n", 0, start) + 1
        step = Step(module, line, condition, start, end, instead.replace("{}", source))
        steps.setdefault((start, end), step)
    return tuple(sorted(steps.values(), key=lambda step: (step.start, -step.end)))


def steps_in(root: Path, modules: Sequence[str]) -> tuple[Step, ...]:
    """The steps of many modules."""
    return tuple(
        step
        for module in modules
        for step in steps_of(module, (root / module).read_text(encoding="utf-8"))
    )


class _Finder:
    """Goes through a module; knows in which function it is."""

    def __init__(self) -> None:
        self._function: _Function | None = None
        self._is_telling = False
        self._tellers: frozenset[str] = frozenset()

    def found(self, tree: ast.AST) -> Iterator[_Found]:
        """The steps in and below a node."""
        if isinstance(tree, ast.Module):
            self._tellers = frozenset(_tellers(tree))
        outside = self._function, self._is_telling
        if isinstance(tree, _Function):
            self._function = tree
        yield from self._at(tree)
        self._is_telling |= isinstance(tree, _Branch) and self._refuses(tree.body)
        for node in ast.iter_child_nodes(tree):
            yield from self.found(node)
        self._function, self._is_telling = outside

    def _at(self, node: ast.AST) -> Iterator[_Found]:
        match node:
            case ast.If(test=test, body=body) if self._refuses(body):
                yield from _alternatives(test)
            case ast.If(test=test, orelse=orelse) if self._refuses(orelse):
                yield from _necessities(test)
            case ast.IfExp(test=test, body=body) if self._makes_problem(body):
                yield from _alternatives(test)
            case ast.IfExp(test=test, orelse=orelse) if self._makes_problem(orelse) or _is_reason(
                orelse
            ):
                yield from _necessities(test)
            case ast.match_case(guard=ast.expr() as guard, body=body) if self._refuses(body):
                yield from _alternatives(guard)
            case ast.match_case(guard=None, pattern=pattern, body=body) if self._refuses(body):
                yield _whole(pattern, "{} if False", "case {}")
            case ast.ExceptHandler(type=ast.expr() as kind, body=body) if self._refuses(
                body
            ) and not _is_of_machine(kind):
                yield _whole(kind, "()", "except {}")
            case ast.For(iter=each, body=body) if self._refuses(body):
                yield _whole(each, "()", "for … in {}")
            case (
                ast.GeneratorExp(elt=made, generators=parts)
                | ast.ListComp(elt=made, generators=parts)
            ) if self._makes_problem(made):
                conditions = [condition for part in parts for condition in part.ifs]
                for condition in conditions:
                    yield from _alternatives(condition)
                if not conditions and not self._is_telling:
                    yield _whole(parts[-1].iter, "()", "for … in {}")
            case (
                ast.Starred(value=ast.Call() as call)
                | ast.YieldFrom(value=ast.Call() as call)
                | ast.AugAssign(op=ast.Add(), value=ast.Call() as call)
                | ast.Call(func=ast.Attribute(attr="extend"), args=[ast.Call() as call])
            ) if self._is_teller(call):
                yield _whole(call, "()")
            case ast.Expr(value=ast.Call(func=ast.Attribute(value=ast.Name(), attr="end")) as call):
                if not call.args:  # of a reader, that nothing is left
                    yield _whole(call, "None")
            case ast.Expr(value=ast.Call() as call) if _is_check(call):
                yield _whole(call, "None")
            case ast.Return(value=ast.expr() as value) if self._is_judge(ast.Constant(value=False)):
                if not isinstance(value, ast.Constant | ast.Name):
                    yield from _necessities(value)
        yield from self._before_refusals(node)

    def _before_refusals(self, node: ast.AST) -> Iterator[_Found]:
        """Conditions that must hold, or what stands next refuses."""
        for part in (getattr(node, "body", None), getattr(node, "orelse", None)):
            block: list[ast.stmt] = part if isinstance(part, list) else []
            for index, statement in enumerate(block):
                match statement:
                    case ast.If(test=test, body=[*_, ast.Return() | ast.Continue()], orelse=[]):
                        if not self._refuses(statement.body) and self._refuses(block[index + 1 :]):
                            yield from _necessities(test)

    def _refuses(self, body: Sequence[ast.stmt]) -> bool:
        """Whether a body does nothing but refuse; other statements may put its words together."""
        others = (ast.Assign, ast.Expr, ast.Continue, ast.Break, ast.Return)
        refusals = [self._is_refusal(one) for one in body]
        return any(refusals) and all(
            refuses or isinstance(one, others) for refuses, one in zip(refusals, body, strict=True)
        )

    def _is_refusal(self, statement: ast.stmt) -> bool:
        match statement:
            case ast.Raise(exc=ast.expr() as raised):
                return not (isinstance(raised, ast.Call) and _name(raised) in _MACHINE)
            case ast.Return(value=ast.expr() as value):
                is_told = _tells_some(value) or _is_reason(value)
                return is_told or self._makes_problem(value) or self._is_judge(value)
            case ast.Expr(value=ast.Yield(value=ast.expr() as value)):
                return self._makes_problem(value) or self._is_judge(value)
            case ast.Expr(value=ast.Call() as value):
                return self._makes_problem(value) and not _is_check(value)
        return False

    def _is_judge(self, said: ast.expr) -> bool:
        """Whether the function that says it says what is wrong by that, or that something is."""
        if self._function is None:
            return False
        match said:
            case ast.Constant(value=False):
                return _is_bool(self._function)
            case ast.Constant(value=str(text)):
                return bool(text) and bool(_JUDGES.search(self._function.name))
            case ast.JoinedStr() | ast.Tuple(elts=[ast.Constant(value=str()), *_]):
                return bool(_JUDGES.search(self._function.name))
        return False

    def _makes_problem(self, value: ast.AST) -> bool:
        """Whether a value is made by what makes problems."""
        return any(
            isinstance(node, ast.Call)
            and (self._is_teller(node) or ast.unparse(node.func).endswith("report.add"))
            for node in ast.walk(value)
        )

    def _is_teller(self, call: ast.Call) -> bool:
        name = _name(call)
        return bool(_TELLS.search(name.lower())) or name in self._tellers


def _is_bool(function: _Function) -> bool:
    """Whether a function says False of what is not good, and where."""
    returns = function.returns
    return isinstance(returns, ast.Name) and returns.id == "bool" and _says_false(function)


def _says_false(node: ast.AST) -> bool:
    match node:
        case ast.Return(value=ast.Constant(value=False)):
            return True
        case ast.ExceptHandler(type=ast.expr() as kind) if _is_of_machine(kind):
            return False
    return any(_says_false(inner) for inner in ast.iter_child_nodes(node))


def _is_of_machine(kind: ast.expr) -> bool:
    kinds = kind.elts if isinstance(kind, ast.Tuple) else [kind]
    return all(ast.unparse(one) in _MACHINE for one in kinds)


def _is_check(call: ast.Call) -> bool:
    """Whether a call raises or tells by itself when something is wrong."""
    return bool(_CHECKS.search(f".{ast.unparse(call.func)}"))


def _alternatives(test: ast.expr) -> Iterator[_Found]:
    """Each of the conditions that suffices by itself, so that it never holds."""
    match test:
        case ast.BoolOp(op=ast.Or(), values=values):
            for value in values:
                yield from _alternatives(value)
        case ast.NamedExpr(value=ast.BoolOp(op=ast.Or(), values=values)):
            for value in values:
                yield _whole(value, "(({}) and None)")
        case ast.UnaryOp(op=ast.Not(), operand=ast.BoolOp(op=ast.And()) as all_of):
            yield from _necessities(all_of)
        case ast.UnaryOp(op=ast.Not(), operand=ast.Compare(ops=[_, _]) as between):
            yield from _bounds(between)
        case _:
            yield _whole(test, "(({}) and False)")


def _necessities(test: ast.expr) -> Iterator[_Found]:
    """Each of the conditions that must hold, so that it always does."""
    match test:
        case ast.BoolOp(op=ast.And(), values=values):
            for value in values:
                yield from _necessities(value)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield from _alternatives(operand)
        case ast.Compare(ops=[_, _]):
            yield from _bounds(test)
        case _:
            yield _whole(test, "(({}) or True)", "not ({})")


def _rows(module: ast.Module, tables: Collection[str]) -> Iterator[_Found]:
    """The rows of tables: groups, rules, calls and flags by their names. In the place of one stands
    nothing."""
    for statement in module.body:
        if isinstance(statement, ast.AnnAssign) and ast.unparse(statement.target) in tables:
            assert statement.value is not None
            for node in ast.walk(statement.value):
                match node:
                    case ast.Dict(keys=keys, values=values):
                        for key, value in zip(keys, values, strict=True):
                            if isinstance(key, ast.Constant) and isinstance(key.value, str):
                                yield _Found(_start(key), _end(value), "**dict()", ast.unparse(key))
                    case ast.Tuple(elts=parts) | ast.Call(func=ast.Name(id="_all"), args=parts):
                        yield from (_whole(one, "*()") for one in parts if _is_row(one))


def _taken_away(node: ast.AST) -> Iterator[_Found]:
    """What a node does so that a process can do less afterwards."""
    match node:
        case ast.Expr(value=ast.Call() as call):
            yield _whole(call, "None")
        case ast.Assign(targets=[ast.Subscript()]):
            yield _Found((node.lineno, node.col_offset), _end(node.value), "None")
        case ast.Call(func=ast.Name(id="_checked"), args=[called, *_]):
            yield _whole(node, ast.unparse(called), "unchecked: {}")
        case ast.For(iter=each):
            yield _whole(each, "()", "for … in {}")
        case ast.Dict(keys=keys, values=values):
            for key, value in zip(keys, values, strict=True):
                if key is not None:
                    yield _Found(_start(key), _end(value), "**dict()")
        case (ast.Name(ctx=ast.Load()) | ast.Attribute(ctx=ast.Load())) as flag:
            if _FLAG.fullmatch(ast.unparse(flag)):
                yield _whole(flag, "0")
        case ast.Constant(value=str(option)) if option in _INSTEAD:
            yield _whole(node, f'"{_INSTEAD[option]}"')
        case ast.Tuple(elts=parts):
            for part in parts:
                if _OPTION.fullmatch(ast.unparse(part).replace("'", '"')):
                    yield _whole(part, "*()")


def _is_row(part: ast.expr) -> bool:
    match part:
        case ast.Constant(value=str()):
            return True
        case ast.Call(func=ast.Name(id="Rule")):
            return True
    return False


def _bounds(between: ast.Compare) -> Iterator[_Found]:
    """Of `low < middle <= high`, each half."""
    low, middle, high = between.left, *between.comparators
    below, above = between.ops
    lower = ast.Compare(left=low, ops=[below], comparators=[middle])
    upper = ast.Compare(left=middle, ops=[above], comparators=[high])
    yield _Found(_start(low), _start(middle), "", f"not {ast.unparse(lower)}")
    yield _Found(_end(middle), _end(high), "", f"not {ast.unparse(upper)}")


def _whole(node: ast.expr | ast.pattern, instead: str, told: str = "{}") -> _Found:
    return _Found(_start(node), _end(node), instead, told)


def _start(node: ast.expr | ast.pattern) -> tuple[int, int]:
    return node.lineno, node.col_offset


def _end(node: ast.expr | ast.pattern) -> tuple[int, int]:
    assert node.end_lineno is not None and node.end_col_offset is not None
    return node.end_lineno, node.end_col_offset


def _tellers(module: ast.Module) -> Iterator[str]:
    """Functions of a module that return nothing but problems, or never."""
    for node in ast.walk(module):
        if isinstance(node, _Function) and node.returns is not None:
            returns = ast.unparse(node.returns)
            if _REFUSALS.search(returns) and "None" not in returns:
                yield node.name


def _tells_some(value: ast.expr) -> bool:
    return any(
        isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr) in _TOLD
        for node in ast.walk(value)
    )


def _is_reason(value: ast.expr) -> bool:
    """Whether a value is why a peer is turned away."""
    return isinstance(value, ast.Attribute) and ast.unparse(value.value) == "Reason"


def _name(call: ast.Call) -> str:
    match call.func:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _offset(line: int, column: int, starts: Sequence[int], text: str) -> int:
    """In characters; the parser counts UTF-8 bytes."""
    start = starts[line - 1]
    end = starts[line] if line < len(starts) else len(text)
    return start + len(text[start:end].encode()[:column].decode())


def _line_starts(text: str) -> list[int]:
    return [0, *(match.end() for match in re.finditer("\n", text))]
