"""Whose payloads this host runs."""
