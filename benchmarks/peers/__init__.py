"""Hosts that find, lose and call each other: how long it takes."""
