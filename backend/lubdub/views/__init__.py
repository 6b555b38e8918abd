"""3D views of a scan and its result. The only room that knows viser."""
