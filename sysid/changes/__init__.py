"""A fitted model, held, and a new log: what is different? A payload, friction, a bias, an
encoder's zero, a tilt of the base.

Nothing of the fitted model moves. Each change is fitted on one half of the new log and judged on
the other, joins where it takes a share worth having that stands out from block to block, and is
looked at again with the others. What joined is at last fitted on the whole log, a payload as a body
that is physically possible; standard deviations are those of leaving a block of time out
(jackknife).

    held.py        the fitted model of a run folder
    hands.py       which link holds a load, where several may
    signatures.py  the columns of each change that could be
    halves.py      which of them one half of the log tells of the other
    fitted.py      these together on the whole log, with their deviations
    new_log.py     all of it
    many.py        many logs, one model
"""

from .fitted import Change
from .many import many
from .new_log import Changed, changed

__all__ = ["Change", "Changed", "changed", "many"]
