"""Codes of refusals: goals and plans."""

from nondum.sdk.codes.code import Code

AREA = "Goals and plans"
CODES = (
    Code(
        "GOAL_FORM",
        "A goal is given neither in words nor in PDDL.",
        "say what is wanted: `nondum goal WORDS`, or --pddl",
    ),
    Code(
        "GOAL_FILE",
        "The goal.txt of a payload is empty, too long, or not plain text.",
        "write a goal a line, in words: up to eight lines of 200 characters",
    ),
    Code(
        "GOAL_NOT_HALTED",
        "The goal cannot be resumed: it is not halted, or its payload gives it again by itself.",
        "see `nondum goals` for those that can be",
    ),
    Code(
        "GOAL_TOO_EARLY",
        "The host does not know itself yet.",
        "ask again in a second",
    ),
    Code(
        "GOAL_UNKNOWN",
        "There is no goal of that number.",
        "see `nondum goals` for those there are",
    ),
    Code(
        "GOAL_UNSIGNED",
        "A goal.txt lies on a drive where no signature covers it.",
        "put it into a payload: `nondum payload goal WORDS -o DRIVE --sign KEY`",
    ),
    Code(
        "NO_ANSWER",
        "It is not known whether there is a plan: time ran out.",
        "ask again with a longer planning.deadline_s, or for less",
    ),
    Code(
        "NO_OTHER_WAY",
        "There is no way without what failed again and again.",
        "it is tried again after a while; see `nondum why` for what failed",
    ),
    Code(
        "PLANNER_ANSWER",
        "A planner gave something that is no answer.",
        "others plan meanwhile: tell its author, or uninstall it (pip)",
    ),
    Code(
        "PLANNER_DIED",
        "A planner ended without an answer.",
        "it is started again; if it happens often, uninstall it (pip)",
    ),
    Code(
        "PLANNER_RAISED",
        "A planner ended with an error.",
        "others plan meanwhile: tell its author, or uninstall it (pip)",
    ),
    Code(
        "PLANNER_START",
        "A planner does not start.",
        "`nondum pddl plan --planner NAME` tries it; without it, others plan: pip can uninstall it",
    ),
    Code(
        "PLANNING_FAULT",
        "Planning itself failed.",
        "see the daemon's log, and report it with the goal",
    ),
    Code(
        "PLAN_COST",
        "A planner tells another cost than its steps have.",
        "nothing: the plan is used; tell the planner's author",
    ),
    Code(
        "PLAN_CUT_SHORT",
        "One lasting behaviour would end another whose effect is still needed.",
        "nothing: another plan is looked for; tell the plugins' authors if there is none",
    ),
    Code(
        "PLAN_GOAL_MISSED",
        "A planner's plan does not reach the goal.",
        "nothing: it is not used; tell the planner's author",
    ),
    Code(
        "PLAN_STEP_IMPOSSIBLE",
        "A step of a planner's plan is not possible.",
        "nothing: it is not used; tell the planner's author",
    ),
    Code(
        "PLAN_STEP_UNKNOWN",
        "A planner's plan has a step that no component offers.",
        "nothing: it is not used; tell the planner's author",
    ),
    Code(
        "PLAN_STUCK",
        "A plan is under way, and none of its steps can begin.",
        "see `nondum why`; give the goal again",
    ),
    Code(
        "TRANSLATION_AMBIGUOUS",
        "The words can mean several things.",
        "say it in other words, or give the goal with --pddl",
    ),
    Code(
        "TRANSLATION_FAILED",
        "The language plugin, or the host that it runs on, could not translate the words.",
        "say it in words that are listed by `nondum goals`; the message tells what to mend",
    ),
    Code(
        "TRANSLATION_INVALID",
        "What the language plugin made of the words is no goal.",
        "say it in other words, or give the goal with --pddl",
    ),
    Code(
        "TRANSLATION_OVERDUE",
        "The language plugin did not answer in time.",
        "say it in words that are listed by `nondum goals`, or try again",
    ),
    Code(
        "TRANSLATION_REFUSED",
        "The words were understood, but mean nothing here.",
        "plug in what is needed for it; see `nondum goals` for what can be asked",
    ),
    Code(
        "TRANSLATION_UNCONFIRMED",
        "No one confirmed that the words were understood rightly.",
        "give --yes to take it so, or the goal with --pddl",
    ),
    Code(
        "WHOSE_GOAL",
        "Several robots could do that.",
        "say which one, as the message shows",
    ),
)
