"""The daemon as a service of systemd: that it serves, that it lives, and what it tells the journal.

Nothing here needs systemd: without a service manager that asks for messages, none are sent.
"""
