"""Types know what is above them, several parents and circles included."""

from __future__ import annotations

import pytest

from nondum.planning.pddl.typegraph import TypeGraph


def graph(**parents: str) -> TypeGraph:
    return TypeGraph({name: frozenset(above.split()) for name, above in parents.items()})


DIAMOND = graph(amphibian="boat cart", boat="vehicle", cart="vehicle", vehicle="", rock="")


def test_type_is_a_kind_of_all_above_it() -> None:
    assert DIAMOND.ancestors("amphibian") == {"amphibian", "boat", "cart", "vehicle", "object"}
    assert not DIAMOND.is_kind_of("vehicle", "boat")


def test_either_asks_for_one_of_several() -> None:
    assert DIAMOND.all_kind_of(("boat", "cart"), ("vehicle",))
    assert DIAMOND.all_kind_of(("boat",), ("cart", "boat"))
    assert not DIAMOND.all_kind_of(("boat", "rock"), ("vehicle",))


def test_may_be_needs_one_fitting_pair() -> None:
    assert DIAMOND.may_be(("vehicle",), ("boat",))
    assert DIAMOND.may_be(("rock", "boat"), ("vehicle",))
    assert not DIAMOND.may_be(("rock",), ("vehicle",))


@pytest.mark.parametrize(
    ("parents", "cycle"),
    [
        ({"a": "a"}, ("a",)),
        ({"a": "b", "b": "a"}, ("a", "b")),
        ({"x": "a", "a": "b c", "b": "", "c": "d", "d": "a"}, ("a", "c", "d")),
        ({"a": "b c", "b": "d", "c": "d", "d": ""}, ()),
    ],
)
def test_circles_are_found(parents: dict[str, str], cycle: tuple[str, ...]) -> None:
    assert graph(**parents).cycle() == cycle


def test_long_chains_are_no_trouble() -> None:
    chain = {f"t{i}": f"t{i + 1}" for i in range(900)}
    assert graph(**chain, t900="").cycle() == ()
