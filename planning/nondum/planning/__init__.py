"""Strangers' planning knowledge becomes one domain, and a goal becomes a tree. Pure."""
