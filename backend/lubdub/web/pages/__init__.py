"""The family's pages: one module for each step of the journey, and what the pages share."""
