"""Makes the parts of a running host and ties them together, one module a part; see `app.py`."""
