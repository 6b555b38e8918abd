"""Builds everything in this folder's parent anew: `PYTHONPATH=backend python -m references.make`."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from references.make.basis import build_basis
from references.make.body import Workshop
from references.make.demos import write_demos
from references.make.people import PEOPLE
from references.make.picture import VIEWS, save_sheet, shade
from references.make.sightings import sightings
from references.make.signs import learn_signs
from references.make.wheel import REPOSITORY
from references.make.write import write_basis, write_bodies, write_manifest, write_signs, write_topology


def main() -> None:
    """Reads the command line and builds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=REPOSITORY / "references", help="where to write")
    parser.add_argument("--picture", type=Path, help="only draw the bodies as they would be built, to this PNG file")
    asked = parser.parse_args()
    workshop = Workshop()
    if asked.picture:
        _draw(workshop, asked.picture)
    else:
        _build(workshop, asked.out)


def _draw(workshop: Workshop, path: Path) -> None:
    pictures = []
    for person in PEOPLE:
        body = workshop.body(person.phenotype)
        points = np.concatenate([body.landmarks.positions, body.areas.positions])
        pictures += [shade(body.vertices, workshop.torso.triangles, points, view) for view in VIEWS]
    save_sheet(pictures, path)


def _build(workshop: Workshop, out: Path) -> None:
    print("bodies")
    write_bodies(workshop, out)
    print("demo scans")
    write_demos(workshop, out)
    print("basis, a few minutes")
    shared = {"topology.npz": write_topology(workshop, out), "basis.npz": write_basis(build_basis(workshop), out)}
    print("signs of navel and nipples, ten minutes")
    shared["signs.npz"] = write_signs(learn_signs(list(sightings(workshop))), out)
    write_manifest(shared, out)


if __name__ == "__main__":
    main()
