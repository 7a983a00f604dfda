"""What passes survive and cost: the figures of docs/scaling.md, printed as Markdown.

    python -m studies scaling kills|throughput|units|model [NUMBER ...]
"""

import contextlib
import io
import multiprocessing
import os
import signal
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console

import relume
from relume import checkpoint, fingerprint, passes_file, translator
from relume.accumulator import Accumulator
from relume.cluster import Cluster, serialization
from relume.cluster import worker as remote
from relume.cluster.farm import Farm
from relume.loading import open_session, resized
from relume.options import RenderOptions
from relume.passes import Pass, PassPlan, PassSet
from relume.rendering import PassOptions, render_file
from relume.session import accumulate
from studies import SCENES

SCENE = SCENES / "cornell.txt"


# ---- 50 renders that are killed


def kills(renders=50, spp=480, per_pass=8):
    """Kill renders at random moments, resume them, and count those with the same picture."""
    quiet = Console(file=io.StringIO())
    options = {"size": (32, 32), "spp": spp, "console": quiet}
    checkpoint.INTERVAL, checkpoint.SHARE = 0.02, 1e9  # most of the time there is something to lose
    random = np.random.default_rng(0)
    fork = multiprocessing.get_context("fork")

    def render(out, resume=False):
        passes = PassOptions(resume=resume, per_pass=per_pass)
        with contextlib.suppress(BrokenPipeError):
            render_file(SCENE, out=out, passes=passes, **options)

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        start = time.monotonic()
        whole = fork.Process(target=render, args=("whole.exr",))
        whole.start()
        whole.join()
        lasts = time.monotonic() - start
        expected = Path("whole.exr").read_bytes()
        same, killed, with_passes, in_write = 0, 0, 0, 0
        for k in range(renders):
            for left in (*[True] * int(random.integers(1, 4)), False):
                process = fork.Process(target=render, args=("a.exr",), kwargs={"resume": True})
                process.start()
                if left:
                    process.join(float(random.uniform(0, lasts)))
                    if process.exitcode is None:
                        os.kill(process.pid, signal.SIGKILL)
                        killed += 1
                process.join()
                with contextlib.suppress(passes_file.NoPasses):
                    with_passes += len(passes_file.read_header("a.passes.exr").done) > 0
                for temporary in Path().glob(".relume-*.tmp"):
                    temporary.unlink()
                    in_write += 1
            same += Path("a.exr").read_bytes() == expected
            Path("a.exr").unlink()
            print(f"{k + 1}: {same} the same, {killed} kills, {with_passes} left passes, "
                  f"{in_write} in the middle of a write", file=sys.stderr)  # fmt: skip
    print("| renders | the same picture as without kills | kills | that left passes | "
          "in the middle of a write |\n|---|---|---|---|---|\n"
          f"| {renders} | {same} | {killed} | {with_passes} | {in_write} |")  # fmt: skip


# ---- two workers of one thread, one process of two


def farm_for(client, translation, per_pass):
    """A `Farm` of a translated scene."""
    render = fingerprint.of_render(translation, RenderOptions(), per_pass)
    scene, contents = serialization.pack(translation.scene)
    return Farm(client, remote.Job.of(translation, scene, render, RenderOptions()), contents, print)


def arrivals(passes, accumulator, count):
    """Times at which passes are there and added up [s]."""
    start = time.perf_counter()
    times, seen = [], 0
    for progress in accumulate(passes, accumulator, count, 0):
        if progress.passes > seen:
            seen = progress.passes
            times.append(time.perf_counter() - start)
    return times


def throughput(width=256, height=256, passes=14, repeats=3):
    """Rates from the third pass on, in turn, and the time to start."""
    from relume.cluster import opening

    document = relume.read(SCENE)
    document = resized(document, (width, height), 16 * passes)
    translation = translator.translate(document)
    to_do = PassPlan(16 * passes, 16).passes()
    rates, images = {"one process": [], "two workers": []}, []
    start = time.perf_counter()
    with opening.client(Cluster(workers=2), 2) as client, open_session(translation) as session:
        opened = time.perf_counter() - start
        farm = farm_for(client, translation, 16)
        sources = {"one process": session, "two workers": farm}
        for run in range(repeats):
            for name, source in sources.items():
                accumulator = Accumulator(width, height)
                times = arrivals(source.render(to_do), accumulator, len(to_do))
                rates[name].append((passes - 2) / (times[-1] - times[1]))
                if run == 0:
                    images.append(accumulator.image())
                    print(f"{name}: first pass after {times[0]:.1f} s", file=sys.stderr)
    assert np.array_equal(*images)
    each = [b / a for a, b in zip(*rates.values(), strict=True)]
    rows = {name: statistics.median(values) * 16 * width * height / 1e6
            for name, values in rates.items()}  # fmt: skip
    print("| | M samples/s |\n|---|---|")
    for name, rate in rows.items():
        print(f"| {name} | {rate:.2f} |")
    print(f"\nratio {statistics.median(each):.3f} (of {', '.join(f'{x:.3f}' for x in each)}); "
          f"workers ready after {opened:.1f} s")  # fmt: skip


# ---- cost of a pass to the process that hands it out


def empty_pass(pixels):
    """What a worker returns in place of rendering: no time, the usual size."""
    from relume.cluster import worker

    def render(_key, index, spp):
        sums = np.full((2, 3, pixels), spp, np.float32)
        found = Pass(index, spp, *sums)
        return worker.Rendered(found, 0.0, worker.checksum(found))

    worker._render = render


def cost(client, side, passes):
    """CPU-seconds of this process, scheduler included, for each pass of a square picture."""
    document = resized(relume.read(SCENE), (side, side), passes)
    farm = farm_for(client, translator.translate(document), 1)
    client.run(empty_pass, side * side)
    accumulator = Accumulator(side, side)
    steps = accumulate(farm.render(PassSet([(0, passes, 1)])), accumulator, passes, passes)
    for progress in steps:
        if progress.passes >= 4:
            break
    cpu, wall = time.process_time(), time.perf_counter()
    for _ in steps:
        pass
    return [(now - before) / (passes - 4) for now, before in
            ((time.process_time(), cpu), (time.perf_counter(), wall))]  # fmt: skip


def adding(side, passes=8):
    """CPU-seconds of adding up a pass of noise, and seconds of saving, for a square picture."""
    random = np.random.default_rng(0)
    noise = random.exponential(1, (2, 3, side * side)).astype(np.float32)
    accumulator = Accumulator(side, side)
    accumulator.add(Pass(passes, 1, *noise))
    start = time.process_time()
    for index in range(passes):
        accumulator.add(Pass(index, 1, *noise))
    add = (time.process_time() - start) / passes
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.exr")
        start = time.perf_counter()
        passes_file.write(path, accumulator, passes_file.Header({}, 1, 0.0, 0.0))
        return add, time.perf_counter() - start, path.stat().st_size


def units():
    """Costs at several sizes of picture; the model is fitted to them by hand."""
    from relume.cluster import opening

    print("| picture | bytes of a pass | CPU of a pass [ms] | of adding alone [ms] | saving [ms] | "
          "file [MB] |\n|---|---|---|---|---|---|")  # fmt: skip
    with opening.client(Cluster(workers=2), 2) as client:
        for side, passes in ((16, 304), (256, 104), (512, 44), (1024, 20)):
            cpu, _ = cost(client, side, passes)
            add, save, size = adding(side)
            print(f"| {side}² | {24 * side * side:,} | {cpu * 1e3:.1f} | {add * 1e3:.1f} | "
                  f"{save * 1e3:.0f} | {size / 1e6:.1f} |", flush=True)  # fmt: skip


# ---- the model


def model(fixed, per_pixel, rate, network=1.25e9):
    """Samples of a pixel in a pass at which this process is half busy.

    Args:
        fixed: CPU-seconds of a pass of no pixels.
        per_pixel: CPU-seconds of a pixel of a pass.
        rate: samples/s of a worker.
        network: bytes/s into this process.
    """
    print("| picture | 10 workers | 100 | 1000 |\n|---|---|---|---|")
    for name, pixels in (("256x256", 65536), ("1280x720", 921600), ("1920x1080", 2073600)):
        busy = fixed + max(per_pixel, 24 / network) * pixels
        needed = (2 * workers * rate * busy / pixels for workers in (10, 100, 1000))
        print(f"| {name} | {' | '.join(f'{max(1, np.ceil(n)):.0f}' for n in needed)} |")


MEASUREMENTS = {"kills": kills, "throughput": throughput, "units": units, "model": model}


def add_arguments(parser):
    parser.add_argument("measurement", choices=MEASUREMENTS)
    parser.add_argument("numbers", nargs="*", type=float, help="what its function takes, in order")


def run(options):
    numbers = options.numbers
    if options.measurement != "model":
        numbers = map(int, numbers)
    MEASUREMENTS[options.measurement](*numbers)
