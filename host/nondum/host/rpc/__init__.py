"""How the daemon asks its own processes: the messages of a worker link (`nondum.sdk.wire`).

A child does one request after the other (`channel.py`) and tells how far it is by events; it is
killed when its request is cancelled. The daemon's end is `child_link.py`. Requests and answers may
be longer than a packet: they travel in pieces. What a request is about, and its answer, are values
that the link does not look into (`outcomes.py`).
"""
