"""Codes of refusals: fragments and phrases."""

from nondum.sdk.codes.code import Code

AREA = "Fragments and phrases"
CODES = (
    Code(
        "E-ACTOR",
        "The first parameter of an action is not a unit.",
        "begin with the unit that acts, as in (point ?u - pointer …)",
    ),
    Code(
        "E-BEHAVIOUR",
        "A behaviour and its action do not agree.",
        "give both the same name and parameters",
    ),
    Code(
        "E-DERIVED",
        "A rule's predicate is written by something else, or depends on its own negation.",
        "write what the rule follows from instead",
    ),
    Code(
        "E-DOMAIN",
        "A problem names another domain than the one it is given with.",
        "correct the name",
    ),
    Code(
        "E-FACT-CONFLICT",
        "Two components tell different values of one thing; the newest is believed.",
        "look which of the two is wrong: `nondum facts --why`",
    ),
    Code(
        "E-GOAL",
        "A goal stands where none may, or is missing where one must be.",
        "people give goals: leave it out of fragments; a problem that stands alone has one",
    ),
    Code(
        "E-INIT",
        "Something in :init is no fact.",
        "give facts only",
    ),
    Code(
        "E-INSTANCE",
        "An action names a unit of its own instead of a parameter.",
        "use a parameter, so that it serves every unit of that type",
    ),
    Code(
        "E-KIND",
        "A domain where a problem is expected, or the other way round.",
        "give the files in the other order",
    ),
    Code(
        "E-MISPLACED",
        "A condition stands where an effect belongs, or the other way round.",
        "move it to where it belongs",
    ),
    Code(
        "E-OBJ-TYPE",
        "An object is declared with types that exclude each other.",
        "use the type of the other declaration, or another name",
    ),
    Code(
        "E-OWNED",
        "A fragment writes what is the host's, or another component's.",
        "leave it out: only its owner may write it",
    ),
    Code(
        "E-PRED-ARITY",
        "A predicate is used with another number of arguments than it has.",
        "give it as many as its declaration has",
    ),
    Code(
        "E-PRED-TYPE",
        "A predicate is declared with types that exclude each other.",
        "use the types of the other declaration, or another name",
    ),
    Code(
        "E-SYNTAX",
        "The text is not PDDL.",
        "correct the place that is shown; what was expected there is said",
    ),
    Code(
        "E-TWICE",
        "A section, action, variable or declaration stands there twice.",
        "leave one of them out",
    ),
    Code(
        "E-TYPE",
        "An argument cannot be of the type that is asked for.",
        "use an object of that type, or correct the declaration",
    ),
    Code(
        "E-TYPE-CYCLE",
        "Types are under one another in a circle.",
        "take one of the parents away",
    ),
    Code(
        "E-TYPE-PARENT",
        "A type is declared under parents that exclude each other.",
        "use the parent of the other declaration, or another name",
    ),
    Code(
        "E-UNDECL",
        "A type, predicate, object or variable that nobody declares.",
        "declare it, or correct its spelling",
    ),
    Code(
        "E-UNSUPPORTED",
        "PDDL that is not handled.",
        "say it in other words: docs/fragments.md tells what is handled",
    ),
    Code(
        "E-VERSION",
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
