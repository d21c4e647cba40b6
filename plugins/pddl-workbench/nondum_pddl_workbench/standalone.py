"""A domain and a problem that are no fragments: PDDL as its authors wrote it, without units,
ownership or the core's words."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from nondum.planning.merge.derivation import derived_of, strata_of
from nondum.planning.merge.domain import Action, Domain, Merged, Object, Origin, Predicate
from nondum.planning.merge.effect import Effect
from nondum.planning.merge.goal import GoalExpr
from nondum.planning.merge.inventory import values_of
from nondum.planning.merge.schema import read_action
from nondum.planning.merge.scope import SELF, Report, Scope, TooManyProblems
from nondum.planning.merge.vocabulary import check_root, checked, cycle_text, functions_of
from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.facts import fact
from nondum.planning.pddl.normal import Condition, condition_of
from nondum.planning.pddl.parse import parse_fragment
from nondum.planning.pddl.syntax import Atom, DomainFragment, Numeric, ProblemFragment, TypedName
from nondum.planning.pddl.typegraph import ROOT, TypeGraph, types_or_root
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.frozen import frozen

SIZE_LIMIT_BYTES = 64 * 1024 * 1024


@frozen
class Standalone:
    """A planning problem: what `ground` needs."""

    merged: Merged
    """Its `self_host` is empty, and its actions go by their own names."""
    facts: frozenset[str]
    goal: GoalExpr
    warnings: tuple[Problem, ...] = ()


def load(domain: str, domain_file: str, problem: str, problem_file: str) -> Standalone:
    """Read two texts; the files are the names that messages give.

    Without a metric, every action costs 1. Raises `FragmentRefused` with all that is wrong.
    """
    words = load_domain(domain, domain_file)
    parsed = _parsed(problem, problem_file)
    if not isinstance(parsed, ProblemFragment):
        raise _other_kind(problem_file, "a problem", "a domain")
    return _Loading(words, {domain_file: domain, problem_file: problem}, parsed).loaded()


def load_domain(text: str, file: str) -> DomainFragment:
    """Read and check a domain by itself. Raises `FragmentRefused` with all that is wrong."""
    parsed = _parsed(text, file)
    if not isinstance(parsed, DomainFragment):
        raise _other_kind(file, "a domain", "a problem")
    empty = ProblemFragment("", file, parsed.name, goal=None)
    _Loading(parsed, {file: text}, empty).check()
    return parsed


def _parsed(text: str, file: str) -> DomainFragment | ProblemFragment:
    return parse_fragment(text, file, size_limit_bytes=SIZE_LIMIT_BYTES)


def _other_kind(file: str, need: str, have: str) -> FragmentRefused:
    return FragmentRefused(Problem("PDDL_KIND", f"expected {need}", file, need, have))


class _Loading:
    def __init__(
        self, domain: DomainFragment, texts: dict[str, str], problem: ProblemFragment
    ) -> None:
        self._domain = domain
        self._problem = problem
        self._report = Report(Origin("", "", ""), texts)
        # `self` is a name like any other here: it stands for itself.
        self._scope = Scope(self._report, SELF, {}, TypeGraph({}), of_host=frozenset())

    def check(self) -> None:
        """Raises `FragmentRefused` with all that is wrong."""
        with suppress(TooManyProblems):
            self._merged()
        if self._report.problems:
            raise FragmentRefused(*self._report.problems)

    def loaded(self) -> Standalone:
        found: Standalone | None = None
        with suppress(TooManyProblems):
            self._check_named()
            merged = self._merged()
            facts, goal = self._facts(merged), self._goal()
            found = Standalone(merged, facts, goal, tuple(self._report.warnings))
        if found is None or self._report.problems:
            raise FragmentRefused(*self._report.problems)
        return found

    def _check_named(self) -> None:
        """A problem may be planned in any domain that has its words, but that is rarely meant."""
        named = self._problem.domain
        if named and named != self._domain.name:
            message = f"problem {self._problem.name!r} is one of domain {named!r}"
            warning = Problem("PDDL_DOMAIN", message, self._problem.file, have=self._domain.name)
            self._report.warnings.append(warning)

    def _merged(self) -> Merged:
        scope = self._scope
        scope.graph = self._types()
        scope.predicates.update({p.name: p for p in self._predicates()})
        functions = functions_of([self._domain], scope)
        scope.functions.update({function.name: function for function in functions})
        objects = self._objects()
        scope.objects.update({name: found.types for name, found in objects.items()})
        actions = {action.name: action for action in self._actions()}
        derived = derived_of([self._domain], scope)
        if circle := strata_of(derived).circle:
            place = next(rule.place for rule in self._domain.derived if rule.name == circle[0])
            message = f"these hold only if they do not: {', '.join(circle)}"
            fix = "take a negation out of the circle"
            self._report.problem("PDDL_DERIVED", message, place, fix)
        merged = Merged(
            domain=Domain(
                types=scope.graph,
                type_origins={},
                predicates=dict(scope.predicates),
                actions=actions,
                derived=derived,
                functions=dict(scope.functions),
            ),
            objects=objects,
            init={},
            self_host="",
            values=self._values(),
            is_closed=True,
        )
        self._check_written(merged)
        return merged

    def _types(self) -> TypeGraph:
        """Parents that are not declared are objects, as many domains have it."""
        parents: dict[str, frozenset[str]] = {ROOT: frozenset()}
        for declared in self._domain.types:
            if declared.name == ROOT:
                check_root(declared, self._report)
            else:
                known = parents.get(declared.name, frozenset())
                parents[declared.name] = known | frozenset(types_or_root(declared.types))
        for declared in self._domain.types:
            for parent in declared.types:
                parents.setdefault(parent, frozenset((ROOT,)))
        graph = TypeGraph(parents)
        if cycle := graph.cycle():
            place = next(t.place for t in self._domain.types if t.name in cycle)
            message = f"types in a circle: {cycle_text(cycle)}"
            self._report.problem("PDDL_TYPE_CYCLE", message, place)
            return TypeGraph({name: frozenset((ROOT,)) for name in parents} | {ROOT: frozenset()})
        return graph

    def _predicates(self) -> Sequence[Predicate]:
        found: dict[str, Predicate] = {}
        for declared in self._domain.predicates:
            if declared.name in found:
                message = f"predicate {declared.name!r} is declared twice"
                self._report.problem("PDDL_TWICE", message, declared.place)
            origin = self._report.origin(declared.place)
            found[declared.name] = Predicate.declared(checked(declared, self._scope), origin)
        return list(found.values())

    def _objects(self) -> dict[str, Object]:
        """A constant may be named again among the objects, as the same."""
        found: dict[str, Object] = {}
        declarations = (*self._domain.constants, *self._problem.objects)
        for declared in self._scope.checked_types(declarations):
            types = types_or_root(declared.types)
            known = found.get(declared.name)
            if known and known.types != types:
                self._refuse_twice(declared, known)
                continue
            found[declared.name] = Object(
                declared.name, types, origins=(self._report.origin(declared.place),)
            )
        return found

    def _refuse_twice(self, declared: TypedName, known: Object) -> None:
        message = f"object {declared.name!r} has another type at {known.origins[0].place}"
        self._report.problem("PDDL_TWICE", message, declared.place)

    def _actions(self) -> list[Action]:
        found: dict[str, Action] = {}
        for declared in self._domain.actions:
            if declared.name in found:
                message = f"action {declared.name!r} is declared twice"
                self._report.problem("PDDL_TWICE", message, declared.place)
            read = read_action(declared, self._scope, unnamed_cost=0)
            if read:
                parameters, precondition, effect = read
                found[declared.name] = Action(
                    name=declared.name,
                    plugin="",
                    parameters=parameters,
                    precondition=precondition,
                    effect=self._costed(effect),
                    origins=(self._report.origin(declared.place),),
                )
        return list(found.values())

    def _costed(self, effect: Effect) -> Effect:
        """Costs count only where a metric asks for them (IPC)."""
        return effect if self._problem.metric else replace(effect, cost=1, cost_functions=())

    def _values(self) -> dict[str, int]:
        claims = values_of([self._problem], self._scope)
        return {claim.function: claim.value for claim in claims}

    def _check_written(self, merged: Merged) -> None:
        derived = {rule.head.predicate for rule in merged.domain.derived}
        for action in merged.domain.actions.values():
            for atom in (*action.effect.added(), *action.effect.deleted()):
                self._check_not_derived(atom, derived)

    def _check_not_derived(self, atom: Atom, derived: set[str]) -> None:
        if atom.predicate in derived:
            message = f"{atom.predicate!r} follows from rules, and cannot be written"
            self._report.problem("PDDL_DERIVED", message, atom.place)

    def _facts(self, merged: Merged) -> frozenset[str]:
        derived = {rule.head.predicate for rule in merged.domain.derived}
        facts: set[str] = set()
        for formula in self._problem.init:
            if isinstance(formula, Atom):
                self._check_not_derived(formula, derived)
                if self._scope.check_atom(formula, {}):
                    facts.add(fact(formula.predicate, *(term.name for term in formula.terms)))
            elif not isinstance(formula, Numeric):
                self._report.problem("PDDL_INIT", f"{formula} is not a fact", formula.place)
        return frozenset(facts)

    def _goal(self) -> GoalExpr:
        goal = self._problem.goal
        if goal is None:
            problem = Problem("PDDL_GOAL", "the problem has no goal", self._problem.file)
            self._report.problems.append(problem)
            return Condition()
        self._scope.check_formula(goal, {})
        try:
            return condition_of(goal)
        except Misplaced as wrong:
            self._report.problem(wrong.code, wrong.message, wrong.place, wrong.fix)
            return Condition()
