"""What may be wrong around a host: looked at without a daemon, one module a concern.

Each module has pure functions, which judge what was seen, and one `examine`, which looks and yields
findings; it raises nothing.
"""
