"""Phrases: goals in words, and the words that the host itself understands."""
