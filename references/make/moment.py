"""The moment of a scan: how much breath is in the chest, how the person lies on the bed, how far its head end is up.

Whatever moves skin moves bones and areas by the same rule: chest and ribs go together, the trunk is bent at the
hips only. Lengths in mm, body frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from references.make.fields import along_body, front_share, smoothstep
from references.make.torso import Torso

RIBS_GO_UP = 0.5
"""Of the breath's rise: the ribs of the third to fifth space go 3-5 mm headwards and forwards, 1-2 mm sideways."""
RIBS_GO_OUT = 0.25
BREATH_LEVELS = (0.6, 0.0, -1.0, -1.7, -2.6, -3.2)
"""In sternum lengths above the notch; and the share of the full rise there: ribs turn about their joints behind."""
BREATH_SHARES = (0.0, 0.5, 1.0, 1.0, 0.6, 0.0)
HINGE_BELOW_NOTCH, HINGE_REACH = 3.3, 0.5
"""Where a raised head end bends the body, and over how much to either side, in sternum lengths: at the hips."""


@dataclass(frozen=True)
class MomentSpread:
    """How moments differ. A pair is the range of an even draw, a single number one standard deviation."""

    breath_mm: tuple[float, float] = (-4.0, 6.0)
    """The chest's rise against a breath let out quietly, for an adult."""
    roll_deg: float = 3.0
    pitch_deg: float = 2.0
    raised_share: float = 0.25
    """Of the people lie with the head end of the bed raised,"""
    raised_deg: tuple[float, float] = (0.0, 20.0)
    """by so much."""


@dataclass(frozen=True)
class Moment:
    """breath_mm: rise of the chest; roll_deg: left side up; pitch_deg: head up; raised_deg: the bed's head end."""

    breath_mm: float = 0.0
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    raised_deg: float = 0.0


def draw_moment(random: np.random.Generator, size: float, spread: MomentSpread | None = None) -> Moment:
    """A moment of a person of this size (breastbone as a share of an adult's)."""
    spread = spread or MomentSpread()
    breath = size * random.uniform(*spread.breath_mm)
    roll, pitch = random.normal(size=2) * [spread.roll_deg, spread.pitch_deg]
    raised = random.uniform(*spread.raised_deg) if random.random() < spread.raised_share else 0.0
    return Moment(float(breath), float(roll), float(pitch), float(raised))


def breathe(torso: Torso, whole: np.ndarray, sternum_mm: float, breath_mm: float) -> np.ndarray:
    """(19158, 3) the body with so much more breath. The notch is at the origin."""
    vertices = whole[torso.indices]
    front = front_share(vertices, torso.triangles) * torso.trunk
    levels = [level * sternum_mm for level in BREATH_LEVELS]
    rise = breath_mm * front * along_body(vertices[:, 1], levels, BREATH_SHARES)
    sideways = RIBS_GO_OUT * np.clip(vertices[:, 0] / sternum_mm, -1.0, 1.0)
    moved = whole.copy()
    moved[torso.indices] += rise[:, None] * np.column_stack(
        [sideways, np.full_like(rise, RIBS_GO_UP), np.ones_like(rise)]
    )
    return moved


def tilted(points: np.ndarray, moment: Moment) -> np.ndarray:
    """Points (..., 3) of a body that lies a little on its side and with its shoulders a little up."""
    turn = Rotation.from_euler("yx", [-moment.roll_deg, moment.pitch_deg], degrees=True).as_matrix()
    return np.asarray(points @ turn.T)


@dataclass(frozen=True)
class RaisedBed:
    """A bed whose head end is raised, with whoever lies on it: everything is bent about the mattress at the hips.

    level: z of the mattress; hinge: y of the bend; reach: over how much of y to either side it happens.
    """

    level: float
    hinge: float
    reach: float
    degrees: float

    def bent(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) on the raised bed; lengths along the mattress stay what they were."""
        along = np.linspace(-1.0, 1.0, 201) * self.reach + self.hinge
        angle = np.deg2rad(self.degrees) * smoothstep(along, along[0], along[-1])
        step = along[1] - along[0]
        forward = along[0] + np.concatenate([[0.0], np.cumsum(np.cos((angle[1:] + angle[:-1]) / 2) * step)])
        up = self.level + np.concatenate([[0.0], np.cumsum(np.sin((angle[1:] + angle[:-1]) / 2) * step)])
        y, above = points[..., 1], points[..., 2] - self.level
        here = np.deg2rad(self.degrees) * smoothstep(y, along[0], along[-1])
        beyond = np.clip(y - along[-1], 0.0, None)
        before = np.clip(y - along[0], None, 0.0)
        new_y = np.interp(y, along, forward) + before + beyond * np.cos(here) - above * np.sin(here)
        new_z = np.interp(y, along, up) + beyond * np.sin(here) + above * np.cos(here)
        return np.stack([points[..., 0], new_y, new_z], axis=-1)


def raised_bed(level: float, sternum_mm: float, degrees: float) -> RaisedBed:
    """The bed under a person with this breastbone."""
    return RaisedBed(level, -HINGE_BELOW_NOTCH * sternum_mm, HINGE_REACH * sternum_mm, degrees)
