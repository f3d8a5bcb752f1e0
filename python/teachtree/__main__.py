"""The command line program: ``teachtree …`` and ``python -m teachtree …``."""

import sys

from . import _teachtree


def main() -> int:
    """Runs the command line of this process; the exit status."""
    return _teachtree.command_line(["teachtree", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
