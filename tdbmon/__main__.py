"""``python -m tdbmon``."""

from tdbmon.cli import main

main()
