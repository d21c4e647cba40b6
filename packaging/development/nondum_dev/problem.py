"""Why an environment cannot be made."""

from __future__ import annotations


class SetUpFailed(Exception):
    """Says in words what is wrong, and what to do."""
