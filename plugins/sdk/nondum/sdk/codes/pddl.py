"""Codes of refusals: fragments and phrases."""

from nondum.sdk.codes.code import Code

AREA = "Fragments and phrases"
CODES = (
    Code(
        "PDDL_ACTOR",
        "The first parameter of an action is not a unit.",
        "begin with the unit that acts, as in (point ?u - pointer …)",
    ),
    Code(
        "PDDL_BEHAVIOUR",
        "A behaviour and its action do not agree.",
        "give both the same name and parameters",
    ),
    Code(
        "PDDL_DERIVED",
        "A rule's predicate is written by something else, or depends on its own negation.",
        "write what the rule follows from instead",
    ),
    Code(
        "PDDL_DOMAIN",
        "A problem names another domain than the one it is given with.",
        "correct the name",
    ),
    Code(
        "PDDL_FACT_CONFLICT",
        "Two components tell different values of one thing; the newest is believed.",
        "look which of the two is wrong: `nondum facts --why`",
    ),
    Code(
        "PDDL_GOAL",
        "A goal stands where none may, or is missing where one must be.",
        "people give goals: leave it out of fragments; a problem that stands alone has one",
    ),
    Code(
        "PDDL_INIT",
        "Something in :init is no fact.",
        "give facts only",
    ),
    Code(
        "PDDL_INSTANCE",
        "An action names one of its plugin's own units instead of a parameter.",
        "use a parameter, so that it serves every unit of that type",
    ),
    Code(
        "PDDL_KIND",
        "A domain where a problem is expected, or the other way round.",
        "give the files in the other order",
    ),
    Code(
        "PDDL_MISPLACED",
        "A condition stands where an effect belongs, or the other way round.",
        "move it to where it belongs",
    ),
    Code(
        "PDDL_OBJECT_TYPE",
        "An object is declared with types that exclude each other.",
        "use the type of the other declaration, or another name",
    ),
    Code(
        "PDDL_OWN_WORD",
        "A word that a payload declares is in no other fragment that is known here: a remark.",
        "use the word of nondum-core that means the same, if there is one",
    ),
    Code(
        "PDDL_OWNED",
        "A fragment writes what is the host's, or another component's.",
        "leave it out: only its owner may write it",
    ),
    Code(
        "PDDL_ARITY",
        "A predicate is used with another number of arguments than it has.",
        "give it as many as its declaration has",
    ),
    Code(
        "PDDL_SIGNATURE",
        "A predicate is declared with types that exclude each other.",
        "use the types of the other declaration, or another name",
    ),
    Code(
        "PDDL_SYNTAX",
        "The text is not PDDL.",
        "correct the place that is shown; what was expected there is said",
    ),
    Code(
        "PDDL_TWICE",
        "A section, action, variable or declaration stands there twice.",
        "leave one of them out",
    ),
    Code(
        "PDDL_TYPE",
        "An argument cannot be of the type that is asked for.",
        "use an object of that type, or correct the declaration",
    ),
    Code(
        "PDDL_TYPE_CYCLE",
        "Types are under one another in a circle.",
        "take one of the parents away",
    ),
    Code(
        "PDDL_TYPE_PARENT",
        "A type is declared under parents that exclude each other.",
        "use the parent of the other declaration, or another name",
    ),
    Code(
        "PDDL_UNKNOWN",
        "A type, predicate, object or variable that no fragment declares.",
        "declare it, or correct its spelling",
    ),
    Code(
        "PDDL_UNSUPPORTED",
        "PDDL that is not handled.",
        "say it in other words: docs/fragments.md tells what is handled",
    ),
    Code(
        "PDDL_VERSION",
        "Another version of the plugin, with other words, is there already.",
        "pull the other version, or bring both to one",
    ),
    Code(
        "PDDL_TOO_BIG",
        "A fragment is longer than is read.",
        "tell its author: split or shorten it",
    ),
    Code(
        "PDDL_TOO_DEEP",
        "A fragment is nested too deeply.",
        "tell its author: flatten it",
    ),
    Code(
        "PDDL_TOO_MANY",
        "There are too many possibilities to look at.",
        "tell its author: use fewer parameters, or narrower types",
    ),
    Code(
        "PHRASE_AMBIGUOUS",
        "The words fit several phrases.",
        "say it in other words, or give the goal with --pddl",
    ),
    Code(
        "PHRASE_EARLY",
        "No phrase fits the words yet, and payloads are still being installed.",
        "ask again in a moment, or have the words kept: `nondum goal --keep WORDS`",
    ),
    Code(
        "PHRASE_INVALID",
        "A phrase is declared wrongly.",
        "tell its author: docs/fragments.md tells how phrases are written",
    ),
    Code(
        "PHRASE_UNKNOWN",
        "No phrase fits the words.",
        "see `nondum goals` for what can be said here",
    ),
    Code(
        "PHRASE_WORDS_UNKNOWN",
        "A part of the words means nothing here.",
        "see `nondum goals` for what can be said here",
    ),
)
