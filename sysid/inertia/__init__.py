"""Rigid bodies: ten parameters, the pseudo-inertia, four parameterizations, three divergences."""

from .consistency import is_consistent, satisfies_theorem, violations
from .divergence import DIVERGENCES, Divergence, Euclidean, LogDet, Pullback
from .eigenvalue import Eigenvalue
from .exponential import Exponential
from .linear import Linear
from .log_cholesky import LogCholesky
from .parameterization import Parameterization
from .pseudo import PARAMETERS, UNITS, from_pinocchio, from_pseudo, to_pinocchio, to_pseudo

PARAMETERIZATIONS = {kind.name: kind for kind in (LogCholesky, Exponential, Eigenvalue, Linear)}

__all__ = [
    "DIVERGENCES", "Divergence", "Eigenvalue", "Euclidean", "Exponential", "Linear", "LogCholesky", "LogDet",
    "PARAMETERIZATIONS", "PARAMETERS", "Parameterization", "Pullback", "UNITS", "from_pinocchio", "from_pseudo",
    "is_consistent", "satisfies_theorem", "to_pinocchio", "to_pseudo", "violations",
]
