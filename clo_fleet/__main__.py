"""``python -m clo_fleet`` is the command ``clo-fleet``."""

import sys

from clo_fleet.cli import main

if __name__ == "__main__":
    sys.exit(main())
