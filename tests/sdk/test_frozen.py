"""A frozen class is what the standard library's frozen data class with slots is."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, dataclass, field
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.frozen import frozen


class Plain:
    """Some fields, each of another kind."""

    many: ClassVar[int] = 3
    name: str
    size: int = 1
    place: tuple[int, ...] = field(default=(), compare=False)
    notes: dict[str, int] = field(default_factory=dict, hash=False)
    secret: str = field(default="", repr=False)
    length: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", len(self.name))


class Empty:
    """Nothing."""


class Single:
    """One field."""

    only: Any


def made_by(decorator: Callable[[type], Any], plain: type) -> Any:
    """A class of the same name, fields and methods."""
    left_out = ("__dict__", "__weakref__")
    own = {name: value for name, value in vars(plain).items() if name not in left_out}
    return decorator(type(plain.__name__, (), own))


OURS: dict[type, Any] = {plain: made_by(frozen, plain) for plain in (Plain, Empty, Single)}
THEIRS: dict[type, Any] = {
    plain: made_by(dataclass(frozen=True, slots=True), plain) for plain in (Plain, Empty, Single)
}

names, sizes = st.text(max_size=3), st.integers(0, 3)
values = st.fixed_dictionaries(
    {"name": names},
    optional={
        "size": sizes,
        "place": st.tuples(sizes),
        "notes": st.dictionaries(names, sizes, max_size=1),
        "secret": names,
    },
)


@given(values, values)
def test_objects_are_alike(one: dict[str, Any], other: dict[str, Any]) -> None:
    ours, others = OURS[Plain](**one), OURS[Plain](**other)
    theirs, their_others = THEIRS[Plain](**one), THEIRS[Plain](**other)
    assert dataclasses.asdict(ours) == dataclasses.asdict(theirs)
    assert (repr(ours), hash(ours)) == (repr(theirs), hash(theirs))
    assert (ours == others) is (theirs == their_others)
    replaced = dataclasses.replace(ours, size=7), dataclasses.replace(theirs, size=7)
    assert repr(replaced[0]) == repr(replaced[1])


def parameters(cls: type) -> list[tuple[Any, ...]]:
    found = inspect.signature(cls)
    return [
        (found.return_annotation,),
        *((p.name, p.kind, p.annotation, p.default is p.empty) for p in found.parameters.values()),
    ]


@pytest.mark.parametrize(("plain", "arguments"), [(Plain, ("a", 2)), (Empty, ()), (Single, (3,))])
def test_classes_are_alike(plain: type, arguments: tuple[Any, ...]) -> None:
    ours, theirs = OURS[plain](*arguments), THEIRS[plain](*arguments)
    assert (repr(ours), hash(ours)) == (repr(theirs), hash(theirs))
    assert ours == copy.copy(ours) == copy.deepcopy(ours) != theirs
    assert type(ours).__match_args__ == type(theirs).__match_args__
    assert type(ours).__slots__ == type(theirs).__slots__
    assert parameters(type(ours)) == parameters(type(theirs))
    assert type(ours).__init__.__qualname__ == f"{type(ours).__qualname__}.__init__"


@pytest.mark.parametrize(
    ("made", "name"), [(OURS, "size"), (OURS, "many"), (OURS, "unknown"), (THEIRS, "size")]
)
def test_an_object_does_not_change(made: dict[type, Any], name: str) -> None:
    value = made[Plain]("a")
    with pytest.raises(FrozenInstanceError):
        setattr(value, name, 2)
    with pytest.raises(FrozenInstanceError):
        delattr(value, name)
    assert (value.size, dataclasses.is_dataclass(value)) == (1, True)


@pytest.mark.parametrize("made", [OURS, THEIRS])
@pytest.mark.parametrize(
    ("given", "more"), [((), {}), (("a",), {"name": "b"}), (("a",), {"length": 1})]
)
def test_wrong_arguments_are_refused(
    made: dict[type, Any], given: tuple[str, ...], more: dict[str, Any]
) -> None:
    with pytest.raises(TypeError, match=r"Plain\.__init__\(\) (missing|got)"):
        made[Plain](*given, **more)


def test_each_object_has_its_own_default() -> None:
    one, other = OURS[Plain]("a"), OURS[Plain]("a")
    one.notes["b"] = 1
    assert not other.notes


@frozen
class Base:
    """One field, and its own way to be equal."""

    name: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Base) and other.name.lower() == self.name.lower()

    def __hash__(self) -> int:
        return hash(self.name.lower())

    def __repr__(self) -> str:
        return f"<{self.name}>"


@frozen
class Derived(Base):
    """One field more."""

    size: int = 0


def test_what_a_class_says_itself_stays() -> None:
    assert Base("A") == Base("a")
    assert {Base("A"), Base("a")} == {Base("A")}
    assert repr(Base("A")) == "<A>"


def test_fields_are_inherited() -> None:
    derived = Derived("a", 2)
    assert (derived.name, derived.size, repr(derived)) == ("a", 2, "Derived(name='a', size=2)")
    assert derived != Derived("A", 2)
    with pytest.raises(FrozenInstanceError):
        setattr(derived, "name", "b")  # noqa: B010  # mypy knows that it cannot be set


def test_an_object_can_be_pickled() -> None:
    assert pickle.loads(pickle.dumps(Derived("a", 2))) == Derived("a", 2)  # its own
