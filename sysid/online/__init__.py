"""A model that follows its robot, and says when the robot leaves what the model foresaw.

stream.py     samples as they come -> rows of the equation of motion
follow.py     all rows so far as one triangle with forgetting, and its optimum
whitening.py  noise with a memory -> innovations
monitor.py    when, and what: the test of every change that could be
change.py     how large it is
online.py     all of it
"""

from .change import Change
from .online import Online
from .watch import Alarm

__all__ = ["Alarm", "Change", "Online"]
