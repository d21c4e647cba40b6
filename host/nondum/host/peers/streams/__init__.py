"""Streams between hosts: a process that carries them, and what the daemon does with it."""
