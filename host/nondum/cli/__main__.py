"""`python -P -m nondum.cli` is `nondum`."""

from nondum.cli import main

main()
