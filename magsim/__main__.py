"""``python -m magsim``: the command line."""

import sys

from magsim.cli import main

if __name__ == "__main__":
    sys.exit(main())
