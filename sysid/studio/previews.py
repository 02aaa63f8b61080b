"""Fits of texts that are yet to be written: what a change would bring, before it is made.

A preview is the very fit that the change gives. Where it is made, nothing is fitted twice.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass

from ..errors import SysidError
from ..estimate import Fit
from .workspace import Workspace

_KEPT, _SAMPLES = 6, 2_000_000  # fits in memory; samples that they hold together


@dataclass(frozen=True)
class Preview:
    """The fit of a changed text.

    base: hash of the text that was changed; sha: of the new one. words: what the change adds.
    state: of the files that it depends on, as `cache.key` has it.
    """

    base: str
    sha: str
    words: str
    state: str
    workspace: Workspace

    @property
    def fit(self) -> Fit:
        """The fit."""
        return self.workspace.fit


class Previews:
    """The previews of one experiment; the one made longest ago is forgotten first. Safe to use
    from several threads."""

    def __init__(self):
        self._kept: OrderedDict[str, Preview] = OrderedDict()
        self._lock = threading.Lock()

    def keep(self, made: Preview) -> None:
        """Remember a preview, and forget the oldest where they grow too many."""
        with self._lock:
            self._kept.pop(made.sha, None)
            self._kept[made.sha] = made
            size = lambda: sum(sum(p.fit.samples.values()) for p in self._kept.values())  # noqa: E731
            while len(self._kept) > _KEPT or (len(self._kept) > 1 and size() > _SAMPLES):
                self._kept.popitem(last=False)

    def of(self, base: str) -> list[Preview]:
        """The previews of changes of a text."""
        with self._lock:
            return [made for made in self._kept.values() if made.base == base]

    def find(self, sha: str) -> Preview:
        """The preview of a new text. Raises SysidError: it is not at hand."""
        with self._lock:
            if sha not in self._kept:
                raise SysidError("this preview is not in memory any more", do="preview it again")
            return self._kept[sha]

    def fit(self, sha: str, state: str) -> Fit | None:
        """The fit of a text, where it was previewed and no file that it names changed since."""
        with self._lock:
            made = self._kept.get(sha)
        return made.fit if made is not None and made.state == state else None
