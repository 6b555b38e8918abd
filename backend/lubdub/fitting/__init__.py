"""(4) Bending a body onto a scan: shape-basis fit and non-rigid ICP."""
