"""Lamps and tones that show the state of a nondum host: an extension of the host."""
