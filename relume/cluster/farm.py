"""Passes handed out to workers and taken back, whatever becomes of a worker meanwhile.

A pass is with at most one worker that is trusted. It is handed out again if the worker dies, hangs,
raises an error or returns what cannot be a pass; what comes late for it is ignored. A worker that
fails repeatedly gets no more passes. Each worker has one pass under way and one waiting, so that
it need not wait for us, and little is lost with it.
"""

from __future__ import annotations

import queue
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from relume.cluster import worker as remote
from relume.cluster.serialization import Contents
from relume.passes import Pass, PassSet
from relume.session import CannotRender, reason

if TYPE_CHECKING:
    from distributed import Client, Future

WINDOW = 2
"""Passes with a worker at a time."""

FAILURES = 3
"""Failures one after the other that end the use of a worker, or of one pass that end the render."""

LOADING = 600.0
"""Time that a worker may take to load the scene and render its first pass [s]."""

PATIENCE = (60.0, 20.0)
"""A worker hangs that has returned nothing for this time [s], and for so many times the longest
pass so far."""

LOOK = 1.0
"""Interval at which workers that joined or left are noticed [s]."""

TICK = 0.2
"""Longest time without a sign of life to the caller [s]."""


@dataclass(eq=False)
class Worker:
    """A worker as we see it.

    Attributes:
        address: its name on the scheduler.
        threads: that it may use.
        ready: whether the scene is loaded.
        tasks: that it has, the oldest first.
        failures: one after the other.
        heard: when it last returned something, or got something to do while idle [s].
    """

    address: str
    threads: int
    ready: bool = False
    tasks: list[Task] = field(default_factory=list)
    failures: int = 0
    heard: float = 0.0


@dataclass(eq=False)
class Task:
    """Something that a worker was told: to render the pass, or to load the scene if it is None."""

    worker: Worker
    index: int | None = None
    spp: int = 0
    future: Future = field(init=False)


class Farm:
    """Renders passes on the workers of a `distributed.Client`.

    Args:
        client: of the scheduler.
        job: what to render.
        contents: arrays and bytes of the scene by hash.
        note: called with sentences for the user.
    """

    def __init__(
        self,
        client: Client,
        job: remote.Job,
        contents: Mapping[str, Contents],
        note: Callable[[str], object],
    ) -> None:
        self.client = client
        self.job = job
        self.contents = contents
        self.note = note
        self.workers: dict[str, Worker] = {}
        self.banned: dict[str, str] = {}
        self.waiting: deque[tuple[int, int]] = deque()
        self.failed: dict[int | None, int] = {}
        self.doubtful: dict[int | None, int] = {}
        self.longest: float | None = None
        self._places: dict[str, Any] | None = None
        self._arrived: queue.SimpleQueue[tuple[Task, Any, BaseException | None]]
        self._arrived = queue.SimpleQueue()
        self._numbers = count()

    def render(self, to_do: PassSet) -> Generator[Pass | None, None, None]:
        """Render passes.

        Yields:
            Passes in any order, each once; None where there is none for a while.

        Raises:
            CannotRender: a pass fails on all workers, or no worker is left that does not fail.
        """
        self.waiting = deque(to_do)
        missing = {index for index, _ in self.waiting}
        looked = -LOOK
        with ThreadPoolExecutor(4, thread_name_prefix="relume-fetch") as self._fetchers:
            try:
                while missing:
                    if time.monotonic() >= looked + LOOK:
                        self._look_around()
                        looked = time.monotonic()
                    self._hand_out()
                    found = self._next()
                    if found is None or found.index in missing:
                        if found is not None:
                            missing.discard(found.index)
                        yield found
            finally:
                self.client.cancel([t.future for w in self.workers.values() for t in w.tasks])

    # ---- workers

    def _look_around(self) -> None:
        """Admit new workers, and drop those that left or hang."""
        threads = {a: n for a, n in self.client.nthreads().items() if a not in self.banned}
        for address in self.workers.keys() - threads.keys():
            self._dismiss(self.workers[address])
        for address in threads.keys() - self.workers.keys():
            self.workers[address] = Worker(address, threads[address])
            self._load(self.workers[address])
        for one in list(self.workers.values()):
            silent = time.monotonic() - one.heard
            if one.tasks and silent > self._patience(one):
                self._ban(one, f"no answer for {silent:.0f} s")
        if self.banned and not self.workers:
            reasons = "; ".join(f"{address}: {why}" for address, why in self.banned.items())
            raise CannotRender(f"no worker is left ({reasons})")

    def _patience(self, one: Worker) -> float:
        if not one.ready or self.longest is None:
            return LOADING
        least, times = PATIENCE
        return max(least, times * self.longest)

    def _dismiss(self, one: Worker) -> None:
        """Take back all that a worker has."""
        del self.workers[one.address]
        self.client.cancel([task.future for task in one.tasks])
        for task in one.tasks:
            self._give_back(task)
        one.tasks.clear()

    def _ban(self, one: Worker, why: str) -> None:
        self.note(f"worker {one.address} is not used any more: {why}")
        self.banned[one.address] = why
        self._dismiss(one)

    def _load(self, one: Worker) -> None:
        """Send a worker the scene: contents go once to each, from whoever has them."""
        if self._places is None:
            named = {f"relume-{name}": value for name, value in self.contents.items()}
            self._places = self.client.scatter(named) if named else {}
        contents = {name: self._places[f"relume-{name}"] for name in self.contents}
        self._submit(one, Task(one), remote.load, self.job, contents, one.threads)

    # ---- passes

    def _hand_out(self) -> None:
        """Fill the windows of the workers, the emptiest first."""
        for filled in range(WINDOW):
            for one in self.workers.values():
                if one.ready and len(one.tasks) == filled and self.waiting:
                    index, spp = self.waiting.popleft()
                    task = Task(one, index, spp)
                    self._submit(one, task, remote.render, self.job.key, index, spp)

    def _submit(
        self, one: Worker, task: Task, function: Callable[..., Any], *arguments: Any
    ) -> None:
        if not one.tasks:
            one.heard = time.monotonic()
        one.tasks.append(task)
        name = f"relume-{function.__name__}-{self.job.key[:8]}-{id(self)}-{next(self._numbers)}"
        task.future = self.client.submit(function, *arguments, workers=[one.address], key=name)
        task.future.add_done_callback(lambda _: self._fetchers.submit(self._fetch, task))

    def _fetch(self, task: Task) -> None:
        """Bring a result here, in a thread of its own."""
        try:
            self._arrived.put((task, task.future.result(timeout=LOADING), None))
        except BaseException as error:  # whatever was raised on the worker, or while it died
            self._arrived.put((task, None, error))

    def _give_back(self, task: Task) -> None:
        if task.index is not None:
            self.waiting.appendleft((task.index, task.spp))

    def _next(self) -> Pass | None:
        """The next `Pass` that can be trusted, or None."""
        try:
            task, result, error = self._arrived.get(timeout=TICK)
        except queue.Empty:
            return None
        one = task.worker
        if task not in one.tasks:
            return None  # it was given to another worker meanwhile
        one.tasks.remove(task)
        one.heard = time.monotonic()
        if error is None and task.index is None:
            one.ready = True
            return None
        why = self._error(error) if error is not None else self._fault(task, result)
        if not why:
            one.failures = 0
            self.longest = max(self.longest or 0.0, result.seconds)
            return result.pass_
        self._give_back(task)
        if why is not AGAIN:
            self._blame(task, why, error)
        return None

    def _error(self, error: BaseException) -> str:
        return f"{type(error).__name__}: {reason(error)[:300]}"

    def _fault(self, task: Task, result: Any) -> str:
        """What is wrong with a result; an empty string if nothing is."""
        if not isinstance(result, remote.Rendered) or not isinstance(result.pass_, remote.Pass):
            return "it returned no pass"
        found = result.pass_
        pixels = self.job.plan.width * self.job.plan.height
        arrays = found.arrays
        if (found.index, found.spp) != (task.index, task.spp):
            return "it returned another pass"
        if any(getattr(a, "shape", None) != (3, pixels) or a.dtype != np.float32 for a in arrays):
            return "it returned sums of another size"
        if remote.checksum(found) != result.checksum:
            return "the sums were damaged on the way"
        finite = all(np.isfinite(a).all() for a in arrays)
        if finite and not possible(found):
            return "it returned sums that no samples have"
        if not finite and self.doubtful.get(task.index) != result.checksum:
            self.doubtful[task.index] = result.checksum
            return AGAIN
        return ""

    def _blame(self, task: Task, why: str, error: BaseException | None) -> None:
        """Count a failure against the worker and the pass."""
        one = task.worker
        one.failures += 1
        failures = self.failed[task.index] = self.failed.get(task.index, 0) + 1
        what = "the scene" if task.index is None else f"pass {task.index}"
        if task.index is not None and failures >= 2 * FAILURES:
            raise CannotRender(f"{what} failed {failures} times, last on {one.address}: {why}")
        self.note(f"worker {one.address} failed at {what}: {why}")
        if one.failures >= FAILURES or isinstance(error, CannotRender):
            self._ban(one, why)
        elif task.index is None or isinstance(error, remote.NotLoaded):
            one.ready = False
            self._places = None
            self._load(one)


AGAIN = "not finite"
"""A pass with values that are not finite is accepted once it has come out the same twice."""


def possible(found: Pass) -> bool:
    """Whether sums and sums of squares fit: (sum x)^2 <= n sum x^2, by Cauchy and Schwarz.

    Rounding and the underflow of squares are allowed for.
    """
    if found.squares is None:
        return True
    sums, squares = found.sum.astype(float), found.squares.astype(float)
    underflow = found.spp * 2.0**-126
    return bool((sums**2 <= found.spp * (1.1 * squares + underflow)).all())
