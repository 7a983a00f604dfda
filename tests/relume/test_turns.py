"""Several threads load, render and free scenes with our plugins at once."""

import subprocess
import sys
import textwrap

import pytest

THREADS = """
import gc, sys, threading
import relume
import mitsuba as mi, numpy as np

def in_threads(work, count=4):
    start, found, errors = threading.Barrier(count), {}, []
    def run(thread):
        start.wait()
        try:
            work(thread, found)
        except BaseException as error:
            errors.append(error)
            raise
    threads = [threading.Thread(target=run, args=(i,)) for i in range(count)]
    for thread in threads: thread.start()
    for thread in threads: thread.join()
    assert not errors, errors
    return found
"""

OWN_SCENES = """
mi.set_variant("llvm_ad_rgb")

def picture(seed):
    # Through other filters samples are added up in any order.
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    balls = {f"ball{i}": {"type": "sphere", "radius": 0.2, "center": [0.4 * i - 0.8, 0, 4],
                          "bsdf": {"type": kind}}
             for i, kind in enumerate(("ward", "phong", "schlickglass", "subsurface"))}
    lamp = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 3, 0]),
            "emitter": {"type": "twosidedarea"}}
    scene = mi.load_dict({
        "type": "scene", "integrator": {"type": "path", "max_depth": 3}, **balls, "lamp": lamp,
        "spot": {"type": "falloffspot", "direction": [0, 0, 1]}, "beam": {"type": "parallelbeam"},
        "sensor": {"type": "screencamera", "width": 0.5, "height": 0.5, "film": film}})
    return np.array(mi.render(scene, spp=2, seed=seed))

def work(thread, found):
    for seed in range(4):
        found[thread, seed] = picture(seed)

alone = [picture(seed) for seed in range(4)]
found = in_threads(work)
assert len(found) == 16
for (thread, seed), image in found.items():
    assert np.array_equal(image, alone[seed]), (thread, seed)
"""

FILES = """
names = ["scenes/ward.txt", "scenes/prism.txt", "scenes/milk.txt", "scenes/spot.txt"]

def picture(name):
    return relume.render(name, size=(16, 12), spp=2, seed=3)

def work(thread, found):
    for i in range(len(names)):
        name = names[(thread + i) % len(names)]
        found[thread, name] = picture(name)

alone = {name: picture(name) for name in names}
found = in_threads(work)
assert len(found) == 16
for (thread, name), image in found.items():
    assert np.array_equal(image, alone[name]), (thread, name)
assert mi.variant() is None or mi.variant() == "llvm_ad_rgb", mi.variant()
"""

FREED = """
import ctypes, weakref
mi.set_variant("llvm_ad_rgb")
freed = []

def work(thread, found):
    bsdf = mi.load_dict({"type": "ward"})
    type(bsdf).__del__ = lambda self: freed.append(self.number)
    bsdf.number = thread

in_threads(work, 2)
mi.load_dict({"type": "diffuse"})
gc.collect()
assert sorted(freed) == [0, 1], freed
"""


@pytest.mark.parametrize("code", [OWN_SCENES, FILES, FREED], ids=["mi", "relume", "freed"])
def test_threads(code):
    """Proves: four threads give the pictures of one, and what they loaded is freed afterwards."""
    code = THREADS + textwrap.dedent(code)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
