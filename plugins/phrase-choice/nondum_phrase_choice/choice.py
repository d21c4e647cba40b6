"""What the model is asked, and what of its answers is taken: pure functions over the host's words.

The model chooses one of the phrases that the robot understands now, and the names in it; it writes
no PDDL and no sentence. Whatever it says is checked here, though its output is constrained by
`schema`: servers have been seen to give a grammar up in silence (llama.cpp issue 19051).
"""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

NO_SENTENCE: Mapping[str, str] = {
    "unknown": "no sentence of the robot means that",
    "several": "more than one thing is wanted",
    "condition": "there is a condition, a time or a refusal in it that no sentence has",
}
"""What the model may say instead of a phrase → what it means."""
LONGEST_SAID = 80
"""Characters in a slot that takes any words."""
_SLOT = re.compile(r"\{([\w-]+)\}")

Phrases: TypeAlias = Mapping[str, Mapping[str, Sequence[str]]]
"""Words with `{slots}` → slot → the names that fit; none where any words do."""


class AnswerRefused(ValueError):
    """An answer that is no choice among those that were offered; the message says why."""


def phrases_of(vocabulary: Mapping[str, Any]) -> Phrases:
    """The phrases in what a host tells a translator; of two that are alike, the names of both."""
    found: dict[str, dict[str, list[str]]] = {}
    for phrase in vocabulary.get("phrases", ()):
        slots = found.setdefault(phrase["words"], {})
        for slot, names in phrase["slots"].items():
            slots[slot] = list(dict.fromkeys((*slots.get(slot, ()), *names)))
    return found


def instructions(phrases: Phrases) -> str:
    """The system prompt: the phrases, and how to answer."""
    listed = "\n".join(f"- {_listed(words, slots)}" for words, slots in phrases.items())
    others = "\n".join(f'{{"goal": "{name}"}}: {why}' for name, why in NO_SENTENCE.items())
    return (
        "A person speaks to a robot. Choose the sentence of the robot that means the same.\n"
        f"The robot has these sentences, and no others:\n{listed}\n"
        'Answer in JSON: {"goal": {"pattern": the sentence as above, "slots": {slot: name}}}.\n'
        f"If none of them means just that, answer instead:\n{others}\n"
        "Do not choose a sentence that only looks alike."
    )


def _listed(words: str, slots: Mapping[str, Sequence[str]]) -> str:
    named = (f"{slot}: {', '.join(names) or 'any words'}" for slot, names in slots.items())
    return "; ".join((words, *named))


def schema(phrases: Phrases) -> dict[str, Any]:
    """The JSON schema of answers: one choice for each phrase, and what there is instead."""
    choices = [
        _object(
            pattern={"enum": [words]},
            slots=_object(**{slot: _names(names) for slot, names in slots.items()}),
        )
        for words, slots in phrases.items()
    ]
    return _object(goal={"anyOf": [*choices, {"enum": list(NO_SENTENCE)}]})


def _object(**properties: Any) -> dict[str, Any]:
    required = list(properties)
    return {
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _names(names: Sequence[str]) -> dict[str, Any]:
    if names:
        return {"enum": list(names)}
    return {"type": "string", "minLength": 1, "maxLength": LONGEST_SAID}


def sentence(answer: str, phrases: Phrases) -> str | None:
    """The sentence that an answer chooses; None where it says that there is none.

    Raises `AnswerRefused` for everything else.
    """
    try:
        said = json.loads(answer)
    except (ValueError, RecursionError) as error:
        raise AnswerRefused(f"no JSON: {answer[:100]!r}") from error
    match said:
        case {"goal": str(instead)} if instead in NO_SENTENCE:
            return None
        case {"goal": {"pattern": str(words), "slots": dict(slots)}} if words in phrases:
            return _filled(words, slots, phrases[words])
    raise AnswerRefused(f"not among what was offered: {answer[:100]!r}")


def translation(
    words: str, answer: str, phrases: Phrases, log: logging.Logger
) -> dict[str, str] | None:
    """What a component answers to `translate_goal`; what was said and answered is logged."""
    log.info("%r was said, the model answered %r", words, answer)
    try:
        meant = sentence(answer, phrases)
    except AnswerRefused as refused:
        log.warning("the answer is not taken: %s", refused)
        return None
    return None if meant is None else {"words": meant}


def _filled(words: str, said: Mapping[str, Any], slots: Mapping[str, Iterable[str]]) -> str:
    if said.keys() != slots.keys():
        raise AnswerRefused(f"{words!r} has the slots {sorted(slots)}, not {sorted(said)}")
    for slot, names in slots.items():
        if not _fits(said[slot], tuple(names)):
            raise AnswerRefused(f"{str(said[slot])[:100]!r} is no {slot} in {words!r}")
    return _SLOT.sub(lambda slot: str(said[slot[1]]), words)


def _fits(name: object, names: Sequence[str]) -> bool:
    if names:
        return name in names
    return isinstance(name, str) and bool(name.strip()) and len(name) <= LONGEST_SAID
