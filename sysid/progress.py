"""How far a run is, from the stages that calculations tell: words for the stage, and the share of the whole that is done.

A fit tells its stages by name, a diagnosis its rounds of questions. How long each takes beside the others is what the
experiments of the README take, so that what is left is about right, and never zero while there is work.
"""

from __future__ import annotations

#: stages of a fit in their order: words, and parts of a fit's time
FIT = {
    "robot": ("reading the robot", 1), "read": ("reading the logs", 5), "filters": ("comparing filters", 30), "preprocess": ("filtering", 2),
    "shape": ("searching shape values", 15), "compress": ("fitting", 20), "weight": ("choosing the prior's weight", 10), "solve": ("solving", 5),
    "masses": ("looking at the masses", 5), "predict": ("predicting", 2), "test": ("reading the test logs", 5),
    "left": ("looking at what is left", 1),
}  # fmt: skip
_WORDS = {"starting": "reading the logs", "ask": "asking what is missing", "drawing": "drawing"}
_WITH = "ask, with "  # begins a round of questions, before the effect that joined last
STAYS = "dashboard: "  # begins what is told once, and stays in sight
_ASKED, _FIRST = 0.2, 0.5  # shares of a diagnosis: its fit, and the first round of questions
_DRAWN = 0.97  # from here on a page is drawn
_MOST = 0.99
_WHOLE = sum(weight for _, weight in FIT.values())


class Course:
    """The way through one command.

    Args:
        fits: how many it makes, or other stages of one length, as far as is known. asks: whether questions follow.
    """

    def __init__(self, fits: int = 1, *, asks: bool = False):
        self._fits, self._asks = max(fits, 1), asks
        self._done, self._last = 0, -1  # fits that are done; the place of the stage before
        self._rounds: list[str] = []
        self._stages: list[str] = []
        self.share = 0.0

    @property
    def open(self) -> str:
        """What is not known of the end: "more" where rounds of questions may follow that depend on what is found, "rounds" within
        these; else empty."""
        return "rounds" if len(self._rounds) > 1 else "more" if self._asks else ""

    def left(self, elapsed: float) -> str:
        """The time left, in words, after so many seconds; empty where nothing tells yet."""
        if self.open == "rounds":
            return f"{spoken(elapsed)} so far; another round for each effect that joins"
        rest = left(self.share, elapsed)
        more = ", more for each effect that joins" if self.open else ""
        return "" if rest is None else f"about {spoken(rest)} left{more}"

    @property
    def found(self) -> list[str]:
        """The effects with which it was asked again, in order."""
        return [name for _, comma, name in (stage.partition(_WITH) for stage in self._rounds) if comma]

    def tell(self, stage: str, share: float) -> tuple[str, float]:
        """A stage and the share of it that is done: in words, and the share of the whole, which never falls."""
        word, comma, rest = stage.partition(",")
        words = FIT[word][0] if word in FIT else _WORDS.get(word, word)
        if word in FIT and self._rounds:
            words = f"trying a suspect, {words}"
        self.share = max(self.share, min(self._at(word, stage, share), _MOST))
        return words + comma + rest, self.share

    def _at(self, word: str, stage: str, share: float) -> float:
        if word == "starting":
            return 0.0
        if word == "drawing":
            return _DRAWN
        if word in FIT:
            if self._rounds:
                return 0.0  # a fit that answers a question
            place = list(FIT).index(word)
            self._done += place < self._last
            self._last = place
            before = sum(weight for _, weight in list(FIT.values())[:place])
            now = self._done + (before + FIT[word][1] * share) / _WHOLE
            return min(now / self._fits, 1.0) * (_ASKED if self._asks else 1.0)
        if not (self._asks or word == "ask"):
            if stage not in self._stages:
                self._stages.append(stage)
            return (len(self._stages) - 1 + share) / max(self._fits, len(self._stages))
        if stage not in self._rounds:
            self._rounds.append(stage)
        before = len(self._rounds) - 1
        if not before:
            return _ASKED + _FIRST * share
        rest = 1.0 - _ASKED - _FIRST
        return min(1.0 - rest * 0.5 ** (before - 1) * (1.0 - 0.5 * share), _DRAWN)


def left(share: float, elapsed: float) -> float | None:
    """Seconds left, where a share of the work took so long; None where that tells nothing yet."""
    return elapsed * (1.0 - share) / share if share >= 0.03 and elapsed >= 1.0 else None


def spoken(seconds: float) -> str:
    """A time as people say it: 40 s, 3 min, 2 h 10 min."""
    if seconds < 90.0:
        return f"{max(seconds, 1.0):.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
