"""The page docs/references.md from the figures of peer_corpus.py."""

PLACES = {"on": "ours / theirs on the scattering ball", "off": "elsewhere"}


def table(pictures):
    """The page.

    Args:
        pictures: figures of each picture, dictionaries.
    """
    rows = [row(picture) for picture in pictures if "missing" not in picture]
    causes = [cause(picture) for picture in pictures if "words" in picture]
    absent = ", ".join(f"`{p['name']}` ({p['scene']})" for p in pictures if "missing" in p)
    end = f"\nNot compared, for its scene is not at hand: {absent}.\n" if absent else ""
    stand_in = STAND_IN if any("stand_in" in p for p in pictures) else ""
    return HEAD + "\n".join(rows) + "\n" + stand_in + MIDDLE + "\n".join(causes) + "\n" + end


def row(picture):
    found = picture["as_it_is"]
    star = "\\*" if picture.get("stand_in") else ""
    flip = f"{found['flip']:.2f}"
    return f"| {picture['name']}{star} | {picture['scene']} | {flip} | {cells(found)} |"


def cause(picture):
    ids = ", ".join(f"`{name}`" for name in picture["rows"])
    words = picture["words"]
    for where, (ratio, half) in picture.get("places", {}).items():
        words += f"; {PLACES[where]} {' / '.join(f'{r:.2f}' for r in ratio)} ± {max(half):.2f}"
    found = cells(picture["isolated"]) if "isolated" in picture else "| |"
    return f"| {picture['name']} | {ids}: {words} | {found} |"


def cells(found):
    """Ratio, blocks and verdict of a comparison."""
    ratio = " / ".join(f"{r:.3f}" for r in found["ratio"])
    verdict = "agree" if found["agree"] else "differ"
    return (
        f"{ratio} ± {max(found['plus_minus']):.3f} "
        f"| {found['blocks']} of {found['of_blocks']} | {verdict}"
    )


HEAD = """\
# Pictures of the original program

Linear pictures that the original program rendered, 160x120, with `LUMINANCE_CUTOFF` 0, against ours
of the same scene, environment and size in the dialect that matches old pictures:

    LUMINANCE_CUTOFF=0 ... relume compare SCENE --with PICTURE.exr --dialect prender
    make study-peer-corpus REFERENCES=folder CORPUS=folder ASSETS=folder

The ratio is the mean of ours over that of the picture, in red, green and blue, ± the largest 95 %
interval of the three. Blocks are 10 pixels wide and tested in each channel. The verdict is that of
`relume compare` (all tests together give a false alarm in 1 % of cases). FLIP is the mean of
HDR-FLIP and holds the noise of both.

| picture | scene | FLIP | ours / theirs | blocks found to differ | verdict |
|---|---|---|---|---|---|
"""

STAND_IN = """
\\* A stand-in: the scene itself is not at hand; the same room of another file without its medium.
"""

MIDDLE = """
## Why they differ

Each row names the entries of the [table of dialects](keywords.md) behind the difference. Where the
cause can be isolated, it is: our renderer with that one thing done as the program does it, against
the same picture. These renders are for this table alone; no dialect copies a defect.

| picture | cause | ours with it / theirs | blocks found to differ | verdict |
|---|---|---|---|---|
"""
