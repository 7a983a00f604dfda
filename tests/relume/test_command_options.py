"""Options that commands share: one for each field of RenderOptions, and those of clusters."""

import dataclasses

import click
import pytest
from click.testing import CliRunner

from relume.command_options import RENDER_OPTIONS, cluster_options, render_option, scene_options
from relume.options import RenderOptions


def invoke(decorators, *words):
    """The keyword arguments that a command with some options gets, and the result."""
    got = {}

    def command(**options):
        got.update(options)

    for decorator in decorators:
        command = decorator(command)
    return got, CliRunner().invoke(click.command()(command), words)


def test_each_field_has_an_option_with_its_default():
    fields = {field.name: field.default for field in dataclasses.fields(RenderOptions)}
    assert set(RENDER_OPTIONS) == set(fields)
    got, _ = invoke([render_option(name) for name in fields])
    assert got == fields


def test_values_and_what_is_particular_to_a_command(tmp_path):
    decorators = [scene_options, render_option("size", help="Of both."), render_option("spp")]
    folders = ["--asset-path", str(tmp_path), "--asset-path", "."]
    got, _ = invoke(decorators, "--size", "64X48", "--spp", "3", "--dialect", "prender", *folders)
    assert got == {
        "size": (64, 48), "spp": 3, "dialect": "prender", "asset_path": (str(tmp_path), "."),
        "stand_ins": False,
    }  # fmt: skip
    _, result = invoke(decorators, "--help")
    assert "Of both." in result.output and "Size of the picture" not in result.output


@pytest.mark.parametrize(
    "words, said",
    [
        (["--workers", "2", "--cluster", "tcp://a:1"], "give either --workers or --cluster"),
        (["--workers", "2", "--tls-ca", __file__], "--tls-key go together"),
        (["--tls-ca", __file__, "--tls-cert", __file__, "--tls-key", __file__], "with a cluster"),
    ],
)
def test_options_of_clusters_that_do_not_go_together(words, said):
    got, result = invoke([cluster_options], *words)
    assert result.exit_code == 2 and said in result.output and not got


def test_the_cluster_that_a_command_gets():
    got, _ = invoke([cluster_options])
    assert got == {"cluster": None}
    got, _ = invoke([cluster_options], "--workers", "3")
    assert (got["cluster"].workers, got["cluster"].address, got["cluster"].tls) == (3, None, None)
