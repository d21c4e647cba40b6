"""The store of verified wheels, and the venvs made of it."""
