"""Payloads and plugin packages made on an author's machine."""
