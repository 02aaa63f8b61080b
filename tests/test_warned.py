"""What the user is told: as a warning, or collected, whatever other threads collect meanwhile."""

import threading
import warnings

import pytest

from sysid.errors import SysidWarning
from sysid.warned import noticed, unheard, warn


def _beside(work) -> list:
    """What `work(entered, go_on)` gives in another thread, begun within ours and ended after it."""
    entered, go_on, given = threading.Event(), threading.Event(), []

    def run():
        try:
            given.append(work(entered, go_on))
        except BaseException as error:  # what a thread dies of is what is asked
            given.append(error)

    thread = threading.Thread(target=run)
    with noticed() as told:
        thread.start()
        assert entered.wait(10.0)
        warn("ours")
    go_on.set()
    thread.join(10.0)
    assert told == ["ours"]
    return given


def test_a_thread_hears_what_it_says_itself_and_no_other():
    def work(entered, go_on):
        with noticed() as told:
            warn("theirs, before")
            entered.set()
            assert go_on.wait(10.0)
            warn("theirs, after ours was over")
        return told

    assert _beside(work) == [["theirs, before", "theirs, after ours was over"]]


def test_who_does_not_collect_is_warned_while_others_do():
    def work(entered, go_on):
        entered.set()
        warn("theirs")

    (died,) = _beside(work)
    assert isinstance(died, SysidWarning) and str(died) == "theirs"


def test_filters_of_python_are_put_back_whoever_ends_first():
    before = list(warnings.filters)

    def work(entered, go_on):
        with noticed():
            entered.set()
            assert go_on.wait(10.0)
        with unheard():
            warnings.warn("of a package", UserWarning, stacklevel=1)
        return list(warnings.filters)

    assert _beside(work) == [before] and list(warnings.filters) == before


def test_a_line_is_collected_once_and_within_the_inner_one_alone():
    with noticed() as outer:
        warn("one")
        with noticed() as inner:
            warn("two")
            warn("two")
        warn("one")
    assert outer == ["one"] and inner == ["two"]


def test_a_warning_names_the_line_that_asked_for_what_gave_it():
    def asked():
        warn("of what was asked")

    def layer():
        warn("of what a layer asked", above=2)

    def asked_through():
        layer()

    with pytest.warns(SysidWarning) as said:
        asked()
        asked_through()
    assert [one.filename for one in said] == [__file__, __file__]
    assert said[1].lineno == said[0].lineno + 1


def test_other_warnings_are_not_collected():
    with noticed() as told, pytest.warns(RuntimeWarning):
        warnings.warn("of numpy", RuntimeWarning, stacklevel=1)
    assert told == []
