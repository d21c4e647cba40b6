"""The world model under any news: exact retraction, the order of arrivals, one value at most."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from nondum.planning.execute.world import WorldModel

COMPONENTS = ("arm", "camera", "map")
FACTS = ("at cup a", "at cup b", "at pot a", "open door", "near attic")
OBJECTS = frozenset({"cup", "pot", "a", "b", "door"})

components = st.sampled_from(COMPONENTS)
facts = st.sampled_from(FACTS)
some_facts = st.frozensets(facts, max_size=3)


@dataclass(frozen=True)
class News:
    """Something that a component says or does."""

    what: str
    component: str
    at_s: float
    fact: str = FACTS[0]
    add: frozenset[str] = frozenset()
    delete: frozenset[str] = frozenset()


def fresh() -> WorldModel:
    world = WorldModel()
    world.frame(objects=OBJECTS, observed=frozenset(), functional=frozenset({"at"}))
    return world


def tell(world: WorldModel, news: News) -> None:
    name = f"{news.component} {news.fact}"
    match news.what:
        case "know":
            world.know(news.fact, news.component, news.at_s)
        case "forget":
            world.forget(news.fact, news.component, news.at_s)
        case "recant":
            world.recant(news.fact, news.component)
        case "silence":
            world.silence(news.component)
        case "seed":
            world.seed(news.component, news.add, news.at_s)
        case "succeed":
            world.succeed(name, news.component, add=news.add, delete=news.delete, at_s=news.at_s)
        case "establish":
            world.establish(name, news.component, add=news.add, delete=news.delete, at_s=news.at_s)
        case "end":
            world.end(name)


def told(news: Iterable[News]) -> WorldModel:
    world = fresh()
    for one in news:
        tell(world, one)
    return world


kinds = ("know", "forget", "recant", "silence", "seed", "succeed", "establish", "end")


class Life(RuleBasedStateMachine):
    """Components come, talk, act and go; the model is compared with a new one."""

    def __init__(self) -> None:
        super().__init__()
        self.world = fresh()
        self.log: list[News] = []

    @rule(
        what=st.sampled_from(kinds),
        component=components,
        fact=facts,
        add=some_facts,
        delete=some_facts,
    )
    def hear(
        self, what: str, component: str, fact: str, add: frozenset[str], delete: frozenset[str]
    ) -> None:
        news = News(what, component, float(len(self.log)), fact, add, delete)
        tell(self.world, news)
        self.log.append(news)

    @rule(component=components)
    def lose(self, component: str) -> None:
        self.world.remove_component(component, ())
        self.log = [news for news in self.log if news.component != component]

    @rule(objects=st.frozensets(st.sampled_from(sorted(OBJECTS))))
    def reframe(self, objects: frozenset[str]) -> None:
        self.world.frame(objects=objects, observed=frozenset(), functional=frozenset({"at"}))
        without = {f for f in self.world.facts if not set(f.split()[1:]) <= objects}
        assert not without
        self.world.frame(objects=OBJECTS, observed=frozenset(), functional=frozenset({"at"}))

    @invariant()
    def nothing_of_those_who_left_remains(self) -> None:
        new = told(self.log)
        assert self.world.facts == new.facts
        assert self.world.bare_facts == new.bare_facts
        assert self.world.parked() == new.parked()

    @invariant()
    def a_thing_is_at_one_place(self) -> None:
        for believed in (self.world.facts, self.world.bare_facts):
            places = Counter(f.rpartition(" ")[0] for f in believed if f.startswith("at "))
            assert all(count == 1 for count in places.values())

    @invariant()
    def what_holds_is_said_by_somebody(self) -> None:
        assert all(self.world.evidence(fact).pros for fact in self.world.facts)


Life.TestCase.settings = settings(stateful_step_count=25)
TestLife = Life.TestCase


@given(
    st.lists(
        st.tuples(st.sampled_from(["know", "forget", "succeed"]), components, facts, some_facts),
        max_size=10,
    ),
    st.randoms(use_true_random=False),
)
def test_order_of_arrivals_between_components_changes_nothing(
    said: list[tuple[str, str, str, frozenset[str]]], random: Random
) -> None:
    news = [
        News(what, component, float(number), fact, add=frozenset({fact}), delete=delete)
        for number, (what, component, fact, delete) in enumerate(said)
    ]
    assert told(shuffled(news, random)).facts == told(news).facts


def shuffled(news: list[News], random: Random) -> list[News]:
    """Another interleaving: what one component says stays in its order, as on its link."""
    lines = {name: [n for n in news if n.component == name] for name in COMPONENTS}
    mixed = []
    while left := [name for name, line in lines.items() if line]:
        mixed.append(lines[random.choice(left)].pop(0))
    return mixed
