"""Builds nondum's Debian package from a checkout, for any architecture on any machine."""
