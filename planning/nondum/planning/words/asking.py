"""Questions that a host answers by itself, before all phrases, whatever is plugged in. English.

Only a sentence that says nothing else is one of them, as with the words that stop.
"""

from __future__ import annotations

from enum import Enum

from nondum.planning.words.addressee import addressed_to
from nondum.planning.words.pattern import words_of
from nondum.sdk.frozen import frozen


class Question(Enum):
    """What people ask a robot."""

    ABILITIES = "what can you do"
    ACTIVITY = "what are you doing"
    WHY_NOT = "why not"
    EVENTS = "what happened"
    HOSTS = "who is here"
    PULLING = "what can i pull"


@frozen
class Asked:
    """A question, and what it is about."""

    question: Question
    about: str = ""
    """The wish that "why can't you …" speaks of; empty: the one that was given last."""


ASKED = (Question.ABILITIES.value, Question.ACTIVITY.value)
"""The questions that those who listen are taught. For the others it is not measured how often a
recogniser takes another sentence for them."""

_OTHERS = {
    Question.ABILITIES: (
        *("what are you able to do", "what you can do", "what can i say", "what can i ask for"),
        *("what can i ask you", "what can i ask you for", "what can i tell you"),
    ),
    Question.ACTIVITY: (
        *("what are you up to", "what do you do", "what you are doing", "what is going on"),
        *("what's going on", "what are you busy with", "what are you at"),
    ),
    Question.WHY_NOT: (
        *("why can't you", "why don't you", "why aren't you", "why do you wait"),
        *("what are you waiting for", "what is missing", "what's missing", "what do you need"),
    ),
    Question.EVENTS: (
        *("what has happened", "what's happened", "what did happen", "what just happened"),
        *("what is new", "what's new", "what happened just now"),
    ),
    Question.HOSTS: (
        *("who's here", "who are you", "who else is here", "who is there", "who's there"),
        *("who is with you", "who are you with", "which robots are here"),
    ),
    Question.PULLING: tuple(
        f"{asked} {what}{out}"
        for asked in (
            *("is it safe to pull", "is it safe to unplug", "is it safe to remove", "can i pull"),
            *("can i unplug", "can i remove", "may i pull", "may i unplug", "may i remove"),
        )
        for what in ("this", "it", "that", "the drive", "the stick", "this drive", "this stick")
        for out in ("", " out")
    ),
}
_FORMS = {
    words_of(said): question
    for question in Question
    for said in (question.value, *_OTHERS[question])
}
_WHY_NOT = tuple(
    map(
        words_of,
        (
            *("why can't you", "why cannot you", "why can you not", "why couldn't you"),
            *("why don't you", "why do you not", "why won't you", "why will you not"),
        ),
    )
)
"""What comes before a wish that is not fulfilled."""
_BEFORE = frozenset({"hey", "hello", "please", "robot", "so", "and", "but", "tell", "me", "say"})
_AFTER = frozenset({"please", "now", "right", "robot", "for", "me", "here", "currently", "then"})
"""Words that change nothing."""


def question_in(sentence: str, host: str = "") -> Asked | None:
    """The question that a sentence asks, with or without the name of this host before it.

    >>> question_in("Rover, what can you do for me?", "rover"), question_in("what can you see")
    (Asked(question=<Question.ABILITIES: 'what can you do'>, about=''), None)
    >>> question_in("why can't you follow me?").about
    'follow me'
    """
    said = words_of(addressed_to(sentence, [host])[1])
    for start in range(len(said)):
        if not _BEFORE.issuperset(said[:start]):
            break
        if asked := _asked(said[start:]):
            return asked
    return None


def _asked(said: tuple[str, ...]) -> Asked | None:
    """The question that words begin with, with nothing behind it but what it is about."""
    for form, question in _FORMS.items():
        if said[: len(form)] == form and _AFTER.issuperset(said[len(form) :]):
            return Asked(question)
    for form in _WHY_NOT:
        if said[: len(form)] == form and len(said) > len(form):
            return Asked(Question.WHY_NOT, " ".join(said[len(form) :]))
    return None
