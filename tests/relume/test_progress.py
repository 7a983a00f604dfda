"""Progress: when the time is up, what a bar shows, and interrupts."""

import io
import signal

import pytest
from rich.console import Console

from relume.accumulator import Accumulator
from relume.progress import Progress, TimeLimit, interruptible, progress_bar


def at(passes, seconds):
    return Progress(passes, 100, passes, 100, seconds)


def test_a_limit_ends_with_the_pass_that_comes_nearest():
    """Passes of 2 s: the one that ends at 8 s is the last of 9 s, and that at 10 s of 9.1 s."""
    for seconds, last in ((9.0, 5), (8.9, 4), (0.0, 1)):
        limit = TimeLimit(seconds)
        ends = [passes for passes in range(1, 50) if limit.reached(at(passes, 2.0 * passes))]
        assert ends[0] == last


def test_steps_without_a_pass_leave_the_length_of_passes_alone():
    """A cluster tells the time meanwhile; passes that were there before took none."""
    limit = TimeLimit(10.0, passes=7)
    assert not limit.reached(at(7, 9.9)) and limit.reached(at(7, 10.1))
    limit = TimeLimit(10.0, passes=7)
    assert not limit.reached(at(8, 4.0))
    assert not limit.reached(at(8, 7.9)) and limit.reached(at(8, 8.1))


def test_no_limit():
    assert not TimeLimit(None).reached(at(1, 1e9))


def test_a_bar_shows_passes_and_rate_on_terminals_alone():
    shown = {}
    for terminal in (True, False):
        file = io.StringIO()
        console = Console(file=file, force_terminal=terminal, width=120)
        with progress_bar(Accumulator(1000, 1000), console) as tell:
            tell(Progress(3, 8, 6, 16, 2.0))
        shown[terminal] = file.getvalue()
    for part in ("3/8", "3.00 M samples/s", "left"):
        assert part in shown[True]
    assert shown[False] == ""


def test_signal_handlers_are_restored():
    before = signal.getsignal(signal.SIGINT)
    with interruptible() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop == [signal.SIGINT]
        with pytest.raises(SystemExit) as ended:
            signal.raise_signal(signal.SIGINT)
    assert ended.value.code == 130 and signal.getsignal(signal.SIGINT) is before
