"""Reference pictures with the variance of their pixels, kept in a cache by what they show.

A reference is the mean of independent renders with seeds of their own. Its file is an EXR whose
channels R, G, B are the mean; `variance.R` and so on are the variances of the mean of each pixel,
`block variance.R` those of the mean of the block that the pixel lies in (see `statistics`). The
attribute `relume` of its header holds the rest as JSON. Its name in the cache is a hash of the
translated scene with the contents of its files, the method, and the versions of what renders it:
what is found under that name is the picture of that scene.
"""

import dataclasses
import hashlib
import importlib.metadata
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import bsdfs
import emitters
import integrators
import sensors
from relume import output
from relume.session import CannotRender
from relume.workbench import measures, renders, statistics

RUNS = 32
"""Independent renders of a reference."""

FEWEST_RUNS = 8

LAYERS = ("RGB", "variance", "block variance")


@dataclass(frozen=True)
class Reference:
    """What is known of the picture that a scene should give.

    Attributes:
        estimate: `statistics.Estimate`.
        about: `key`, `method`, `spp` of each run, `runs`, `seed`, `seconds`, as JSON values.
    """

    estimate: statistics.Estimate
    about: dict

    @property
    def noise(self):
        """Relative mean squared error of the reference itself: below it nothing can be seen."""
        return measures.noise(self.estimate, self.estimate)


def reference(stage, method, spp, folder, *, seed=0, watch=None):
    """The reference of a scene: from the cache, or rendered and put there.

    Args:
        stage: `methods.Stage`.
        method: the `methods.Method` that renders it.
        spp: samples of a pixel, in all runs together, that it has at least.
        folder: of the cache.
        seed: non-negative integer; a cached reference of any seed will do.
        watch: called with the number of runs done and of all runs; rendering stops if it returns
            True. What was rendered then is used but not kept.

    Returns:
        `Reference`.

    Raises:
        CannotRender: the method does not work here, or it was stopped too early.
        OutputError: the cache cannot be written.
    """
    key = content_key(stage.translated(method))
    path = Path(folder) / f"{key}.exr"
    found = cached(path, key)
    if found and found.about["spp"] * found.about["runs"] >= spp:
        return found
    made = rendered(stage, method, -(-spp // RUNS), seed, watch)
    made.about["key"] = key
    if made.about["runs"] == RUNS:
        write(path, made)
    return made


def rendered(stage, method, spp, seed, watch=None):
    """Render a reference of `RUNS` runs of `spp` samples of a pixel; as `reference`."""
    scene, integrator = stage.load(method)
    runs, seconds = statistics.Runs(), 0.0
    for run in range(RUNS):
        own = renders.own_seed(seed, renders.REFERENCE, run)
        done = renders.render(scene, integrator, spp, own)
        runs.add(done.picture)
        seconds += done.wall
        if watch and watch(run + 1, RUNS):
            break
    if runs.count < FEWEST_RUNS:
        raise CannotRender(f"stopped after {runs.count} of {RUNS} runs of the reference")
    if runs.not_finite:
        raise CannotRender(f"{method.name} gives {runs.not_finite} values that are no numbers")
    about = {"method": method.name, "spp": spp, "runs": runs.count, "seed": seed}
    return Reference(runs.estimate(), about | {"seconds": seconds, "versions": versions()})


def cached(path, key):
    """The reference in a file of the cache; None if there is none or it is not sound."""
    try:
        found = read(path)
    except ValueError:
        return None
    return found if found.about.get("key") == key else None


def cache_folder():
    """The user's folder for references; it may be deleted at any time."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "relume" / "references"


# ---- files


def write(path, reference):
    """Write a reference to an EXR file, whole or not at all.

    Raises:
        OutputError: it cannot be written.
    """
    import OpenEXR

    estimate = reference.estimate
    shape = estimate.pixels.mean.shape
    planes = (
        estimate.pixels.mean,
        estimate.pixels.variance,
        statistics.from_blocks(estimate.blocks.variance, shape),
    )
    about = reference.about | {"variance": estimate.whole.variance.ravel().tolist()}
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "relume": json.dumps(about),
    }
    layers = (np.ascontiguousarray(plane, np.float32) for plane in planes)
    with output.replacing(Path(path)) as temporary:
        OpenEXR.File(header, dict(zip(LAYERS, layers, strict=True))).write(str(temporary))


def read(path):
    """Read a reference from an EXR file.

    Raises:
        ValueError: there is no such file, or it is no sound reference; the message says why.
    """
    import OpenEXR

    if not Path(path).is_file():
        raise ValueError(f"{path}: no such file")
    try:
        file = OpenEXR.File(str(path))
        header, channels = file.header(), file.channels()
        about = json.loads(header["relume"])
        planes = [channels[name].pixels.astype(float) for name in LAYERS]
        mean, variance, of_blocks = planes
        dof = float(about["runs"] - 1)
        whole = np.array(about["variance"], float).reshape(1, 1, 3)
        about["spp"] * about["runs"]
    except (RuntimeError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{path}: no picture with variance: {error}") from None
    sound = all(np.isfinite(x).all() for x in (*planes, whole))
    if not sound or min(variance.min(), of_blocks.min(), whole.min()) < 0 or dof < 1:
        raise ValueError(f"{path}: its numbers are not sound")
    side = statistics.block_side(*mean.shape[:2])
    levels = (
        (mean, variance),
        (statistics.block_means(mean), of_blocks[::side, ::side]),
        (mean.mean(axis=(0, 1), keepdims=True), whole),
    )
    estimate = statistics.Estimate(
        *(statistics.Level(m, v, np.full_like(v, dof)) for m, v in levels)
    )
    return Reference(estimate, about)


def has_variance(path):
    """Whether a file is an EXR that claims to be a reference."""
    import OpenEXR

    if Path(path).suffix.lower() != ".exr" or not Path(path).is_file():
        return False
    try:
        return "relume" in OpenEXR.File(str(path), header_only=True).header()
    except (RuntimeError, ValueError):
        return False


# ---- the key


def content_key(translation):
    """The name of the picture of a translated scene: 32 hexadecimal digits."""
    hasher = hashlib.sha256()
    made_by = [versions(), plugin_sources(), translation.plan.variant]
    _feed(hasher, [*made_by, translation.scene])
    return hasher.hexdigest()[:32]


def versions():
    """Versions of what makes a picture."""
    return {name: importlib.metadata.version(name) for name in ("relume", "mitsuba", "drjit")}


def plugin_sources():
    """Hashes of the source files of relume's plugins, by name."""
    files = [
        file
        for package in (bsdfs, emitters, integrators, sensors)
        for file in Path(package.__file__).parent.rglob("*.py")
    ]
    return {
        f"{file.parent.name}/{file.name}": hashlib.sha256(file.read_bytes()).hexdigest()
        for file in files
    }


def _feed(hasher, value, name=""):
    """Feed a value to a hash; files that it names count by their contents."""
    if dataclasses.is_dataclass(value):
        hasher.update(type(value).__name__.encode())
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        hasher.update(f"dict {len(value)}".encode())
        for key in sorted(value):
            hasher.update(f"{key!r}:".encode())
            _feed(hasher, value[key], key)
    elif isinstance(value, list | tuple):
        hasher.update(f"list {len(value)}".encode())
        for item in value:
            _feed(hasher, item)
    elif isinstance(value, np.ndarray):
        hasher.update(f"array {value.dtype.str} {value.shape}".encode())
        hasher.update(np.ascontiguousarray(value).tobytes())
    elif name == "filename":
        hasher.update(hashlib.sha256(Path(value).read_bytes()).digest())
    elif value is None or isinstance(value, str | bool | int | float | np.generic):
        hasher.update(f"{value!r};".encode())
    else:
        raise TypeError(f"{name}: a {type(value).__name__} is no plain value")
