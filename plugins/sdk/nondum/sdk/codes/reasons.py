"""Codes of the reasons why there is no plan: told together, and what would help is told once."""

from nondum.sdk.codes.code import Code

AREA = "Why there is no plan"
CODES = (
    Code(
        "WHY_CIRCLE",
        "What is needed needs itself.",
        "plug in a payload that supplies it in another way: see `nondum advise`",
        is_told=False,
    ),
    Code(
        "WHY_EXCLUDED",
        "What is needed is excluded by something that is so.",
        "change what excludes it, or ask for something else",
        is_told=False,
    ),
    Code(
        "WHY_EXCLUDE_EACH_OTHER",
        "Two things that are needed exclude each other.",
        "ask for one after the other",
        is_told=False,
    ),
    Code(
        "WHY_NEVER_FALSE",
        "What would have to end never ends.",
        "ask for something else, or pull what keeps it so",
        is_told=False,
    ),
    Code(
        "WHY_NOT_ALONE",
        "All is there, but something else that is needed is in the way.",
        "ask for one after the other",
        is_told=False,
    ),
    Code(
        "WHY_NOT_SO",
        "What is needed is not so, and nothing here makes it so.",
        "plug in a payload that can: see `nondum advise`; or make it so by hand",
        is_told=False,
    ),
    Code(
        "WHY_NOT_TOLD",
        "Something here could tell what is needed, and does not: its condition has ended with an "
        "error, its worker is not ready, its device is not there, or it has not seen it yet.",
        "see `nondum components` and `nondum logs`; plug in the device, or the payload again",
        is_told=False,
    ),
    Code(
        "WHY_NOT_TOGETHER",
        "All is there, but not at the same time.",
        "ask for one after the other",
        is_told=False,
    ),
    Code(
        "WHY_NO_ACTION",
        "Nothing here can do what is needed.",
        "plug in a payload that can: `nondum advise` names those that are known",
        is_told=False,
    ),
    Code(
        "WHY_NO_OBJECT",
        "There is nothing of the kind that is needed.",
        "plug in a device or payload that brings one: `nondum advise` names those that are known",
        is_told=False,
    ),
    Code(
        "WHY_NO_VALUE",
        "A value that is needed is not known.",
        "plug in what tells it: `nondum advise` names those that are known",
        is_told=False,
    ),
    Code(
        "WHY_SUPPLIER",
        "A payload that was here before used to supply it.",
        "plug that payload in again",
        is_told=False,
    ),
    Code(
        "WHY_WORDS_GONE",
        "The words of a goal mean nothing without a payload that is gone.",
        "plug that payload in again",
        is_told=False,
    ),
)
