"""At most once, whatever is repeated, in bounded memory."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from nondum.transport.peers.call_history import Bounds, CallHistory, Seen

BOUNDS = Bounds(answers=5, size=100)


class Caller(RuleBasedStateMachine):
    """A caller that numbers upwards and repeats what it likes; links lose whatever they like."""

    def __init__(self) -> None:
        super().__init__()
        self.once = CallHistory(BOUNDS)
        self.next = 1
        self.begun: set[int] = set()
        self.running: set[int] = set()
        self.answers: dict[int, bytes] = {}

    @rule(gap=st.integers(0, 3))
    def a_new_call_comes(self, gap: int) -> None:
        number = self.next + gap  # those between were lost on the way, for ever
        assert self.once.take(number) is Seen.NEW
        self.next = number + 1
        self.begun.add(number)
        self.running.add(number)

    @precondition(lambda self: self.begun)
    @rule(data=st.data())
    def a_call_is_repeated(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.begun)))
        seen = self.once.take(number)
        assert seen is not Seen.NEW
        assert (seen is Seen.RUNNING) == (number in self.running)
        if seen is Seen.ANSWERED:
            assert self.once.answer(number) == self.answers[number]

    @precondition(lambda self: self.running)
    @rule(data=st.data(), answer=st.binary(max_size=60))
    def a_call_is_answered(self, data: st.DataObject, answer: bytes) -> None:
        number = data.draw(st.sampled_from(sorted(self.running)))
        self.running.remove(number)
        self.answers[number] = answer
        self.once.answered(number, answer)
        assert self.once.take(number) is Seen.ANSWERED

    @rule(below=st.integers(1, 40))
    def the_caller_settles(self, below: int) -> None:
        self.once.settle(below)

    @invariant()
    def memory_is_bounded(self) -> None:
        assert self.once.size <= BOUNDS.size
        assert self.once.kept <= BOUNDS.answers


TestCaller = Caller.TestCase


def test_settled_answers_are_forgotten() -> None:
    once = CallHistory()
    for number in (1, 2, 3):
        once.take(number)
        once.answered(number, b"yes")
    once.settle(3)
    assert [once.take(number) for number in (1, 2, 3)] == [
        Seen.FORGOTTEN,
        Seen.FORGOTTEN,
        Seen.ANSWERED,
    ]
