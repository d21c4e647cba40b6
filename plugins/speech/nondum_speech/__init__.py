"""Hears goals and says sentences, offline: PocketSphinx and eSpeak NG."""
