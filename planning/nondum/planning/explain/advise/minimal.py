"""All smallest sets of payloads that make a goal possible.

A hitting-set tree: wherever a smallest set is found, every other one lacks some member of it, so
each member is forbidden in turn. Where all that is allowed does not do, smaller sets are looked at
only as far as something in it is in the way of something else. Source: Reiter, A theory of
diagnosis from first principles (1987); Junker, QuickXplain (2004), narrows conflicts down.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from nondum.planning.explain.advise.disturbance import disturbers
from nondum.planning.explain.advise.trial import Chosen, Outcome, Trials
from nondum.sdk.errors import Problem


@dataclass(slots=True)
class Enumeration:
    """Enumerates sets; `found` is right at any time, and all of them once `is_complete`."""

    trials: Trials
    sets_limit: int
    trials_limit: int
    found: list[Chosen] = field(default_factory=list)
    oversized: dict[int, Problem] = field(default_factory=dict)
    """Candidates with too many ways to act to be planned with; they are in no set."""
    is_complete: bool = False
    _is_certain: bool = True

    def run(self) -> None:
        """Look until all are found, or a limit is reached."""
        everything = frozenset(range(len(self.trials.candidates)))
        waiting: deque[Chosen] = deque([everything])
        seen = {everything}
        while waiting:
            if len(self.found) > self.sets_limit or self.trials.count >= self.trials_limit:
                break
            allowed = waiting.popleft().difference(self.oversized)
            for number in sorted(self._forbidden_next(allowed)):
                smaller = allowed - {number}
                if smaller not in seen:
                    seen.add(smaller)
                    waiting.append(smaller)
        self.is_complete = self._is_certain and not waiting
        least = [s for s in self.found if not any(other < s for other in self.found)]
        self.is_complete &= len(least) <= self.sets_limit
        self.found = sorted(least, key=lambda s: (len(s), sorted(s)))[: self.sets_limit]

    def _forbidden_next(self, allowed: Chosen) -> Chosen:
        """Of which candidates every set that is still to be found lacks one."""
        for known in self.found:
            if known <= allowed:
                return known
        peaceful = self._peaceful(allowed)
        trial = self.trials.of(peaceful)
        if trial.oversized:
            self.oversized |= trial.oversized
            return self._forbidden_next(allowed.difference(trial.oversized))
        if trial.outcome is Outcome.POSSIBLE:
            self.found.append(self._minimised(peaceful))
            return self.found[-1]
        if peaceful != allowed:
            return self._core(allowed)
        if trial.outcome is not Outcome.IMPOSSIBLE:
            self._is_certain = False
            return allowed
        if trial.merged is None or trial.goal is None:  # its words mean nothing
            return frozenset()
        numbered = [(n, self.trials.contributions(n)) for n in sorted(allowed)]
        return disturbers(trial.merged, trial.goal, numbered)

    def _minimised(self, chosen: Chosen) -> Chosen:
        """A possible set that needs all its members; those that the plan never uses go first."""
        kept = self._used(chosen)
        for number in sorted(kept, reverse=True):
            if number in kept and self._is_possible(kept - {number}):
                kept = self._used(kept - {number})
        return kept

    def _used(self, chosen: Chosen) -> Chosen:
        while True:
            used = self.trials.used(chosen, self.trials.of(chosen))
            if used == chosen or not self._is_possible(used):
                return chosen
            chosen = used

    def _is_possible(self, chosen: Chosen) -> bool:
        return self.trials.of(chosen).outcome is Outcome.POSSIBLE

    def _peaceful(self, allowed: Chosen) -> Chosen:
        """As many as get on with each other; who comes first has the say."""
        kept = self.trials.without_doubles(allowed)
        while refused := self.trials.refused(kept):
            kept -= refused
        return kept

    def _core(self, allowed: Chosen) -> Chosen:
        """Some that cannot all be here together, though all but any one of them can."""
        return frozenset(
            _least_conflict(lambda numbers: self.trials.has_conflict(frozenset(numbers)), allowed)
        )


def _least_conflict(conflicts: Callable[[Sequence[int]], bool], numbers: Chosen) -> tuple[int, ...]:
    def narrowed(
        background: tuple[int, ...], left: tuple[int, ...], *, is_wider: bool
    ) -> tuple[int, ...]:
        if is_wider and conflicts(background):
            return ()
        if len(left) == 1:
            return left
        first, second = left[: len(left) // 2], left[len(left) // 2 :]
        late = narrowed((*background, *first), second, is_wider=True)
        early = narrowed((*background, *late), first, is_wider=bool(late))
        return (*early, *late)

    return narrowed((), tuple(sorted(numbers)), is_wider=False)
