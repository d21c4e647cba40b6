"""The mind of a host: beliefs, goals, plans, and the tree that carries them out."""
