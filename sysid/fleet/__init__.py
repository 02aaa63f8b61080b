"""Many robots of one type, or many days of one: what they share, what differs, which one is odd.

dates.py        when the logs were recorded, and what says so
coordinates.py  the base parameters, which the data can tell
estimate.py     what one robot's logs say of them, without a prior
members.py      one experiment, fitted and reduced to that
spread.py       mean and spread of each parameter; each robot judged by the others
drift.py        how parameters move with the dates
calibration.py  the one threshold of the whole table
oddity.py       odd in what: coefficients, or bodies
analysis.py     all of it
listing.py      which experiments are meant
run.py          their files, one by one
document.py     fleet.json
"""

from ..callable_module import callable_module
from .analysis import RATE, Fleet
from .document import document
from .run import fleet

callable_module(__name__, "", "fleet")  # `sysid.fleet(experiments)`

__all__ = ["RATE", "Fleet", "document", "fleet"]
