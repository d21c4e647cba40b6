"""`python -P -m nondum.host.cli` is `nondum`."""

from nondum.host.cli.main import main

main()
