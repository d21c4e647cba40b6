"""What can make facts true once nothing is ever deleted: moves, conditional effects, rules.

Beyond the bits of a state there are facts for "this is false", where the complement of a derived
fact asks for it, and one for the goal.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from nondum.planning.search.encoding import Encoded, State

RULE = -1
"""The move of a change that a rule makes, without a step of the plan."""


def bits_of(mask: int) -> Iterator[int]:
    """The positions of a mask's bits, lowest first."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


class Changes:
    """Parallel lists, by change: first one change for each move, in the order of the moves."""

    def __init__(self, encoded: Encoded) -> None:
        self.needs: list[tuple[int, ...]] = []
        self.gives: list[tuple[int, ...]] = []
        self.moves: list[int] = []
        """Index of the move, or `RULE`."""
        self.negated = 0
        """Bits whose being false is a fact: bit b is fact `encoded.width + b`."""
        self._encoded = encoded
        self.facts = 2 * encoded.width
        self._add_rules()
        rules, self.needs, self.gives, self.moves = (self.needs, self.gives), [], [], []
        for index, move in enumerate(encoded.moves):
            self._add(move.precondition, (move.add, move.delete), index)
        for index, move in enumerate(encoded.moves):
            for when in move.conditional:
                self._add(move.precondition | when.condition, (when.add, when.delete), index)
        self.needs += rules[0]
        self.gives += rules[1]
        self.moves += [RULE] * len(rules[0])
        self.goal = self._new_fact()
        self._add_rule(bits_of(encoded.goal | 1), self.goal)
        self.needing: list[list[int]] = [[] for _ in range(self.facts)]
        """Fact → the changes that need it."""
        for change, needs in enumerate(self.needs):
            for fact in needs:
                self.needing[fact].append(change)

    def facts_in(self, state: State) -> int:
        """The mask of the facts that hold in a state, those about what is false included."""
        return state | (~state & self.negated) << self._encoded.width

    def _add(self, needs: int, effect: tuple[int, int], move: int) -> None:
        add, delete = effect
        self.needs.append(tuple(bits_of(needs or 1)))
        self.gives.append((*bits_of(add), *map(self._not, bits_of(delete & self.negated))))
        self.moves.append(move)

    def _add_rule(self, needs: Iterable[int], gives: int) -> None:
        self.needs.append(tuple(needs))
        self.gives.append((gives,))
        self.moves.append(RULE)

    def _add_rules(self) -> None:
        rules: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
        fact_of: dict[int, int] = {}
        waiting: list[int] = []
        for layer in self._encoded.layers:
            cyclic = layer.cyclic_heads()
            for head, body in layer.rules:
                self._add_rule(bits_of(body or 1), head.bit_length() - 1)
                rules[head].append((body, cyclic))
            for fact, other in layer.complements:
                fact_of[other] = fact
                self._add_rule([self._negation(fact, waiting)], other.bit_length() - 1)
        while waiting:
            false = waiting.pop()
            if false in fact_of:
                needs: tuple[int, ...] = (fact_of[false].bit_length() - 1,)
            elif false in rules:
                needs = self._blocked(rules[false], waiting)
            else:
                continue
            self._add_rule(needs, self._not(false.bit_length() - 1))

    def _blocked(self, rules: Iterable[tuple[int, int]], waiting: list[int]) -> tuple[int, ...]:
        """What is true wherever none of these rules applies. Cycles are taken to be broken."""
        needs = [0]
        for body, cyclic in rules:
            if body & cyclic:
                continue
            false = [self._negation(1 << bit, waiting) for bit in bits_of(body)]
            if len(false) == 1:
                needs += false
                continue
            needs.append(self._new_fact())
            for fact in false:
                self._add_rule((fact,), needs[-1])
        return tuple(needs)

    def _negation(self, bit: int, waiting: list[int]) -> int:
        """The fact that a bit is not set; of no bit at all, what is always true."""
        if not bit:
            return 0
        if not self.negated & bit:
            self.negated |= bit
            waiting.append(bit)
        return self._not(bit.bit_length() - 1)

    def _not(self, bit: int) -> int:
        return self._encoded.width + bit

    def _new_fact(self) -> int:
        self.facts += 1
        return self.facts - 1
