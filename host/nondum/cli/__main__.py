"""`python -P -m nondum.cli` is `nondum`."""

from nondum.cli.main import main

main()
