"""Names that codes had in the version before: `nondum explain` and old journals still know them."""

from __future__ import annotations

from collections.abc import Mapping

FORMER: Mapping[str, str] = {
    "E-ACTOR": "PDDL_ACTOR",
    "E-BEHAVIOUR": "PDDL_BEHAVIOUR",
    "E-DERIVED": "PDDL_DERIVED",
    "E-DOMAIN": "PDDL_DOMAIN",
    "E-FACT-CONFLICT": "PDDL_FACT_CONFLICT",
    "E-GOAL": "PDDL_GOAL",
    "E-INIT": "PDDL_INIT",
    "E-INSTANCE": "PDDL_INSTANCE",
    "E-KIND": "PDDL_KIND",
    "E-MISPLACED": "PDDL_MISPLACED",
    "E-OBJ-TYPE": "PDDL_OBJECT_TYPE",
    "E-OWNED": "PDDL_OWNED",
    "E-PRED-ARITY": "PDDL_ARITY",
    "E-PRED-TYPE": "PDDL_SIGNATURE",
    "E-SYNTAX": "PDDL_SYNTAX",
    "E-TWICE": "PDDL_TWICE",
    "E-TYPE": "PDDL_TYPE",
    "E-TYPE-CYCLE": "PDDL_TYPE_CYCLE",
    "E-TYPE-PARENT": "PDDL_TYPE_PARENT",
    "E-UNDECL": "PDDL_UNKNOWN",
    "E-UNSUPPORTED": "PDDL_UNSUPPORTED",
    "E-VERSION": "PDDL_VERSION",
    "GOAL_AMISS": "GOAL_FORM",
    "W-OWN-WORD": "PDDL_OWN_WORD",
}
"""Former name → name."""
