"""The daemon as a service of systemd: that it serves, that it lives, and what it tells the journal.

Nothing here needs systemd: where nobody asks to be told, nobody is.
"""
