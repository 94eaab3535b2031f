"""Entry point of `python -m aeros`, which is the same as `aeros`."""

import sys

from aeros.cli.main import main

sys.exit(main())
