"""A plugin of the version before: a stream, a behaviour, a fact, a phrase and a setting."""
