"""The page of the study of convergence: a chart with small pictures for each light, and tables."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from relume.output import encode_display

TAIL = 0.001
"""The share of pixels whose part of the squared error measures the tail."""

BOUND = 0.1
"""A slope is that of an unbiased method if it lies within this of -1."""

HEAVY = 0.25
"""A tail that carries so much of the error, 20 times that of normal noise, explains a slope."""

COLUMNS = 4
TITLES = {
    "area": "A lamp of 5 x 5 overhead",
    "ibl": "A panorama with a small sun",
    "spot": "A spot light",
}


def write_page(folder, cells, pictures):
    """Write `folder.md` and a chart for each light into `folder`.

    Args:
        folder: path; the page is beside it and of the same name.
        cells: figures of the cells, dictionaries (see convergence.py).
        pictures: linear pictures by (material, light).
    """
    lights = list(dict.fromkeys(cell["light"] for cell in cells))
    sections = []
    for light in lights:
        here = [cell for cell in cells if cell["light"] == light]
        file = folder / f"{light}.png"
        chart(here, pictures).savefig(file, dpi=80)
        plt.close("all")
        Image.open(file).convert("RGB").quantize(256).save(file, optimize=True)
        sections.append(section(light, here, folder.name))
    (folder.parent / f"{folder.name}.md").write_text(
        HEAD.format(
            bound=BOUND,
            tail=100 * TAIL,
            cells=len(cells),
            resolved=count(cells),
        )
        + "\n".join(sections)
    )


def count(cells):
    """How many cells have the slope of an unbiased method."""
    return sum(verdict(cell) == "-1" for cell in cells)


def verdict(cell):
    """What a slope and its interval say."""
    off, half = abs(cell["slope"] + 1), cell["slope_plus_minus"]
    if off <= BOUND:
        return "-1" if half <= BOUND else "-1, interval wide"
    return "heavy tail" if cell["tail"] > HEAVY else "not -1"


def section(light, cells, folder):
    """The chart and the table of a light."""
    rows = [
        f"| {cell['material']} | {cell['method']} "
        f"| {error(cell, 64):.3g} | {cell['slope']:.3f} ± {cell['slope_plus_minus']:.3f} "
        f"| {100 * cell['tail']:.0f} % | {verdict(cell)} |"
        for cell in cells
    ]
    return "\n".join(
        [
            f"## {TITLES[light]}",
            "",
            f"![{light}]({folder}/{light}.png)",
            "",
            "| material | method | relMSE at 64 spp | slope | tail | verdict |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def error(cell, spp):
    """Mean relMSE of a cell at that number of samples."""
    return np.mean(cell["errors"][cell["spp"].index(spp)])


def chart(cells, pictures):
    """Error against samples for each cell of a light, its picture in the free corner."""
    rows = -(-len(cells) // COLUMNS)
    figure, axes = plt.subplots(
        rows, COLUMNS, figsize=(11, 2.6 * rows), sharex=True, layout="constrained", squeeze=False
    )
    for ax in axes.flat[len(cells) :]:
        ax.set_axis_off()
    for ax, cell in zip(axes.flat, cells, strict=False):
        spp, errors = np.array(cell["spp"]), np.array(cell["errors"])
        mean = errors.mean(axis=1)
        middle = np.exp(np.log(mean[mean > 0]).mean() - np.log(spp[mean > 0]).mean() * -1)
        ax.loglog(spp, middle / spp, color="0.75", lw=3, label="1 / N")
        ax.loglog(np.repeat(spp, errors.shape[1]), errors.ravel(), ".", color="C0", ms=2, alpha=0.6)
        ax.loglog(spp, mean, "o-", color="C0", ms=3, lw=1)
        ax.set_title(
            f"{cell['material']}: {cell['slope']:.2f} ± {cell['slope_plus_minus']:.2f}", size=9
        )
        ax.tick_params(labelsize=7)
        low, high = mean[mean > 0].min(), mean.max()
        ax.set_ylim(low / 4, high * 4)
        picture = ax.inset_axes([0.02, 0.02, 0.45, 0.45])
        picture.imshow(encode_display(pictures[cell["material"], cell["light"]]))
        picture.set_axis_off()
    figure.supxlabel("samples of a pixel", size=9)
    figure.supylabel("relMSE", size=9)
    return figure


HEAD = """\
# Convergence

A ball of each material on a grey floor, under three lights, 32x32 pixels. At each number of samples
eight independent pictures are held against a reference of 4096 samples a pixel with seeds of its
own: `surfacepath` and `path` against `volpath`, others against themselves. The error
is relMSE, the noise of the reference subtracted. Of an unbiased method whose noise has a finite
variance it falls as 1/N: slope -1 of log error against log N, ± the 95 % interval (jackknife over
the pictures); a bias would end its fall. In {resolved} of {cells} cells it is -1 ± {bound}, with an
interval no wider. The tail is the part of the squared error at 256 samples that {tail:.1f} % of the
pixels carry; of noise that is normal and alike everywhere it would be 1.2 %.

    make study-convergence                        # all cells
    make study-convergence CELLS="glass ibl"      # of these materials and lights alone

The figures are in [cells.json](convergence/cells.json). In the charts the dots are single pictures,
circles their means, and the grey line falls as 1/N.

What is marked *heavy tail* converges too slowly for its slope to be known from these samples: the
floor finds the lamp, or the sun, through a mirror or glass (and holes, which no shadow ray passes)
only when a scattered ray happens to hit its image; into a scattering ball its light comes through
such a boundary, too. These paths are rare and bright. Pictures of few samples mostly miss them and
underrate the error, which makes the line flatter; their scatter makes its interval wide. The tail
says how few pixels carry the error. Cells that are missing from the tables were not measured yet.

How wide, follows. Such a path carries at most l = rho L, the floor's albedo times the radiance of
the lamp, so the variance is finite and the slope of the true error is -1. If it gives the share s
of a mean radiance m, one sample in l / (s m) has it, and N samples of each of P pixels in eight
runs have n = 8 N P s m / l of them: their count is Poisson's, so the error that is measured
scatters by 1/sqrt(n). The sun of the panorama has L = 810: with s m = 0.03, one sample in 13 000
finds it; 4 samples of 1024 pixels in eight runs have 2 or 3, which makes 60 %, and 256 samples have
160, 8 %. `bdpt` does not help here: its slopes beside glass are -0.40 ± 0.49 (lamp) and 0.57 ± 0.46
(panorama) from 4 to 64 samples; light that it brings through glass to the floor meets paths of the
camera as rarely. The random walk under the lamp (-0.89 ± 0.08) is the same case, with a tail that
is half as heavy.

Under the spot light there are no such paths. Light from a point is only found by shadow rays, which
end at mirrors and glass, so what would reach the floor through them is missing from every picture,
the reference's as well: a ball of mirror or glass casts a plain shadow. There -1 says that the
noise is lawful, not that the picture is complete.

"""
