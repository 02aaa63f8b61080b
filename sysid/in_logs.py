"""Effects that may be in some logs alone, which their option `logs` names."""

from __future__ import annotations

from .effect_options import subsets, texts


class InLogs:
    """What being in some logs alone, by their names under `data`, adds to an effect: beside what all logs share it is the same of some
    logs and, with the other sign, of all others."""

    either_way = True
    logs = None

    def given(self, **options):
        chosen = super().given(**options)
        texts(chosen, "logs")
        return chosen

    @property
    def instantaneous(self) -> bool:
        """Whether q, qd and qdd of an instant say what it does: not where the log does."""
        return self.logs is None

    def among(self, logs) -> list[dict]:
        """In any of few, in the fewer of two halves; of more in each alone."""
        return subsets(logs, half=True)

    def present(self, motion) -> bool:
        """Whether it is there in a motion's log."""
        return self.logs is None or motion.source in self.logs
