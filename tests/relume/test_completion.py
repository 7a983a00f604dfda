"""What the tab key offers, as the shell asks for it."""

import os

import pytest
from click.shell_completion import ShellComplete

from relume.cli import main


def offered(line):
    """What is offered at the end of a command line."""
    *words, incomplete = line.split(" ")
    found = ShellComplete(main, {}, "relume", "_RELUME_COMPLETE").get_completions(words, incomplete)
    return [item.value for item in found]


@pytest.mark.parametrize(
    "line, some",
    [
        ("render --integrator v", {"volpath", "volpathmis"}),
        ("render --integrator sur", {"surfacepath"}),
        ("render --integrator bdp", {"bdpt", "bdpt-merging"}),
        ("chart --method bdp", {"bdpt", "bdpt-merging"}),
        ("render --variant llvm_ad_r", {"llvm_ad_rgb"}),
        ("compare --with pss", {"pssmlt"}),
        ("chart --method dip", {"dipole", "dipole-normalized"}),
        ("stability --method erp", {"erpt"}),
        ("scenes cor", {"cornell"}),
        ("render --tone-map a", {"aces", "agx"}),
        ("render --aov albedo,de", {"albedo,depth", "albedo,denoising_albedo"}),
        ("render --dialect p", {"prender"}),
        ("dev", {"develop"}),
    ],
)
def test_values_are_completed(line, some):
    found = offered(line)
    assert some <= set(found)
    assert all(value.startswith(line.split(" ")[-1]) for value in found)


@pytest.mark.parametrize("command", ["check", "render", "convert", "compare", "chart"])
def test_scenes_are_completed_as_files(command):
    """The shell lists them: click tells it that files are wanted."""
    items = ShellComplete(main, {}, "relume", "_RELUME_COMPLETE").get_completions([command], "sce")
    assert [item.type for item in items] == ["file"]


@pytest.mark.skipif(os.name != "posix", reason="bash")
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_get_their_script(shell, tmp_path):
    """As README.md says how to switch it on."""
    from click.shell_completion import get_completion_class

    made = get_completion_class(shell)(main, {}, "relume", "_RELUME_COMPLETE")
    made._check_version = lambda: None
    assert "_RELUME_COMPLETE" in made.source()
