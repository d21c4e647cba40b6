"""Why an environment cannot be made."""

from __future__ import annotations


class SetUpFailed(Exception):
    """Says in words what is wrong, and what to do."""

    status = 1
    """What the command ends with."""


class DoesNotFit(SetUpFailed):
    """What is installed does not fit together: `./run` makes the environment again, once."""

    status = 3
