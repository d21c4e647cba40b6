"""What can ever become true, and by which bindings of which actions, if nothing were deleted."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping

from nondum.planning.ground.bounds import INSTANCES_LIMIT, TooManyBindings, work_for
from nondum.planning.ground.heads import ActionHead, ChangeHead, DerivedHead, Head
from nondum.planning.ground.instances import Derivation, Exploration, FactTable, Instance, Row
from nondum.planning.ground.join import Join, Relations, TooMuchWork
from nondum.planning.ground.members import Types, domains_of, members_of
from nondum.planning.ground.schema_relevance import Wishes
from nondum.planning.ground.static import static_facts
from nondum.planning.merge.domain import Merged, Origin, functional_predicates
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.syntax import TypedName


def explore(
    merged: Merged,
    facts: Iterable[str],
    objects: Types | None = None,
    *,
    limit: int = INSTANCES_LIMIT,
    wishes: Wishes | None = None,
) -> Exploration:
    """Explore from where exactly `facts` hold; `objects` exist beside the merged ones.

    A condition that something is false counts as reachable, unless it is true and nothing can ever
    make it false; disjunctions and quantifiers are decided as far as facts that never change do.
    Raises `TooManyBindings` (PDDL_TOO_MANY) that names the action with most bindings when there are
    more than `limit`, or too many are looked at: to leave some out would make a wrong proof.
    """
    types = {name: found.types for name, found in merged.objects.items()} | dict(objects or {})
    members = members_of(merged, types)
    derived = {rule.head.predicate for rule in merged.domain.derived}
    believed = [parts(text) for text in sorted(facts)]
    known = [
        (predicate, row)
        for predicate, row in believed
        if predicate not in derived and all(name in types for name in row)
    ]
    return Fixpoint(merged, known, members, limit, wishes).run()


class Fixpoint:
    """Facts wait in line; each one taken out fires every rule that it completes."""

    def __init__(
        self,
        merged: Merged,
        believed: Iterable[tuple[str, Row]],
        members: Mapping[str, frozenset[str]],
        limit: int,
        wishes: Wishes | None,
    ) -> None:
        self._wishes = wishes
        self._domain = merged.domain
        self._members = members
        self._limit = limit
        self.work = work_for(limit)
        self._spent: Counter[Head] = Counter()
        self._counts: Counter[Head] = Counter()
        self._total = 0
        self.table = FactTable()
        self._believed = frozenset(self.table.number(*fact) for fact in believed)
        self._reached = set(self._believed)
        self._waiting: list[int] = []
        effects = [action.effect for action in merged.domain.actions.values()]
        derived = {rule.head.predicate for rule in merged.domain.derived}
        added = {atom.predicate for effect in effects for atom in effect.added()}
        deleted = {atom.predicate for effect in effects for atom in effect.deleted()}
        self._functional = functional_predicates(merged.domain)
        self._deleted = deleted | (added & self._functional)
        self.added = frozenset(added | derived)
        self.static = static_facts(
            map(self.table.facts.__getitem__, self._believed),
            frozenset(self.added | self._deleted),
            members,
            self.work,
        )
        self.instances: dict[tuple[str, Row], Instance] = {}
        self.derivations: list[Derivation] = []

    def domains_of(self, variables: Iterable[TypedName]) -> dict[str, frozenset[str]]:
        """Variable → the objects that it may stand for."""
        return domains_of(variables, self._members)

    def excludes(self, negative: frozenset[int]) -> bool:
        """Whether a fact that must be false is true, and stays so."""
        facts = self.table.facts
        return any(facts[n][0] not in self._deleted for n in negative & self._believed)

    def asks_for(self, add: frozenset[int], delete: frozenset[int]) -> bool:
        """Whether anybody wishes for one of these changes."""
        wishes = self._wishes
        if wishes is None:
            return True
        facts = self.table.facts
        return (
            any(wishes.include(*facts[n], is_true=True) for n in add)
            or any(wishes.include(*facts[n], is_true=False) for n in delete)
            or any(facts[n][0] in self._functional for n in add)
        )

    def reach(self, facts: frozenset[int]) -> None:
        """Put the facts that are new in line."""
        new = facts - self._reached
        self._reached |= new
        self._waiting += sorted(new)

    def count(self, head: Head) -> None:
        """Count a binding. Raises `TooManyBindings` where there are too many."""
        self._counts[head] += 1
        self._total += 1
        if self._total > self._limit:
            raise self._too_many()

    def run(self) -> Exploration:
        heads = list(self._heads())
        joins = [(j, trigger, h) for h in heads if not h.is_bound for trigger, j in h.joins]
        counter = _FactCounter(head for head in heads if head.is_bound)
        relations = Relations()
        triggered: defaultdict[str, list[tuple[Join, Head]]] = defaultdict(list)
        for join, trigger, head in joins:
            if trigger:
                triggered[trigger].append((join, head))
        for number in sorted(self._believed):
            predicate, row = self.table.facts[number]
            if predicate in self.added:
                self._waiting.append(number)
            else:
                relations.add(predicate, row)
                counter.take(number)
        self._fire(counter)  # first: changes find the instance that they belong to
        for join, trigger, head in joins:
            if not trigger:
                self._join(join, head, relations)
        while self._waiting:
            number = self._waiting.pop()
            counter.take(number)
            self._fire(counter)
            predicate, row = self.table.facts[number]
            relations.add(predicate, row)
            for join, head in triggered.get(predicate, ()):
                self._join(join, head, relations, row)
        return Exploration(
            self.table,
            self._believed,
            frozenset(self._reached),
            tuple(sorted(self.instances.values(), key=lambda i: (i.action.name, i.row))),
            tuple(self.derivations),
            self._members,
        )

    def _heads(self) -> Iterator[Head]:
        """Each action before its changes, so that these find the instance that they belong to."""
        for action in self._domain.actions.values():
            yield ActionHead(action, self)
            for change in action.effect.conditional:
                yield ChangeHead(action, change, self)
        for rule in self._domain.derived:
            yield DerivedHead(rule, self)

    def _join(self, join: Join, head: Head, relations: Relations, row: Row = ()) -> None:
        before = self.work.left
        try:
            join.run(relations, head.domains, head.fire, row, work=self.work)
        except TooMuchWork:
            raise self._exhausted_by(head, before) from None
        self._spent[head] += before - self.work.left

    def _fire(self, counter: _FactCounter) -> None:
        while counter.complete:
            head, before = counter.complete.popleft(), self.work.left
            try:
                head.fire([])
            except TooMuchWork:
                raise self._exhausted_by(head, before) from None
            self._spent[head] += before - self.work.left

    def _exhausted_by(self, head: Head, before: int) -> TooManyBindings:
        self._spent[head] += before
        return self._too_many()

    def _too_many(self) -> TooManyBindings:
        """Those count who made most bindings or, where none were made, looked at most."""
        is_fruitless = self.work.left < 0
        counts = _by_name(self._spent if is_fruitless else self._counts)
        name, (count, origins) = max(
            counts.items(), key=lambda counted: (counted[1][0], counted[0])
        )
        message = (
            f"the ways to bind {name!r} are too many to look at"
            if is_fruitless
            else f"more than {self._limit} ways to bind the actions, {count} of them of {name!r}"
        )
        return TooManyBindings.of(
            message, origins, fix="add preconditions that say which objects belong together"
        )


class _FactCounter:
    """Rules without variables: each is complete when the last of its facts is there."""

    def __init__(self, heads: Iterable[Head]) -> None:
        self.complete: deque[Head] = deque()
        self._waiting: defaultdict[int, list[Head]] = defaultdict(list)
        self._missing: dict[Head, int] = {}
        for head in heads:
            needs = head.needs
            self._missing[head] = len(needs)
            for fact in needs:
                self._waiting[fact].append(head)
            if not needs:
                self.complete.append(head)

    def take(self, fact: int) -> None:
        """A fact is there."""
        for head in self._waiting.get(fact, ()):
            self._missing[head] -= 1
            if not self._missing[head]:
                self.complete.append(head)


def _by_name(counts: Mapping[Head, int]) -> dict[str, tuple[int, tuple[Origin, ...]]]:
    """An action's own bindings and those of its conditional effects are one."""
    found: dict[str, tuple[int, tuple[Origin, ...]]] = {}
    for head, count in counts.items():
        found[head.name] = (found.get(head.name, (0, ()))[0] + count, head.origins)
    return found
