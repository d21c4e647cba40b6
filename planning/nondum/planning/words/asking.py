"""Questions that a host answers by itself, before all phrases, whatever is plugged in. English.

Only a sentence that says nothing else is one of them, as with the words that stop.
"""

from __future__ import annotations

from enum import Enum

from nondum.planning.words.addressee import addressed_to
from nondum.planning.words.pattern import words_of


class Question(Enum):
    """What people ask a robot."""

    ABILITIES = "what can you do"
    ACTIVITY = "what are you doing"


ASKED = tuple(question.value for question in Question)
"""What to say; those who listen are told to hear it."""

_OTHERS = {
    Question.ABILITIES: (
        *("what are you able to do", "what you can do", "what can i say", "what can i ask for"),
        *("what can i ask you", "what can i ask you for", "what can i tell you"),
    ),
    Question.ACTIVITY: (
        *("what are you up to", "what do you do", "what you are doing", "what is going on"),
        *("what's going on", "what are you busy with", "what are you at"),
    ),
}
_FORMS = {
    words_of(said): question
    for question in Question
    for said in (question.value, *_OTHERS[question])
}
_BEFORE = frozenset({"hey", "hello", "please", "robot", "so", "and", "tell", "me", "say"})
_AFTER = frozenset({"please", "now", "right", "robot", "for", "me", "here", "currently"})
"""Words that change nothing."""


def question_in(sentence: str, host: str = "") -> Question | None:
    """The question that a sentence asks, with or without the name of this host before it.

    >>> question_in("Rover, what can you do for me?", "rover"), question_in("what can you see")
    (<Question.ABILITIES: 'what can you do'>, None)
    """
    said = words_of(addressed_to(sentence, [host])[1])
    return next(
        (
            question
            for form, question in _FORMS.items()
            for start in range(len(said) - len(form) + 1)
            if said[start : start + len(form)] == form
            and _BEFORE.issuperset(said[:start])
            and _AFTER.issuperset(said[start + len(form) :])
        ),
        None,
    )
