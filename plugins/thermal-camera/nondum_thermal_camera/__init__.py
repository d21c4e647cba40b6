"""A simulated thermal camera that pans with the body; a real one where it is plugged in."""
