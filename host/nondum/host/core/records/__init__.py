"""What the catalogue holds, as frozen values: the only form in which it leaves the catalogue."""
