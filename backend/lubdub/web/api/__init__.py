"""REST and FHIR, for portals."""
