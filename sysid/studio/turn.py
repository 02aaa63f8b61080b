"""Whose turn it is: one job works at a time, and a long one lets a short one by where it tells how
far it is."""

from __future__ import annotations

import threading

_WAIT = 0.1  # s between looks whether one that waits was told to stop


class Turn:
    """A lock for jobs. Two at once would each take twice as long; a short one that had to wait for
    the end of a long one would take as long as that."""

    def __init__(self):
        self._changed = threading.Condition()
        self._taken, self._ahead = False, 0

    def take(self, stop: threading.Event, *, ahead: bool = False) -> bool:
        """Wait for the turn; False where `stop` was set before it came.

        Args:
            ahead: before those that wait without it, and between two reports of the one at work.
        """
        with self._changed:
            self._ahead += ahead
            try:
                while not self._changed.wait_for(lambda: self._free(ahead), _WAIT):
                    if stop.is_set():
                        return False
                self._taken = True
                return True
            finally:
                self._ahead -= ahead
                self._changed.notify_all()

    def give(self) -> None:
        """End one's turn."""
        with self._changed:
            self._taken = False
            self._changed.notify_all()

    def let_by(self) -> None:
        """Let those by that go ahead, and come back when they are done."""
        if self._ahead:
            self.give()
            self.take(threading.Event())

    def _free(self, ahead: bool) -> bool:
        return not self._taken and (ahead or not self._ahead)
