"""One thread at a time loads, traces and frees what Mitsuba keeps for the whole process.

Dr.Jit has one registry of objects for the process: a call of a method is traced for every BSDF,
emitter and the like that is alive, also for those of scenes of other threads. An object enters the
registry when the constructor of its C++ base class runs, and leaves it with the destructor. Objects
in C++ are complete by then; of those in Python the constructor goes on, and gives way to other
threads, which find attributes missing; and while a call waits to enter Python, the object that it
is for may be freed. So no thread may load or free scenes while another one traces. The variant and
the number of threads are the process's as well.
"""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])

_lock = threading.RLock()
_depth = 0
_users: set[int] = set()
_loaded: list[Any] = []
"""What was loaded since a second thread came. Who drops it last must not free it: see `_free`."""


@contextmanager
def alone() -> Iterator[None]:
    """Context that at most one thread is in; it may be entered again."""
    global _depth
    if _depth and isinstance(threading.current_thread(), threading._DummyThread):
        # A thread of Mitsuba's own, on behalf of the one that waits for it inside.
        yield
        return
    with _lock:
        _users.add(threading.get_ident())
        _depth += 1
        try:
            yield
        finally:
            if _depth == 1:
                _free()
            _depth -= 1


def in_turn(function: Function, loads: bool = False) -> Function:
    """Return the function, to be called by one thread at a time.

    Args:
        function: any.
        loads: whether it returns objects of Mitsuba. If several threads are about, these live on
            until one of them is inside that may free them.
    """

    @functools.wraps(function)
    def turn(*args: Any, **kwargs: Any) -> Any:
        with alone():
            result = function(*args, **kwargs)
            if loads and len(_users) > 1:
                _loaded.append(result)
        return result

    return turn  # type: ignore[return-value]


def _references(items: list[Any], index: int) -> int:
    return sys.getrefcount(items[index])


_ONLY_HERE = _references([object()], 0)


def _free() -> None:
    """Free what nobody but this module knows any more."""
    for index in reversed(range(len(_loaded))):
        if _references(_loaded, index) <= _ONLY_HERE:
            del _loaded[index]
