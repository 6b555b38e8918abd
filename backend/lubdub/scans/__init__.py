"""(1) From a file to a clean chest surface in millimetres, in the body frame."""
