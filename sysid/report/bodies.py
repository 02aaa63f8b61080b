"""The bodies in space: each as the ellipsoid that its parameters make it, on the robot; and what
of them the logs tell: shares, combinations, correlations."""

from __future__ import annotations

import numpy as np

from .. import base_parameters
from ..estimate import Fit
from . import ellipsoids, solids
from .correlations import correlation_map
from .section import Section
from .words import SPACE, number, plus_minus, unit_of

_TOLD = 0.5  # of a parameter's variance: more is the data's
_NAMED = 8  # terms of a combination that are written out


def bodies(fit: Fit) -> Section:
    """The bodies as ellipsoids on the robot, at the middle of its motion, and what is known of
    them."""
    robot = fit.model.robot
    states = fit.predictions["train"].states
    q = np.zeros((1, robot.dof)) if states is None or not len(states.q) else states.q
    middle = (q.min(0) + q.max(0)) / 2
    placed = solids.frames(robot, middle)
    now, before = solids.solids(robot, fit.pi, placed), solids.solids(robot, fit.prior, placed)
    shares = fit.uncertainty.from_data[: 10 * len(robot.bodies)].reshape(-1, 10)
    found, rows = [], []
    for b, (body, one, other) in enumerate(zip(robot.bodies, now, before)):
        told = int((shares[b] > _TOLD).sum())
        mass = plus_minus(float(fit.pi[b, 0]), float(fit.uncertainty.std[10 * b]))
        words = "the prior alone" if told == 0 else f"{told} of 10 from the data"
        found.append({
            "name": body.name,
            "kind": body.kind,
            "words": f"mass {mass} kg, {words}",
            "told": float(shares[b].mean()) if told else 0.0,
            "identified": one,
            "prior": other,
        })  # fmt: skip
        rows.append({
            "name": body.name,
            "alone": told == 0,
            "cells": [
                body.kind,
                mass,
                number(float(fit.prior[b, 0])),
                "prior" if shares[b, 0] <= _TOLD else "data",
                words,
                _triple(one.centre) if one else "–",
                _axes(one) if one else "not physically possible",
                _axes(other) if other else "–",
            ],
        })  # fmt: skip
    chart = ellipsoids.bodies("solids", found, solids.skeleton(robot, placed))
    angles = [
        f"{joint} {number(value, 3)} {'m' if slides else 'rad'}"
        for joint, value, slides in zip(fit.joints, middle, robot.prismatic)
    ]
    sums = base_parameters.combinations(fit)
    names, matrix = base_parameters.correlations(fit)
    drawn = [correlation_map("correlations", names, matrix)] if len(names) > 1 else []
    values = {
        "angles": angles,
        "rows": rows,
        "alone": sum(row["alone"] for row in rows),
        "chart": chart,
        "sums": [_sum(one) for one in sorted(sums, key=lambda one: not one.clear)],
        "clear": sum(one.clear for one in sums),
        "free": 10 * len(robot.bodies) - len(sums),
        "pairs": [
            f"{pair.first} and {pair.second} {number(pair.value, 2)}"
            for pair in base_parameters.strongest(names, matrix)
        ],
        "map": drawn[0] if drawn else None,
    }
    return Section("Bodies", "bodies", values, [chart, *drawn])


def _sum(found: base_parameters.Combination) -> dict:
    short = found
    if len(found.terms) > _NAMED:
        short = base_parameters.Combination(found.terms[:_NAMED], 0.0, 0.0, "")
    more = len(found.terms) - len(short.terms)
    doubt = abs(found.std / found.value) if found.clear else float("nan")
    return {
        "words": short.words + (f" and {more} more" if more else ""),
        "whole": found.words,
        "value": plus_minus(found.value, found.std),
        "unit": unit_of(found.unit),
        "doubt": f"{number(100 * doubt, 2)}{SPACE}%" if found.clear else "not told from zero",
        "clear": found.clear,
    }


def _triple(values) -> str:
    return ", ".join(number(v, 3) for v in values)


def _axes(solid: solids.Solid) -> str:
    """Semi-axes, the longest first."""
    return _triple(sorted(solid.axes)[::-1])
