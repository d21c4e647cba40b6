"""A simulated mobile base: a unicycle with limits, for robots without wheels."""
