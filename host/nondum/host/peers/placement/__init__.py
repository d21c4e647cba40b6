"""Payloads that run on another host than the one that they are plugged into."""
