"""A row of a table that people's tools are shown."""

from __future__ import annotations

from typing import Any, TypeAlias

Row: TypeAlias = dict[str, Any]
"""One row of a table: plain data for tools."""
