"""What follows from facts by the rules that plugins bring."""

from __future__ import annotations

from tests.planning.fragments import HOST, brings

from nondum.planning.ground.conclusions import conclusions
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge

WORDS = """(:constants hall kitchen attic - place)
           (:predicates (next ?a ?b - place) (near ?a ?b - place) (lit ?p - place) (dark)
                        (gloomy ?p - place))"""


def merged(rules: str) -> Merged:
    result = merge([brings("map", WORDS + rules)], HOST)
    assert not result.quarantined, result.quarantined
    return result


def test_rules_that_build_on_each_other_are_followed_to_the_end() -> None:
    found = conclusions(
        merged(
            "(:derived (near ?a ?b - place)"
            " (or (next ?a ?b) (exists (?c - place) (and (next ?a ?c) (near ?c ?b)))))"
        ),
        ["next hall kitchen", "next kitchen attic"],
    )
    assert sorted(found) == ["near hall attic", "near hall kitchen", "near kitchen attic"]


def test_what_does_not_follow_can_be_asked_for() -> None:
    domain = merged(
        "(:derived (dark) (forall (?p - place) (not (lit ?p))))"
        "(:derived (gloomy ?p - place) (and (not (lit ?p)) (not (dark))))"
    )
    assert sorted(conclusions(domain, [])) == ["dark"]
    assert sorted(conclusions(domain, ["lit hall"])) == ["gloomy attic", "gloomy kitchen"]


def test_each_conclusion_names_the_rules_that_give_it() -> None:
    found = conclusions(merged("(:derived (dark) (not (lit hall)))"), [])
    assert [str(rule.origins[0]) for rule in found["dark"]] == ["map 1.0 domain.pddl:3:56"]


def test_of_rules_with_too_many_bindings_nothing_is_said() -> None:
    """What others say is drawn all the same, unless it asks for what is not known then."""
    pins = " ".join(f"pin{number}" for number in range(100))
    saying = "(or (lit ?a) (near ?a ?b) (not (lit ?c)) (lit ?d))"
    wide = f"""(:constants {pins} - place)
        (:predicates (lit ?p - place) (near ?a ?b - place) (well))
        (:derived (near ?a ?b - place) (lit ?a))
        (:derived (well) (forall (?a ?b ?c ?d - place) {saying}))"""
    words = "(:predicates (dark) (well) (ill) (poor) (lit ?p - place))"
    others = """(:derived (dark) (not (exists (?p - place) (lit ?p))))
        (:derived (ill) (not (well))) (:derived (poor) (ill))"""
    result = merge([brings("wide", wide), brings("other", words + others)], HOST)
    assert not result.quarantined, result.quarantined
    assert sorted(conclusions(result, [])) == ["dark"]


def test_without_rules_nothing_follows() -> None:
    assert conclusions(merged(""), ["lit hall"]) == {}
