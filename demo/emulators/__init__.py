"""Instruments that are not there: programs that speak only bytes on pseudo-terminals."""
