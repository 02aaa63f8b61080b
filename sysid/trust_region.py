"""Step of a trust region: the least of a quadratic within a ball."""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from . import eigen


def within(gradient, hessian, metric, radius, *, ridge: float):
    """The minimiser of the quadratic model within the ball; its promised decrease and its length."""
    factors, scales = metric
    count = 10 * len(factors)
    inverse = np.linalg.inv(factors)  # L^-1, block by block
    g = np.concatenate([(inverse @ gradient[:count].reshape(-1, 10, 1)).ravel(), gradient[count:] * scales])
    h = hessian.copy()
    shape = (len(factors), 10, -1)
    h[:count] = (inverse @ h[:count].reshape(shape)).reshape(count, -1)
    h[count:] *= scales[:, None]
    h = h.T.copy()
    h[:count] = (inverse @ h[:count].reshape(shape)).reshape(count, -1)
    h[count:] *= scales[:, None]
    h = 0.5 * (h + h.T)
    h.flat[:: len(h) + 1] += ridge * np.max(np.diagonal(h))
    y = _ball(g, h, radius)
    promise = -(g @ y + 0.5 * y @ h @ y)
    step = np.concatenate([(np.swapaxes(inverse, -1, -2) @ y[:count].reshape(-1, 10, 1)).ravel(), y[count:] * scales])
    return step, float(promise), float(np.linalg.norm(y))


def _ball(g, h, radius):
    """argmin g.y + y'hy/2 over |y| <= radius."""
    factor, fault = dpotrf(h, lower=1)
    if fault == 0:
        y = dpotrs(factor, -g, lower=1)[0]
        if np.linalg.norm(y) <= radius:
            return y
    if (y := _on_the_sphere(g, h, radius)) is not None:
        return y
    values, vectors = eigen.symmetric(h)
    along = vectors.T @ g
    floor = max(0.0, -values[0])
    norm = lambda shift: np.linalg.norm(along / (values + shift))  # noqa: E731
    low = floor + 1e-13 * max(1.0, abs(values[-1]), floor)  # above rounding, or the flattest direction divides by zero
    if norm(low) < radius:
        # the hard case: the shift alone cannot reach the boundary, the flattest direction does
        y = -vectors @ (along / (values + low))
        return y + vectors[:, 0] * np.sqrt(max(radius**2 - y @ y, 0.0)) if floor > 0 else y
    # Newton on 1/radius - 1/norm, which is nearly linear in the shift, kept above the floor
    shift = max(low, floor + np.linalg.norm(g) / radius * 1e-3)
    for _ in range(60):
        scaled = along / (values + shift)
        size = np.linalg.norm(scaled)
        if abs(size - radius) < 1e-8 * radius:
            break
        slope = np.sum(scaled**2 / (values + shift)) / size
        shift = max(shift + (size - radius) / radius * size / slope, 0.5 * (low + shift) if size < radius else shift, low)
    return -vectors @ (along / (values + shift))


def _on_the_sphere(g, h, radius):
    """The same where (h + shift) y = -g with |y| = radius has a shift that factorizations find; None where they do not.

    More & Sorensen's Newton iteration on 1 / radius - 1 / |y|; a factorization costs a tenth of the eigenvalues.
    """
    diagonal = np.arange(len(g))
    scale = np.linalg.norm(h, ord="fro")
    low, high = max(0.0, -h[diagonal, diagonal].min()), np.linalg.norm(g) / radius + scale
    shift = max(low, 1e-3 * scale) if low == 0.0 else low * (1.0 + 1e-3)
    for _ in range(12):
        shifted = h.copy()
        shifted[diagonal, diagonal] += shift
        factor, fault = dpotrf(shifted, lower=1)
        if fault:
            low = max(low, shift)
            shift = max(np.sqrt(low * high) if low > 0.0 else 1e-3 * high, low + 0.01 * (high - low))
            continue
        y = dpotrs(factor, -g, lower=1)[0]
        length = np.linalg.norm(y)
        if abs(length - radius) <= 0.05 * radius:
            return y * (radius / length)
        if length > radius:
            low = max(low, shift)
        else:
            high = min(high, shift)
        w = dpotrs(factor, y, lower=1)[0]
        shift += (length / radius - 1.0) * length**2 / (y @ w)
        if not low < shift < high:
            shift = max(np.sqrt(max(low, 0.0) * high), low + 0.01 * (high - low))
    return None
