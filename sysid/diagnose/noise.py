"""The noise floor as today's diagnosis wants it: always a number, however unsure."""

from ..noise.floor import NoiseFloor, estimate

__all__ = ["NoiseFloor", "floor"]


def floor(residual, measured, q, step, joint: int) -> NoiseFloor:
    """What `sysid.noise.floor` says, with its estimate where that says None."""
    found = estimate(residual, measured, q, step, joint)
    method = "spectral" if found.method == "none" else found.method
    return NoiseFloor(found.rms, found.std, method, found.detail or found.doubt)
