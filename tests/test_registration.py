"""Plugins exist under every variant, whether it is set before or after they are imported."""

import subprocess
import sys
import textwrap

import pytest

ONE_OF_EACH = """
def one_of_each():
    mi.load_dict({"type": "ward"})
    mi.load_dict({"type": "schlickglass"})
    mi.load_dict({"type": "falloffspot"})
    mi.load_dict({"type": "surfacepath"})
    mi.load_dict({"type": "hgrgb"})
    mi.load_dict({"type": "screencamera", "width": 1.0, "height": 1.0})
"""


def run(code):
    """Run code in a fresh process in which every warning is an error."""
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(code)]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.parametrize(
    "code",
    [
        # after
        "import relume\nimport mitsuba as mi\n@\n"
        "for name in ('llvm_ad_rgb', 'llvm_ad_spectral'):\n"
        "    mi.set_variant(name)\n    one_of_each()",
        # before: llvm.install is what `import relume` does first
        "from relume import llvm\nllvm.install()\nimport mitsuba as mi\n"
        "mi.set_variant('llvm_ad_rgb')\nimport relume\n@\none_of_each()\n"
        "mi.set_variant('llvm_ad_spectral')\none_of_each()",
        # again and again
        "import relume\nimport mitsuba as mi\n@\n"
        "for _ in range(3):\n    for name in ('llvm_ad_rgb', 'llvm_ad_spectral', 'scalar_rgb'):\n"
        "        mi.set_variant(name)\nmi.set_variant('llvm_ad_rgb')\none_of_each()",
        # any module of relume
        "import relume.bsdfs\nimport mitsuba as mi\n@\n"
        "mi.set_variant('llvm_ad_rgb')\none_of_each()",
    ],
    ids=["after", "before", "again", "by a module"],
)
def test_plugins_are_registered(code):
    done = run(code.replace("@", ONE_OF_EACH))
    assert done.returncode == 0, done.stderr


def test_importing_relume_sets_no_variant_and_prints_nothing():
    done = run("import relume, mitsuba as mi\nassert mi.variant() is None")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_nothing_is_loaded_before_a_scene_uses_it():
    """A change of variant may cost no more than twice its bare time: no plugin, no NumPy."""
    done = run(
        "import relume, sys, mitsuba as mi\n"
        "mi.set_variant('scalar_rgb')\n"
        "loaded = [name for name in sys.modules if name.startswith(('relume.bsdfs.', 'relume.e',"
        " 'relume.integrators.', 'relume.phasefunctions.',"
        " 'relume.samplers.', 'relume.sensors.'))]\n"
        "print(sorted(set(loaded) - {'relume.emitters'}))\n"
        "mi.set_variant('llvm_ad_rgb')\n"
        "mi.load_dict({'type': 'ward'})\n"
        "assert 'relume.bsdfs.ward' in sys.modules and 'relume.bsdfs.phong' not in sys.modules"
    )
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


def test_a_class_is_defined_once_where_several_threads_load():
    """Proves: sixteen threads that ask for a plugin at once get instances of one class."""
    done = run(
        "import relume, threading, mitsuba as mi\n"
        "mi.set_variant('llvm_ad_rgb')\n"
        "start, made = threading.Barrier(16), []\n"
        "def make():\n"
        "    start.wait()\n"
        "    made.append(mi.load_dict({'type': 'surfacepath'}))\n"
        "threads = [threading.Thread(target=make) for _ in range(16)]\n"
        "for thread in threads: thread.start()\n"
        "for thread in threads: thread.join()\n"
        "print(len(made), len({type(path) for path in made}))"
    )
    assert (done.returncode, done.stdout) == (0, "16 1\n"), done.stderr


def test_a_thread_finds_the_plugins_complete():
    """It sets the variant that another thread has just set, whose plugins are being registered."""
    done = run(
        """
        import threading, time, types
        import relume, mitsuba as mi
        from relume import registration
        began = threading.Event()
        def slow(function, *arguments):
            began.set()
            time.sleep(0.05)
            return functools.partial(function, *arguments)
        functools = registration.functools
        registration.functools = types.SimpleNamespace(partial=slow)
        other = threading.Thread(target=mi.set_variant, args=("llvm_ad_rgb",))
        other.start()
        assert began.wait(60)
        mi.set_variant("llvm_ad_rgb")
        @
        one_of_each()
        other.join()
        """.replace("@", textwrap.indent(ONE_OF_EACH, 8 * " "))
    )
    assert done.returncode == 0, done.stderr


def test_a_plugin_of_the_user_is_defined_under_the_variant_that_is_set():
    done = run(
        """
        import relume, mitsuba as mi
        from relume.registration import on_every_variant
        mi.set_variant("llvm_ad_rgb")
        seen = []
        on_every_variant(lambda: seen.append(mi.variant()))
        for name in ("scalar_rgb", "llvm_ad_rgb", "scalar_rgb"):
            mi.set_variant(name)
        assert seen == ["llvm_ad_rgb", "scalar_rgb"], seen
        """
    )
    assert done.returncode == 0, done.stderr
