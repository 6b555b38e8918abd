"""What the numbers in the README come from: `./lubdub benchmark demo` and `./lubdub benchmark cohort`."""
