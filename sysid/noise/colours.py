"""The spectra that noise is taken to have: white, and white with a first-order part."""

import math

import numpy as np

SLOWEST = 0.3  # Hz, corner of the slowest noise; slower is drift


def models(f: np.ndarray, bandwidth: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Corner [Hz] (models,) and spectrum of the coloured part over the white one (models, bands);
    the first has none."""
    # heights are at the band's edge
    corners = np.geomspace(max(SLOWEST, f[1]), max(0.6 * f[-1], 2.0 * SLOWEST), 30)
    heights = np.geomspace(0.2, 1e4, 14)
    corner, height = (x.ravel()[:, None] for x in np.meshgrid(corners, heights))
    keep = np.exp(-2.0 * math.pi * corner * step)
    turn = 2.0 * math.pi * step
    first_order = lambda at: 1.0 / (1.0 - 2.0 * keep * np.cos(turn * at) + keep**2)  # noqa: E731
    coloured = height * first_order(f) / first_order(max(bandwidth, f[1]))
    none = np.zeros((1, len(f)))
    return np.concatenate([[np.inf], corner[:, 0]]), np.concatenate([none, coloured])
