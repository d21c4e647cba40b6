"""Fragments and objects of components merged into one domain and problem."""
