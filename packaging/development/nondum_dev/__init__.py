"""The environments in which nondum is developed and tested: what others wrote comes from a lock."""
