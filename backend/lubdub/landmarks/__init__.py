"""(2) The points a person can see or feel: suggested, checked, named."""
