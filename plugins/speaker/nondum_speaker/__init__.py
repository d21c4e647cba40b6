"""Says things: aloud where it can, in print where it cannot."""
