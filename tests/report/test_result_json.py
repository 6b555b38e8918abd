import io
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface
from lubdub.report.archive import outcome_from_bytes, outcome_to_bytes
from lubdub.report.result_json import result_json
from lubdub.results import Area, CleanScan, Landmark, Outcome, Quality, RankedReference, Reason, Unit

BODY_FROM_FILE = Similarity(1000.0, Rotation.from_euler("xyz", [20, 40, 60], degrees=True).as_matrix(), np.ones(3))
SCAN = CleanScan(
    np.eye(3),
    np.eye(3),
    np.zeros(3, bool),
    lambda: Surface(np.eye(3), np.array([[0, 1, 2]])),
    BODY_FROM_FILE,
    Unit("m", 1000.0, "found"),
    ("removed a flat bed",),
)
OUTCOME = Outcome(
    verdict="show_with_care",
    reasons=(Reason("age_missing", "why", "what"),),
    areas={"aortic": Area(np.array([-25.0, -60.0, 12.0]), np.array([0.0, 0.0, 1.0]), 14.04, "there")},
    landmarks={"navel": Landmark(np.array([0.0, -360.0, 0.0]), "given", 5.0)},
    scan=SCAN,
    fit=None,
    references=(RankedReference("man-30", 3.14159, 1.0),),
    selected="man-30",
    quality=Quality(1.2, None, 0.9, 4.0),
    timings_s={"total": 0.5},
    method={"version": "0"},
)


def test_positions_leave_in_the_files_own_coordinates() -> None:
    document = result_json(OUTCOME)
    in_body = BODY_FROM_FILE.apply(np.array(document["areas"]["aortic"]["position"]))
    assert in_body == pytest.approx([-25.0, -60.0, 12.0], abs=0.002)
    assert np.linalg.norm(document["areas"]["aortic"]["normal"]) == pytest.approx(1, abs=1e-5)


def test_a_refused_result_has_no_areas_at_all() -> None:
    assert "areas" not in result_json(replace(OUTCOME, verdict="refuse", areas={}))


def test_the_document_is_plain_json() -> None:
    document = result_json(OUTCOME)
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_an_outcome_survives_the_archive_unchanged() -> None:
    again = outcome_from_bytes(outcome_to_bytes(OUTCOME))
    assert result_json(again) == result_json(OUTCOME)


def test_an_archive_holds_the_skin_itself_under_the_name_that_older_archives_have() -> None:
    data = outcome_to_bytes(OUTCOME)
    with np.load(io.BytesIO(data)) as archive:
        fields = json.loads(archive["skeleton"].tobytes())["fields"]["scan"]["fields"]
    assert fields["display"]["$type"] == "Surface"
    assert "drape" not in fields
    np.testing.assert_array_equal(outcome_from_bytes(data).scan.display.vertices, SCAN.display.vertices)  # type: ignore[union-attr]


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 nonsense", b"\x80\x04."], ids=["empty", "broken zip", "pickle"])
def test_foreign_bytes_are_no_archive(data: bytes) -> None:
    with pytest.raises(ValueError, match="archive"):
        outcome_from_bytes(data)
