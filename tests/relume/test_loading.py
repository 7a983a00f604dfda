"""The steps from a document to a loaded scene: size and samples, variants, threads, refusals."""

import os
import subprocess
import sys

import drjit as dr
import pytest

import relume
from relume import llvm, loading, translator
from relume.session import CannotRender

GLASS = "OBJECT\nsphere 0 1 2 1\ncolor 1 1 1\nreflection reflection\n"


def test_spp_replaces_sampling_and_supersampling(room):
    document = loading.resized(relume.read(room("SUPERSAMPLING\n3")), spp=5)
    assert (document.sampling, document.supersampling) == (5, 1)
    assert translator.translate(document).plan.spp == 5


def test_threads_are_as_before(room):
    """With one thread left behind, Mitsuba never finishes to write an EXR file."""
    before = dr.thread_count()
    assert before > 1
    relume.render(room("THREAD\n1"), spp=1)
    assert dr.thread_count() == before


def test_an_exr_file_is_written_after_a_render_on_one_thread(tmp_path, room):
    """In a process of its own, since Mitsuba waits for ever where it goes wrong."""
    code = f"""
import relume, drjit as dr, mitsuba as mi, numpy as np
picture = relume.render({str(room("THREAD" + chr(10) + "1"))!r}, spp=1, size=(8, 6))
mi.Bitmap(picture).write("after.exr")
assert np.array(mi.Bitmap("after.exr")).shape == (6, 8, 3)
"""
    environment = dict(os.environ, OMP_NUM_THREADS="1")
    command = [sys.executable, "-c", code]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, timeout=120)


def test_without_llvm_scenes_of_stock_plugins_render_slowly(room, monkeypatch):
    nothing = llvm.Library(None, "none", reason="no usable LLVM library")
    monkeypatch.setattr(llvm, "install", lambda: nothing)
    with pytest.warns(UserWarning, match="rendering slowly with scalar_rgb: no usable LLVM"):
        assert relume.render(room(), size=(4, 3), spp=1).shape == (3, 4, 3)


def test_without_llvm_scenes_of_other_plugins_say_what_they_need(room, monkeypatch):
    nothing = llvm.Library(None, "none", reason="no usable LLVM library")
    monkeypatch.setattr(llvm, "install", lambda: nothing)
    with pytest.raises(CannotRender, match="the scene needs schlickglass: no usable LLVM"):
        relume.render(room(objects=GLASS))
    with pytest.raises(CannotRender, match="llvm_ad_rgb does not work here"):
        relume.render(room(), variant="llvm_ad_rgb")


def test_what_mitsuba_refuses_is_said_in_one_line(room):
    translation = translator.translate(relume.read(room()))
    translation.scene["sensor"]["fov"] = 200.0
    with (
        pytest.raises(CannotRender, match=r"Mitsuba does not take the scene: .*sensor") as error,
        loading.open_session(translation),
    ):
        pass
    assert "\n" not in str(error.value)
