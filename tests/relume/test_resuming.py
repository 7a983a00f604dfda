"""Renders that are stopped, killed, gone on with, and rendered in parts: the same picture."""

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from relume import checkpoint, cli, output, passes, passes_file, rendering, session

SPP = 12


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working directory; passes of one sample, saved after each."""
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.setattr(passes, "SAMPLES_PER_PASS", 32 * 24)
    monkeypatch.setattr(checkpoint, "INTERVAL", 0)
    monkeypatch.setattr(checkpoint, "SHARE", 1e9)
    return folder


@pytest.fixture
def console():
    return Console(record=True, file=io.StringIO(), width=200)


@pytest.fixture
def stopping(monkeypatch):
    """A function that makes the next render end by an error after some passes."""
    real = session.Session.render_pass

    def after(count):
        def render_pass(self, index, spp):
            nonlocal count
            count -= 1
            if count < 0:
                raise KeyboardInterrupt
            return real(self, index, spp)

        monkeypatch.setattr(session.Session, "render_pass", render_pass)

    yield after


def render(path, out, console=None, **options):
    console = console or Console(file=io.StringIO())
    kept = {name: options.pop(name) for name in ("resume", "keep", "only", "per_pass")
            if name in options}  # fmt: skip
    passes = rendering.PassOptions(**kept)
    options = {"spp": SPP} | options
    return rendering.render_file(path, out=out, passes=passes, console=console, **options)


def left_after(count, path, stopping, **options):
    """Leave the passes of a render that dies after `count` of them."""
    stopping(count)
    with pytest.raises(KeyboardInterrupt):
        render(path, "a.exr", **options)
    stopping(10**9)


# ---- going on


@pytest.mark.parametrize("integrator", ["path", "ptracer"])
def test_a_render_that_died_goes_on_to_the_same_picture(room, here, stopping, integrator):
    """`ptracer` scatters into the film, so with one thread: the order would change its bits."""
    path = room("THREAD\n1")
    (expected,) = render(path, "whole.exr", integrator=integrator)
    left_after(5, path, stopping, integrator=integrator)
    assert passes_file.read("a.passes.exr").done.ranges() == "0:5"
    (picture,) = render(path, "a.exr", integrator=integrator, resume=True)
    assert picture.read_bytes() == expected.read_bytes()
    assert not Path("a.passes.exr").exists()


def test_an_interrupted_render_goes_on(room, here, console, monkeypatch):
    (expected,) = render(room(), "whole.exr")
    (picture,) = render(room(), "a.exr", console, time_limit=0)
    assert "--resume goes on" in console.export_text()
    assert picture.read_bytes() != expected.read_bytes()
    (picture,) = render(room(), "a.exr", resume=True)
    assert picture.read_bytes() == expected.read_bytes()


def test_a_finished_render_gets_more_samples(room, here):
    (expected,) = render(room(), "whole.exr", spp=20)
    render(room(), "a.exr", keep=True)
    (picture,) = render(room(), "a.exr", spp=20, resume=True)
    assert picture.read_bytes() == expected.read_bytes()


def test_with_nothing_left_to_do_the_picture_is_written_at_once(room, here, stopping):
    (expected,) = render(room(), "a.exr", keep=True)
    data = expected.read_bytes()
    expected.unlink()
    stopping(0)
    (picture,) = render(room(), "a.exr", resume=True)
    assert picture.read_bytes() == data


def test_the_time_of_all_parts_is_in_the_name(room, here, stopping):
    path = room("OUTPUT\nbox.exr")
    render(path, "first/", time_limit=0)
    header = passes_file.read_header("first/box.passes.exr")
    accumulator = passes_file.read("first/box.passes.exr")
    late = passes_file.Header(header.render, header.spp, 86400.0, header.gamma)
    passes_file.write("first/box.passes.exr", accumulator, late)
    picture, _ = render(path, "first/", resume=True)
    assert picture.name.startswith("box_12x1_8640")


# ---- what is refused


@pytest.mark.parametrize(
    "options, reason",
    [
        ({"seed": 4}, "its seed is 0, here 4"),
        ({"size": (16, 12)}, "its size is 32x24, here 16x12"),
        ({"integrator": "direct"}, "its integrator is surfacepath, here direct"),
        ({"variant": "scalar_rgb"}, "its variant is llvm_ad_rgb, here scalar_rgb"),
        ({"per_pass": 3}, "its number of samples of a pixel in a pass is 1, here 3"),
        ({"dialect": "prender"}, "its scene has another content"),
    ],
)
def test_passes_of_another_render_are_refused_with_the_reason(
    room, here, stopping, options, reason
):
    left_after(2, room(), stopping)
    before = Path("a.passes.exr").read_bytes()
    with pytest.raises(session.CannotRender, match=reason):
        render(room(), "a.exr", resume=True, **options)
    assert Path("a.passes.exr").read_bytes() == before


def test_passes_of_another_version_or_scene_are_refused(room, here, stopping, monkeypatch):
    left_after(2, room(), stopping)
    with pytest.raises(session.CannotRender, match="its scene has another content"):
        render(room("LENS\n0.3 14"), "a.exr", resume=True)
    monkeypatch.setattr("importlib.metadata.version", lambda name: "9.9")
    with pytest.raises(session.CannotRender, match=r"its mitsuba is \d.*, here 9\.9"):
        render(room(), "a.exr", resume=True)


def test_passes_are_not_lost_to_a_forgotten_option(room, here, stopping, console):
    left_after(2, room(), stopping)
    with pytest.raises(session.CannotRender, match="holds 2 samples per pixel of this render"):
        render(room(), "a.exr")
    render(room(), "a.exr", console, seed=1)
    assert "a.passes.exr is of another render and will be replaced" in console.export_text()


def test_damaged_passes_are_told(room, here):
    Path("a.passes.exr").write_bytes(b"junk")
    with pytest.raises(passes_file.NoPasses, match=r"a\.passes\.exr"):
        render(room(), "a.exr", resume=True)
    render(room(), "a.exr")


def test_what_killed_renders_left_half_written_is_removed(room, here, stopping):
    """Only of the same file: another render may be writing beside it."""
    left_after(2, room(), stopping)
    for name in ("a.passes.exr", "b.passes.exr"):
        with pytest.raises(KeyboardInterrupt), output.replacing(here / name) as temporary:
            Path(temporary).write_bytes(b"half")
            os.link(temporary, f"kept-{name}")
            raise KeyboardInterrupt
        os.rename(f"kept-{name}", temporary)
    assert len(list(here.glob(".relume-*.tmp"))) == 2
    render(room(), "a.exr", resume=True)
    assert list(here.glob(".relume-*.tmp")) == [temporary]


def test_resuming_what_never_began_begins(room, here, console):
    (expected,) = render(room(), "whole.exr")
    (picture,) = render(room(), "a.exr", console, resume=True)
    assert "beginning with the first" in console.export_text()
    assert picture.read_bytes() == expected.read_bytes()


# ---- saving


def test_a_render_goes_on_when_saving_fails(room, here, console, monkeypatch):
    (expected,) = render(room(), "whole.exr")

    def fail(*_):
        raise output.OutputError("cannot write it: no space")

    monkeypatch.setattr(passes_file, "write", fail)
    (picture,) = render(room(), "a.exr", console)
    assert console.export_text().count("no space; the render goes on") == 1
    assert picture.read_bytes() == expected.read_bytes()


def test_saving_takes_a_small_share_of_the_time(monkeypatch, tmp_path, console):
    """Saves of 1 s each: the next one comes 50 s later; quick ones come every 2 s."""
    keeper = checkpoint.Checkpoint(tmp_path / "a.exr", None, console)
    saved, clock = [], [0.0]
    monkeypatch.setattr(checkpoint.time, "perf_counter", lambda: clock[0])

    def save(_, seconds):
        saved.append(seconds)
        clock[0] += 1 if seconds < 100 else 0

    monkeypatch.setattr(keeper, "save", save)
    for seconds in range(120):
        keeper.offer(None, float(seconds))
    assert saved[:3] == [2, 52, 102] and saved[3:5] == [104, 106]
    saved.clear()
    keeper.begin(1000, 400, resume=False)  # 0.2 s are expected: not before 10 s
    for seconds in range(12):
        keeper.offer(None, float(seconds))
    assert saved == [10]


def test_the_passes_of_another_process_are_not_removed(room, here, monkeypatch):
    real = checkpoint.Checkpoint.save

    def save(self, accumulator, seconds):
        real(self, accumulator, seconds)
        other = self.path.with_name("other")
        other.write_bytes(b"of another process")
        os.replace(other, self.path)

    monkeypatch.setattr(checkpoint.Checkpoint, "save", save)
    render(room(), "a.exr")
    assert Path("a.passes.exr").read_bytes() == b"of another process"


def test_killed_at_once_it_goes_on_to_the_same_picture(room, here):
    """SIGKILL to the command line as soon as its passes appear, three times.

    It waits after each save, so that the signal comes before the end.
    """
    setup = "from relume import cli, checkpoint, passes\npasses.SAMPLES_PER_PASS = 32 * 24 * 8\n"
    setup += "checkpoint.INTERVAL = 0; checkpoint.SHARE = 1e9\n"
    words = ["render", str(room()), "--spp", "400", "-o"]
    slow = (
        "import time\nsave = checkpoint.Checkpoint.save\n"
        "checkpoint.Checkpoint.save = lambda *told: (save(*told), time.sleep(0.5))\n"
    )
    killed, whole = ([sys.executable, "-c", f"{setup}{more}cli.main()"] for more in (slow, ""))
    seen = 0
    for _ in range(3):
        process = subprocess.Popen(
            [*killed, *words, "a.exr", "--resume"], stderr=subprocess.DEVNULL
        )
        while process.poll() is None and saved_passes() <= seen:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
        seen = saved_passes()
    assert 3 <= seen < 50
    for options in (["a.exr", "--resume"], ["whole.exr"]):
        subprocess.run([*whole, *words, *options], check=True, capture_output=True)
    assert Path("a.exr").read_bytes() == Path("whole.exr").read_bytes()


def saved_passes():
    try:
        return len(passes_file.read_header("a.passes.exr").done)
    except passes_file.NoPasses:
        return 0


# ---- parts


def invoke(*words):
    return CliRunner().invoke(cli.main, [str(word) for word in words])


def parts(path, *ranges, **options):
    """Render ranges of passes, each into a file of its own; returns their names."""
    names = []
    for start, stop in ranges:
        names.append(f"part{start}.exr")
        render(path, names[-1], only=(start, stop), **options)
    return names


def test_parts_give_the_same_picture_in_any_order(room, here):
    """Also parts that were merged before, and goes on from what is missing."""
    (expected,) = render(room("gamma_offset\n0.4"), "whole.exr")
    a, b, c = parts(room("gamma_offset\n0.4"), (0, 3), (3, 4), (7, 12))
    result = invoke("merge", c, a, "-o", "ac.passes.exr")
    assert result.exit_code == 3 and "passes 3:7 are missing" in result.stderr
    result = invoke("merge", b, "ac.passes.exr", "-o", "abc.passes.exr")
    assert "passes 4:7 are missing" in result.stderr
    render(room("gamma_offset\n0.4"), "abc.exr", resume=True)
    assert Path("abc.exr").read_bytes() == expected.read_bytes()
    (d,) = parts(room("gamma_offset\n0.4"), (4, 7))
    result = invoke("merge", d, b, c, a, "-o", "out.exr")
    assert result.exit_code == 0 and result.stdout.split() == ["out.exr"]
    assert Path("out.exr").read_bytes() == expected.read_bytes()
    pictures = [f"{name}.exr" for name in ("out", "whole", "abc")]
    assert sorted(os.listdir()) == sorted([*pictures, a, b, c, d, "ac.passes.exr"])


def test_parts_that_do_not_fit_are_refused(room, here):
    a, b = parts(room(), (0, 3), (2, 4))
    (c,) = parts(room(), (5, 6), seed=1)
    for words, message in (
        ((a, b), "part2.exr and part0.exr share the passes 2:3"),
        ((a, c), "part5.exr does not belong to part0.exr: its seed is 1, here 0"),
        ((a, "none.exr"), "none.exr: no such file"),
    ):
        result = invoke("merge", *words, "-o", "out.exr")
        assert result.exit_code == 1 and message in result.stderr
    result = invoke("merge", a, "-o", a)
    assert result.exit_code == 1 and "part0.exr is one of the parts" in result.stderr
    assert not Path("out.exr").exists()


def test_passes_that_do_not_exist_are_refused(room, here):
    with pytest.raises(ValueError, match="passes 10:13: expected some of 0:12"):
        render(room(), "a.exr", only=(10, 13))
    for out in ("a.png", "folder/", None):
        with pytest.raises(output.OutputError, match="to a file that -o names"):
            render(room(), out, only=(0, 1))
    result = invoke("render", room(), "--passes", "3:3", "-o", "a.exr")
    assert result.exit_code == 2 and "expected START:STOP" in result.stderr
