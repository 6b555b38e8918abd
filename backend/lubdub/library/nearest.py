"""How like each reference a fitted body is: cheap, since both share one topology."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.rigid import best_rigid
from lubdub.geometry.surface import Surface
from lubdub.results import RankedReference, Reference


@dataclass(frozen=True)
class NearestSettings:
    """How references are compared with a fitted body."""

    weight_mm: float = 1.5
    """Chamfer distances differ by this much between good and middling references (measured on 40 bodies)."""
    vertex_step: int = 4
    """Every fourth vertex of the shared topology: the distance changes by less than 2 %."""
    most_compared: int = 48
    """Of a larger library only so many are compared, nearest in few numbers first. Among 2,400 drawn bodies the
    best of all was always one of them (`./lubdub benchmark selection`)."""
    few_numbers: int = 16
    """Principal directions in which the nearest are sought; more no longer change who is found."""
    learnt_from: int = 400
    """Bodies from which these directions are taken; the rest of a large library is only written in them."""


SETTINGS = NearestSettings()


def rank_by_shape(body: Surface, references: Sequence[Reference]) -> tuple[RankedReference, ...]:
    """The references by mean Chamfer distance to a fitted body, nearest first, size and all.

    body: (n, 3) in the references' topology and mm. Each reference is laid on it rigidly, vertex by vertex.
    Of a library beyond `SETTINGS.most_compared` only so many, the most alike in a few numbers, are in the answer.
    """
    picked = body.vertices[:: SETTINGS.vertex_step]
    if len(references) > SETTINGS.most_compared:
        references = [references[place] for place in index_of(references).nearest(picked, SETTINGS.most_compared)]
    tree = cKDTree(picked)
    distances = []
    for reference in references:
        source = reference.surface.vertices[:: SETTINGS.vertex_step]
        other = best_rigid(source, picked).apply(source)
        distances.append((tree.query(other)[0].mean() + cKDTree(other).query(picked)[0].mean()) / 2)
    closeness = np.exp(-(np.array(distances) - min(distances, default=0.0)) / SETTINGS.weight_mm)
    ranked = [
        RankedReference(reference.id, float(distance), float(close / closeness.sum()))
        for reference, distance, close in zip(references, distances, closeness, strict=True)
    ]
    return tuple(sorted(ranked, key=lambda one: one.chamfer_mm))


def prepare(references: Sequence[Reference]) -> None:
    """Do beforehand what the first choice from a large library would do: 0.2 s for 2,400 bodies."""
    if len(references) > SETTINGS.most_compared:
        index_of(references)


class ShapeIndex:
    """Many bodies of one topology, found by likeness without looking at each."""

    def __init__(self, references: Sequence[Reference]) -> None:
        bodies = np.stack([reference.surface.vertices[:: SETTINGS.vertex_step] for reference in references])
        some = bodies[:: -(-len(bodies) // SETTINGS.learnt_from)]
        self._middle = some[0]
        self._middle = self._laid(some).mean(axis=0)
        laid = self._laid(bodies) - self._middle
        away = laid[:: -(-len(bodies) // SETTINGS.learnt_from)].reshape(len(some), -1)
        self._directions = np.linalg.svd(away, full_matrices=False)[2][: SETTINGS.few_numbers]
        self._tree = cKDTree(laid.reshape(len(bodies), -1) @ self._directions.T)

    def spread(self, count: int) -> list[int]:
        """The places of `count` bodies as unlike each other as can be: the most average one, then ever the farthest."""
        numbers = np.asarray(self._tree.data)
        chosen = [int((numbers**2).sum(axis=1).argmin())]
        away = np.full(len(numbers), np.inf)
        while len(chosen) < min(count, len(numbers)):
            away = np.minimum(away, ((numbers - numbers[chosen[-1]]) ** 2).sum(axis=1))
            chosen.append(int(away.argmax()))
        return chosen

    def like(self, place: int, count: int) -> list[int]:
        """The places of the `count` bodies most like the one at `place`, itself among them."""
        return [int(other) for other in self._tree.query(self._tree.data[place], k=min(count, self._tree.n))[1]]

    def nearest(self, vertices: np.ndarray, count: int) -> list[int]:
        """The places of `count` bodies most like vertices (n, 3), wherever it lies; the same order every time."""
        numbers = self._directions @ (self._laid(vertices[None])[0] - self._middle).ravel()
        return sorted(int(place) for place in self._tree.query(numbers, k=count)[1])

    def _laid(self, bodies: np.ndarray) -> np.ndarray:
        """Each body (k, n, 3) laid rigidly on the middle one."""
        return np.stack([best_rigid(body, self._middle).apply(body) for body in bodies])


_made: list[tuple[Sequence[Reference], ShapeIndex]] = []
"""The index of the library used last: made once for each, when it is first asked."""


def index_of(references: Sequence[Reference]) -> ShapeIndex:
    """The index of a library; that of the library asked for last is remembered."""
    for known, index in _made:
        if known is references:
            return index
    index = ShapeIndex(references)
    _made[:] = [(references, index)]
    return index
