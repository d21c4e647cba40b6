"""Strangers' planning knowledge becomes one domain, and a goal becomes a tree.

Pure: values in, values out, no clock and no input or output. The way of a goal: fragments are
checked (`claims`) and merged (`merge`), words become a condition (`phrases`, `goal`), facts and
actions a ground task (`ground`), a planner's plan is checked (`validate`) and run (`task_tree`,
`world`), and what has no plan is explained (`explain`).

Nothing is re-exported here: several modules are named after the one function that they offer, and
each is imported by itself: `from nondum.planning.merge.merge import merge`.
"""
