"""Builds everything in this folder's parent anew: `PYTHONPATH=backend python -m references.make`."""

from __future__ import annotations

import argparse
from pathlib import Path

from references.make.basis import build_basis
from references.make.body import Workshop
from references.make.demos import write_demos
from references.make.wheel import REPOSITORY
from references.make.write import write_basis, write_bodies, write_manifest, write_topology


def main() -> None:
    """Reads the command line and builds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=REPOSITORY / "references", help="where to write")
    out: Path = parser.parse_args().out
    workshop = Workshop()
    print("bodies")
    write_bodies(workshop, out)
    print("demo scans")
    write_demos(workshop, out)
    print("basis, a few minutes")
    shared = {"topology.npz": write_topology(workshop, out), "basis.npz": write_basis(build_basis(workshop), out)}
    write_manifest(shared, out)


if __name__ == "__main__":
    main()
