"""Whose payloads may run: signatures, the trust file, and the judging of one by the other."""
