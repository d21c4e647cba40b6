"""The host's end of worker links, and how much may pass."""
