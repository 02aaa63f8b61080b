"""What is known of the noise of a joint's torque."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

#: standard error over RMS beyond which a floor is not given: two of them are the 25 % that one can
#: judge an error by
UNSURE = 0.12
DOUBT = 0.1  # of a floor: what it may be in doubt by and still be called reached


@dataclass(frozen=True)
class NoiseFloor:
    """RMS of a joint's torque noise [N m or N] and its standard error, None where the log does not
    determine them.

    method: "repeats", "spectral" or "none". detail: how it was found, or why not. low, high: at
        least and at most [N m or N], None where nothing is known. about: the estimate that was too
        unsure to be `rms`, None where there is none. halved: half of the angles' window [s], and
        the errors that it leaves on the training logs and on the test logs; where it was asked.
        train: the RMS on the training logs, where noise is another there; `rms` is the test logs'.
    """

    rms: float | None
    std: float | None
    method: str
    detail: str
    low: float | None = None
    high: float | None = None
    about: float | None = None
    halved: tuple[float, float, float] | None = None
    train: float | None = None

    def reached(self, error: float) -> bool:
        """Whether an error is at it, as far as it is known."""
        return self.rms is not None and error <= (1.0 + DOUBT) * self.rms + 2.0 * self.std

    def within(self, error: float) -> bool:
        """Whether an error is no more than it, by its standard error."""
        return self.rms is not None and error <= self.rms + self.std


def as_of_test(errors: Mapping[str, float], floors: Sequence[NoiseFloor]) -> dict[str, float]:
    """{joint: RMS [N m or N]} on the training logs, as far above their noise, on the test logs."""
    pairs = zip(errors.items(), floors)
    return {joint: e if one.train is None else e * one.rms / one.train for (joint, e), one in pairs}
