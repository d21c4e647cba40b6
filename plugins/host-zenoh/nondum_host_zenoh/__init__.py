"""Fleets by way of a Zenoh router, as an extension of nondum's host."""
