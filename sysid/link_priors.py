"""What a URDF says of its links' inertias, and what is assumed where it says nothing."""


import numpy as np
import pinocchio as pin

from . import prior, urdf
from .inertia import pseudo
from .inertia.consistency import is_consistent

LINK = "link:"
_GRAM = 1e-3  # kg: a robot of which no link weighs so much is none
_WIDE = 3.0  # m: no link of a small robot has a greater radius of gyration


def placeholders(masses) -> bool:
    """Whether the masses [kg] that a URDF states, some of which may be zero, are there because something has to be."""
    return bool(len(masses)) and 0.0 < max(masses) < _GRAM


def link_priors(source: urdf.Urdf, model: pin.Model, bodies: list) -> np.ndarray:
    """(bodies, 10) prior of each body: what the URDF states of the links that it is made of, else their geometry, else a guess."""
    stated, shapes = [], []
    for body in bodies:
        members = [f for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint == body.row + 1]
        moved = lambda pi, f: pseudo.displaced(pi, f.placement.rotation, f.placement.translation)  # noqa: E731
        links = [(source.links[f.name.removeprefix(LINK)], f) for f in members if f.name.startswith(LINK)]
        inertials = [moved(link.inertial, f) for link, f in links if link.inertial is not None]
        solids = [moved(link.geometry, f) for link, f in links if link.geometry is not None]
        stated.append(np.sum(inertials, 0) if inertials else None)
        shapes.append(np.sum(solids, 0) if solids else None)
    if light := placeholders([pi[0] for pi in stated if pi is not None]):
        stated = [None] * len(stated)
    long = sum(float(np.linalg.norm(place.translation)) for place in model.jointPlacements)
    masses = [pi[0] for pi in stated if pi is not None and is_consistent(pi)]
    typical = float(np.median(masses)) if masses else None
    out = []
    for body, pi, solid in zip(bodies, stated, shapes):
        children = [model.jointPlacements[i].translation for i in range(1, model.njoints) if model.parents[i] == body.row + 1]
        reach = max(children, key=np.linalg.norm, default=np.zeros(3))
        if pi is not None and prior.wider(pi, max(3.0 * long, _WIDE)):
            pi = np.array([*pi[:4], *np.zeros(6)])  # in another unit: mass and centre of mass are kept
        out.append(prior.usable(body.name, pi, solid, reach, typical, light=light))
    return np.array(out)


# Before the names of links in the Pinocchio model of a URDF: a joint and a link may share a name, and Pinocchio keeps the
# frames of both in one list.
