"""A payload as a whole: read from its drive, held together, and whether it fits this host."""
