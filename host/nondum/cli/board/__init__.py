"""`nondum doctor --board`: what a machine is, in a form to paste into an issue.

Nothing in it names the machine or its people: no host name, serial number, address or key.
"""
