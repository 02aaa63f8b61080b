"""Long logs as a few of their stretches, for what looks at rows and not at triangles.

Whether something is missing, some thousand rows tell as well as millions (`lowpass.MOST_ROWS` are
asked). So of logs that do not stand in memory together, evenly spaced stretches do: each long
enough for every filter and for whatever looks back, and together from the first to the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from . import listed_effects, robot
from .experiment_logs import Read
from .experiment_logs import read as read_logs
from .log import Log
from .spans import SPAN, Spans
from .specs import Experiment
from .warned import noticed

# rows of the training logs, and of the test logs: four minutes at 1 kHz, of which a low-pass leaves
# more rows than are asked; what memory a diagnosis takes does not grow beyond
MOST = SPAN


def read(experiment: Experiment) -> tuple[Read, Read | None]:
    """What is looked at of an experiment's logs, and the same where that is all of them, None where
    it is a part.

    Raises:
        SysidError: as `experiment_logs.read`.
    """
    with noticed():  # of the robot the fit says it
        machine = robot.load(experiment.robot, experiment.folder)
    each = listed_effects.build(machine, [], experiment.folder)  # looks at rows one by one
    data = experiment.data
    with noticed() as notices:
        logs = [
            read_logs(experiment, machine, part, structure=each) for part in (data.train, data.test)
        ]
    found = [thinned(part) for part in logs]
    rows, kept = (sum(log.samples for part in them for log in part) for them in (logs, found))
    if kept == rows:
        return (whole := Read(*found, tuple(notices))), whole
    said = f"what is missing was asked of {kept} samples of {rows}, in stretches spread over them"
    return Read(*found, (said,)), None


def thinned(logs: Sequence[Log]) -> list[Log]:
    """Logs that are looked at together: of those in spans, stretches spread over them."""
    total = sum(log.samples for log in logs)
    own = lambda log: max(1, MOST * log.samples // total)  # noqa: E731
    return [
        replace(log, segments=log.segments.spread(own(log) if total > MOST else log.samples))
        if isinstance(log.segments, Spans)
        else log
        for log in logs
    ]
