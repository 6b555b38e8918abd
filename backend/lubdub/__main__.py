"""`python -m lubdub`: the command line."""

import sys

try:
    from lubdub.cli import main

    code = main(sys.argv[1:])
except KeyboardInterrupt:  # while this very package was being loaded
    code = 130
sys.exit(code)
