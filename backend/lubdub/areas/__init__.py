"""(5) From a fitted body and bone points to the four listening areas, their regions and their words."""
