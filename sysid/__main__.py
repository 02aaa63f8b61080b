"""`python -m sysid`."""

from .cli import main

main()
