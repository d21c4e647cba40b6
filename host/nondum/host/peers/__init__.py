"""Other hosts: what is shared with them, and what is done for them."""
