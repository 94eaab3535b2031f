"""`python -m aeros` is `aeros`."""

import sys

from aeros.cli.main import main

sys.exit(main())
