"""The command ``hyd``, also as ``python -m hyd``."""

import sys

from . import _hyd


def main() -> int:
    """Run the command with the arguments of the process; gives its exit code."""
    sys.stdout.flush()
    return _hyd.main(["hyd", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
