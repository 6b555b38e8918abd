"""Learns from simulated scans what the skin around a navel and a nipple looks like: `lubdub.landmarks.signs`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import minimize

from lubdub.geometry.signs import Sign, Signs
from lubdub.landmarks.places import NAVEL, NIPPLE, Prior, look
from lubdub.landmarks.relief import BLUR, CELL, Skin, grain
from lubdub.landmarks.signs import PATCH_CELLS, PATCH_STEP, answers, graininess, levelled
from references.make.sightings import Sighting

NAVEL_SIDES = ((0, 1.0), (0, -1.0))
NIPPLE_SIDES = ((1, 1.0), (2, -1.0))
"""Which mark, and which way is outwards: a navel is seen as it is and in a mirror, the right nipple in a mirror."""


@dataclass(frozen=True)
class LearningSettings:
    """How much is learned from how many looks. Lengths as in `lubdub.landmarks.relief`."""

    seed: int = 7
    looks: int = 2
    """Windows on each mark of a scan, each placed anew."""
    roughness: tuple[float, float] = (0.0002, 0.008)
    """Noise that is added to a map, least and most: signs that vanish in it are not to be trusted."""
    size_error: float = 0.06
    """How wrong a fitted body's size is, one standard deviation."""
    elsewhere: int = 4
    """Patches of other skin for each of the landmark's."""
    filters: int = 16
    ground: float = 1e-5
    """Variance of what is nobody's shape, in every height of a patch."""
    stiffness: float = 3.0
    """Of the weights, against learning the few people by heart."""
    every: int = 2
    """Only every second cell is a place while learning."""
    near: float = 0.02
    """A place so far from the truth is nearly as right."""
    unlikely: float = -6.0
    """Places whose prior has a smaller logarithm, against the likeliest, are left out."""
    rounds: int = 120


@dataclass(frozen=True)
class Look:
    """A map (rows, columns) and where in it the landmark lies: (2,) outwards and up from the middle."""

    heights: np.ndarray
    truth: np.ndarray


def learn_signs(seen: Sequence[Sighting], settings: LearningSettings | None = None) -> Signs:
    """Of the navel and of a nipple."""
    settings = settings or LearningSettings()
    return Signs(
        learn_sign(looks(seen, NAVEL, NAVEL_SIDES, settings), NAVEL, settings),
        learn_sign(looks(seen, NIPPLE, NIPPLE_SIDES, settings), NIPPLE, settings),
    )


def looks(
    seen: Sequence[Sighting], prior: Prior, sides: Sequence[tuple[int, float]], settings: LearningSettings
) -> list[Look]:
    """Windows placed as wrongly as a fitted body places them."""
    random = np.random.default_rng(settings.seed)
    found = []
    for one in seen:
        for mark, side in sides:
            for _ in range(settings.looks):
                skin = Skin(one.points, one.normals, one.sternum_mm * np.exp(settings.size_error * random.normal()))
                off = np.clip(random.normal(size=2), -2.5, 2.5) * prior.spread + prior.shift
                fitted = one.marks[mark] - skin.size * np.array([side * off[0], off[1], 0.0])
                window, heights = look(skin, fitted, prior, side)
                heights = heights + _roughness(heights.shape, random, settings)
                truth = window.seen(one.marks[mark])[:2]
                if (np.abs(truth) < CELL * np.array(prior.search)).all():
                    found.append(Look(heights, truth))
    return found


def _roughness(shape: tuple[int, ...], random: np.random.Generator, settings: LearningSettings) -> np.ndarray:
    """More noise of two coarsenesses, mostly little."""
    rough = np.zeros(shape)
    for coarseness in (1.0, 2.0):
        blurred = gaussian_filter(random.normal(size=shape), coarseness * BLUR / CELL)
        rough += blurred / blurred.std() * np.exp(random.uniform(*np.log(settings.roughness)))
    return rough


def learn_sign(seen: Sequence[Look], prior: Prior, settings: LearningSettings) -> Sign:
    """Filters that tell the landmark's skin from other skin, and what each answer weighs."""
    filters, usual = _filters(seen, prior, settings)
    count = filters.shape[1]
    blank = Sign(filters, usual, np.zeros((2, count + count * (count + 1) // 2)))
    return Sign(filters, usual, _weights(seen, prior, blank, settings))


def _filters(seen: Sequence[Look], prior: Prior, settings: LearningSettings) -> tuple[np.ndarray, np.ndarray]:
    """(225, k) filters with answers of spread 1, and their mean answers (k,).

    One that tells best if all skin varied alike; those along which the landmark's skin varies most unlike other
    skin; and the principal parts of all of it.
    """
    random, level = np.random.default_rng(settings.seed), levelled()
    there = np.array([_patch(one, one.truth) for one in seen]) @ level
    other = np.array([_patch(one, _beside(one, prior, random)) for one in seen for _ in range(settings.elsewhere)])
    other = other @ level
    both = [np.cov(one.T) for one in (there, other)]
    gap = (there.mean(0) - other.mean(0))[:, None]
    ground = settings.ground * np.eye(len(gap))
    ratios, unlike = eigh(both[0] + gap @ gap.T + ground, both[1] + ground)
    half = settings.filters // 2
    unlike = unlike[:, np.argsort(-np.abs(np.log(ratios)))[:half]]
    principal = np.linalg.eigh(sum(both))[1][:, ::-1][:, : settings.filters - half - 1]
    best = np.linalg.solve(sum(both) + 2 * ground, gap)
    found = np.linalg.qr(np.concatenate([best, unlike, principal], axis=1))[0]
    replies = np.concatenate([there, other]) @ found
    return level @ found / replies.std(0), replies.mean(0) / replies.std(0)


def _patch(look: Look, place: np.ndarray) -> np.ndarray:
    """(225,) the patch around any place, between cells."""
    steps = PATCH_STEP * np.arange(-PATCH_CELLS, PATCH_CELLS + 1)
    middle = (np.array(look.heights.shape)[::-1] - 1) / 2 + place / CELL
    column, row = np.meshgrid(steps + middle[0], steps + middle[1])
    return map_coordinates(look.heights, [row.ravel(), column.ravel()], order=1, mode="nearest")


def _beside(look: Look, prior: Prior, random: np.random.Generator) -> np.ndarray:
    limit = CELL * np.array(prior.search)
    while True:
        place = look.truth + random.normal(size=2) * prior.spread
        if (np.abs(place) < limit).all() and np.linalg.norm(place - look.truth) > 2.5 * CELL:
            return place


def _weights(seen: Sequence[Look], prior: Prior, blank: Sign, settings: LearningSettings) -> np.ndarray:
    """(2, f) that make the posterior of the true places largest."""
    logs, places = _log_prior(prior, settings)
    found, target = [], []
    for one in seen:
        found.append(answers(blank, one.heights, settings.every)[logs > settings.unlikely].astype(np.float32))
        nearness = np.exp(-0.5 * ((places - one.truth) ** 2).sum(1) / settings.near**2)[logs > settings.unlikely]
        target.append(nearness / max(nearness.sum(), 1e-6))
    coarse = np.array([graininess(grain(one.heights)) for one in seen])
    answered, truth, prior_logs = np.array(found), np.array(target), logs[logs > settings.unlikely]
    scale = answered.reshape(-1, answered.shape[2]).std(0)
    answered /= scale
    mix = np.stack([1 - coarse, coarse])

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        weights = flat.reshape(2, -1)
        own = (mix.T @ weights).astype(np.float32)
        scores = (answered @ own[:, :, None])[:, :, 0] + prior_logs
        scores -= scores.max(axis=1, keepdims=True)
        total = np.exp(scores).sum(axis=1, keepdims=True)
        wrong = (np.exp(scores) / total - truth).astype(np.float32)
        slopes = (wrong[:, None, :] @ answered)[:, 0, :]
        value = -(truth * (scores - np.log(total))).sum() + 0.5 * settings.stiffness * (flat**2).sum()
        return float(value), (mix @ slopes + settings.stiffness * weights).ravel()

    start = np.zeros(blank.weights.size)
    best = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": settings.rounds})
    return best.x.reshape(2, -1) / scale


def _log_prior(prior: Prior, settings: LearningSettings) -> tuple[np.ndarray, np.ndarray]:
    """(places,) logarithm of the prior, and (places, 2) outwards and up, as `answers` orders them."""
    outwards, up = (CELL * np.arange(-cells, cells + 1)[:: settings.every] for cells in prior.search)
    across, along = (axis.ravel() for axis in np.meshgrid(outwards, up))
    logs = -0.5 * ((across / prior.spread[0]) ** 2 + (along / prior.spread[1]) ** 2)
    return logs, np.stack([across, along], axis=1)
