"""Child processes that do what may block, hang or choke on hostile bytes, and their queues."""
