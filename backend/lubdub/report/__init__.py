"""(8) What leaves: picture, archive, and later sheet and FHIR."""
