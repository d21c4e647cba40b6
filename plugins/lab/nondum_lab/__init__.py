"""`nondum lab`: a payload on a whole emulated computer."""
