"""`python -m lubdub`: the command line."""

import sys

from lubdub.cli import main

sys.exit(main(sys.argv[1:]))
