"""The line drawing of a chest for the pages: one reference body's outline and places, seen from the front.

    python -m references.make.drawing

writes `frontend/parts/drawings/body.json`: lines and points in the drawing's own frame (200 wide, y downwards).
"""

from __future__ import annotations

import json

import numpy as np
from PIL import Image, ImageDraw

from lubdub.library.load import load_library
from lubdub.settings import PROJECT_FOLDER

BODY = "boy-08"
TARGET = PROJECT_FOLDER / "frontend" / "parts" / "drawings" / "body.json"
SCALE = 0.5
MIDDLE, NOTCH = 100.0, 52.0
"""Where the notch lies in the drawing."""
PIXELS_PER_MM = 2
TOLERANCE = 0.5
"""How far, in drawing units, a straight piece may leave the true outline."""
NECK_CUT, ARM_CUT, ARMPIT, HIP_CUT = 25.0, 119.0, 133.0, 228.0
"""Heights on the paper where this body's skin was cut off or the arm leaves the trunk: no line is drawn there."""


def on_paper(points: np.ndarray) -> np.ndarray:
    """(..., 2) drawing coordinates of places (..., 3) in the body frame: patient's left is on the right."""
    return np.stack([MIDDLE + SCALE * points[..., 0], NOTCH - SCALE * points[..., 1]], axis=-1)


def silhouette(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(k, 2) the closed outline of the body's shadow, in drawing coordinates."""
    factor = PIXELS_PER_MM / SCALE
    flat = on_paper(vertices) * factor
    picture = Image.new("1", (int(200 * factor), int(260 * factor)))
    draw = ImageDraw.Draw(picture)
    for corners in flat[triangles]:
        draw.polygon([tuple(corner) for corner in corners], fill=1)
    return walked(np.pad(np.asarray(picture), 1)) / factor


def walked(shadow: np.ndarray) -> np.ndarray:
    """(k, 2) x, y of the rim of a picture's one shape, walked around with the shape on the right hand."""
    start = tuple(int(i) for i in np.argwhere(shadow)[0])
    turns = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    here, facing, rim = start, 0, [start]
    while True:
        for step in range(8):
            turn = (facing + 6 + step) % 8
            there = (here[0] + turns[turn][0], here[1] + turns[turn][1])
            if shadow[there]:
                here, facing = there, turn
                break
        if here == start:
            return np.array(rim, float)[:, ::-1]
        rim.append(here)


def lines_of(rim: np.ndarray) -> list[np.ndarray]:
    """The rim without the cuts: shoulder and flank on one side, and the same mirrored."""
    side = rim[rim[:, 0] >= MIDDLE]
    cut_arm = int((side[:, 1] >= ARM_CUT).argmax())
    shoulder = side[:cut_arm][side[:cut_arm, 1] >= NECK_CUT]
    below = side[cut_arm:]
    flank = below[(below[:, 1] >= ARMPIT) & (below[:, 1] <= HIP_CUT)]
    drawn = [simplified(shoulder), simplified(flank)]
    return [*drawn, *(line * [-1.0, 1.0] + [2 * MIDDLE, 0.0] for line in drawn)]


def simplified(line: np.ndarray) -> np.ndarray:
    """The line with as few corners as TOLERANCE allows (Ramer 1972, Douglas and Peucker 1973)."""
    first, last = line[0], line[-1]
    along = last - first
    length = np.linalg.norm(along)
    offset = line - first
    distance = np.linalg.norm(offset, axis=1)
    if length > 0:
        distance = np.abs(along[0] * offset[:, 1] - along[1] * offset[:, 0]) / length
    worst = int(distance.argmax())
    if distance[worst] <= TOLERANCE:
        return np.stack([first, last])
    return np.concatenate([simplified(line[: worst + 1])[:-1], simplified(line[worst:])])


def smooth_path(corners: np.ndarray) -> str:
    """An SVG path through the corners (Catmull and Rom 1974, as cubic pieces)."""
    before = np.concatenate([corners[:1], corners[:-1]])
    after = np.concatenate([corners[1:], corners[-1:]])
    slope = (after - before) / 6
    pieces = [f"M{corners[0, 0]:.1f} {corners[0, 1]:.1f}"]
    for k in range(len(corners) - 1):
        controls = (corners[k] + slope[k], corners[k + 1] - slope[k + 1], corners[k + 1])
        pieces.append("C" + " ".join(f"{x:.1f} {y:.1f}" for x, y in controls))
    return "".join(pieces)


def main() -> None:
    """Write the drawing."""
    body = next(one for one in load_library().references if one.id == BODY)
    rim = silhouette(body.surface.vertices, body.surface.triangles)
    drawing = {
        "body": BODY,
        "lines": [smooth_path(line) for line in lines_of(rim)],
        "landmarks": {name: on_paper(place).round(1).tolist() for name, place in body.landmarks.items()},
        "areas": {name: on_paper(place).round(1).tolist() for name, place in body.areas.items()},
    }
    TARGET.write_text(json.dumps(drawing, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
