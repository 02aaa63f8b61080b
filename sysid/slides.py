"""Which rows say something of a model: not those on which one of its effects may have any value."""

from __future__ import annotations

import numpy as np

from .effect import TorqueEffect
from .motion import Piece
from .standstill import sliding


def counted(model, piece: Piece) -> np.ndarray | None:
    """The rows (n, dof) of a piece that count for each joint's torque under a model, None where all do."""
    use, dof = piece.use, piece.q.shape[1]
    for effect, joints in model.terms:
        for joint in joints if isinstance(effect, TorqueEffect) and effect.present(piece) else ():
            over = effect.slides_over(joint, dof)
            if len(over):
                key = "sliding", over.tobytes()
                if key not in piece.kept:
                    piece.kept[key] = sliding(piece, over)
                use = np.ones(piece.q.shape, dtype=bool) if use is None else use.copy()
                use[:, joint] &= piece.kept[key]
    return use
