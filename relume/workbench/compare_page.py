"""The page of `relume compare`: one HTML file that opens from disk and needs nothing else.

Linear pictures and maps are embedded as compressed half floats in base64; the script draws them on
a canvas, so exposure is changed without loss. Without script the two pictures are shown as JPEG. A
content security policy keeps the page from the network.
"""

import base64
import html
import io
import json
import re
import zlib

import numpy as np
from PIL import Image

from relume.output import encode_display
from relume.workbench import estimates, measures
from relume.workbench.compare_table import explanations, tables

HALF_MAX = 65504.0


def page(comparison):
    """The page of a comparison, as text.

    Args:
        comparison: `comparing.Comparison`.
    """
    report = comparison.report()
    names = [html.escape(side.name) for side in comparison.sides]
    images = "".join(
        f'<img alt="{name}" src="data:image/jpeg;base64,{_jpeg(side.estimate.pixels.mean)}">'
        for name, side in zip(names, comparison.sides, strict=True)
    )
    maps = view_data(comparison, report)
    options = (
        ("split", "pictures"),
        ("first", names[0]),
        ("second", names[1]),
        ("difference", "difference"),
        ("z", "z of pixels"),
        ("blocks", "z of blocks"),
        *([("flip", "FLIP")] if comparison.flip else []),
    )
    views = "".join(
        f'<label><input type="radio" name="view" value="{value}"'
        f"{' checked' if value == 'split' else ''}> {label}</label>"
        for value, label in options
    )
    title = f"{html.escape(report['scene'])}: {names[0]} against {names[1]}"
    fields = {
        "TITLE": title,
        "VERDICT": report["verdict"],
        "TEXT": html.escape(report["text"]),
        "VIEWS": views,
        "IMAGES": images,
        "TABLES": "".join(_table(head, rows) for head, rows in tables(report)),
        "EXPLANATIONS": _list(explanations(report)),
        "NOTES": _section("Not rendered as written", _list(report["notes"])),
        "COMMAND": html.escape(report["command"]),
        "VERSIONS": _table(["package", "version"], [list(v) for v in report["versions"].items()]),
        # In JSON `<` stands in strings alone; escaped, nothing in it ends the script element.
        "DATA": json.dumps(maps).replace("<", "\\u003c"),
    }
    # In one pass: what is filled in is not searched.
    return re.sub("@([A-Z]+)@", lambda match: fields[match[1]], TEMPLATE)


def view_data(comparison, report):
    """What the script draws: numbers, and arrays as `packed`, rows from the top.

    Pictures are divided by `scale`; `difference` is the mean over the channels of what relMSE
    squares, with its sign; `z` and `blocks` are those of the channel with the largest |z|.
    """
    a, b = (side.estimate.pixels.mean for side in comparison.sides)
    scale = abs(float(b.mean())) or 1.0
    root = np.sqrt(measures.weight(b))
    pixels, blocks = comparison.scores["pixels"], comparison.scores["blocks"]
    height, width = a.shape[:2]
    arrays = {
        "first": a / scale,
        "second": b / scale,
        "difference": ((a - b) * root).mean(axis=2),
        "z": _largest(pixels.z),
        "blocks": _largest(blocks.z),
    }
    if comparison.flip:
        arrays["flip"] = comparison.flip[0]
    return {
        "width": width,
        "height": height,
        "side": estimates.block_side(height, width),
        "scale": scale,
        "names": [side.name for side in comparison.sides],
        "thresholds": {"z": pixels.threshold, "blocks": blocks.threshold},
        "most": None if comparison.agree else report["most"],
        "arrays": {name: packed(values) for name, values in arrays.items()},
    }


def _largest(z):
    """The score of largest magnitude among the channels."""
    channel = np.abs(z).argmax(axis=2)[..., None]
    return np.take_along_axis(z, channel, axis=2)[..., 0]


def packed(values):
    """Half floats, all high bytes before all low ones, by zlib, in base64."""
    clipped = np.clip(values, -HALF_MAX, HALF_MAX).astype("<f2")
    low, high = clipped.reshape(-1, 1).view(np.uint8).T
    return base64.b64encode(zlib.compress(high.tobytes() + low.tobytes(), 9)).decode()


def _jpeg(picture):
    buffer = io.BytesIO()
    Image.fromarray(encode_display(picture)).save(buffer, format="JPEG", quality=85)
    return base64.b64encode(buffer.getvalue()).decode()


def _table(head, rows):
    def cells(row, tag):
        return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in row)

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    return f"<table><thead><tr>{cells(head, 'th')}</tr></thead><tbody>{body}</tbody></table>"


def _list(sentences):
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def _section(title, content):
    return f"<h2>{title}</h2>{content}" if content else ""


TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>@TITLE@</title>
<style>
:root { color-scheme: light dark; font: 15px/1.5 system-ui, sans-serif; }
body { max-width: 64rem; margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.2rem; margin: 0; }
h2 { font-size: 1rem; margin: 1.5rem 0 .5rem; }
.verdict { font-size: 1.2rem; margin: .25rem 0 1rem; }
.agree { color: light-dark(#17692c, #6fd08a); }
.differ { color: light-dark(#a33a00, #ffa066); }
.bar { display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; align-items: center; }
.bar label { white-space: nowrap; }
.bar input[type=range] { width: 12rem; vertical-align: middle; }
#stage { margin: .5rem 0; display: flex; flex-wrap: wrap; gap: .5rem; }
#stage img { image-rendering: pixelated; }
canvas { width: 100%; max-height: 80vh; object-fit: contain; object-position: left top;
  image-rendering: pixelated; touch-action: none; cursor: crosshair; background: #000; }
#readout { min-height: 1.5em; margin: 0; }
#readout, td, code { font-variant-numeric: tabular-nums; }
.tables { display: flex; flex-wrap: wrap; gap: 1rem 2.5rem; align-items: flex-start; }
table { border-collapse: collapse; }
th, td { padding: .15rem .75rem .15rem 0; text-align: right; border-bottom: 1px solid #8884; }
th:first-child, td:first-child { text-align: left; }
ul { padding-left: 1.2rem; }
code { overflow-wrap: anywhere; }
[hidden] { display: none !important; }
</style>
</head>
<body>
<h1>@TITLE@</h1>
<p class="verdict @VERDICT@">@TEXT@</p>
<div class="bar" role="radiogroup" aria-label="view">@VIEWS@</div>
<div id="stage">@IMAGES@</div>
<div class="bar">
<label id="for-split">split <input type="range" id="split" min="0" max="1" step="0.001"
 value="0.5"></label>
<label id="for-exposure">exposure <input type="range" id="exposure" min="-10" max="10" step="0.25"
 value="0"> <output id="exposure-text"></output></label>
<label id="for-full" hidden>full colour at <input type="range" id="full" min="-10" max="3"
 step="0.5" value="-1"> <output id="full-text"></output></label>
<span id="legend"></span>
</div>
<p id="readout"></p>
<h2>Figures</h2>
<div class="tables">@TABLES@</div>
@EXPLANATIONS@
@NOTES@
<h2>Made by</h2>
<p><code>@COMMAND@</code></p>
@VERSIONS@
<script type="application/json" id="data">@DATA@</script>
<script>
"use strict";
const find = id => document.getElementById(id);
const data = JSON.parse(find("data").textContent);
const {width, height, side, scale, thresholds} = data;
const columns = Math.ceil(width / side);

const half = h => {
  const exponent = h >> 10 & 31, mantissa = h & 1023, sign = h >> 15 ? -1 : 1;
  return sign * (exponent ? (1 + mantissa / 1024) * 2 ** (exponent - 15) : mantissa * 2 ** -24);
};
const arrays = {};
async function unpack(text) {       // high bytes, then low bytes, compressed by zlib
  const zipped = Uint8Array.from(atob(text), character => character.charCodeAt(0));
  const plain = new Blob([zipped]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(plain).arrayBuffer());
  const length = bytes.length / 2;
  return Float32Array.from({length}, (_, i) => half(bytes[i] << 8 | bytes[length + i]));
}
const block = (x, y) => arrays.blocks[Math.floor(y / side) * columns + Math.floor(x / side)];

const canvas = document.createElement("canvas");
canvas.width = width;
canvas.height = height;
const context = canvas.getContext("2d");
const image = context.createImageData(width, height);

const encode = value => 255 * Math.min(Math.max(value, 0), 1) ** (1 / 2.2);
const signed = t => {            // blue below 0, black at 0, red above
  const s = Math.min(Math.abs(t), 1), bright = 255 * s, white = 255 * Math.max(0, 2 * s - 1) * .6;
  return t < 0 ? [white, .5 * bright, bright] : [bright, white, white];
};
const heat = t => [0, 1, 2].map(i => 255 * Math.min(Math.max(3 * Math.sqrt(t) - i, 0), 1));
const view = () => document.querySelector("input[name=view]:checked").value;

function colour(kind, i, x, y) {
  if (kind === "difference") return signed(arrays.difference[i] / 2 ** find("full").value);
  if (kind === "flip") return heat(arrays.flip[i]);
  const z = kind === "z" ? arrays.z[i] : block(x, y);
  return Math.abs(z) > thresholds[kind] ? [255, 230, 0] : signed(.8 * z / thresholds[kind]);
}

const legends = {
  difference: "red: the first is brighter; relative, as in relMSE",
  z: "yellow: beyond the threshold; red: the first is brighter",
  blocks: "yellow: beyond the threshold; red: the first is brighter",
  flip: "from black (the same) to white (plainly different)",
};

function draw() {
  const kind = view(), pixels = image.data;
  const gain = scale * 2 ** find("exposure").value;
  const edge = {split: find("split").value * width, first: width, second: 0}[kind];
  for (let y = 0, i = 0; y < height; y++) for (let x = 0; x < width; x++, i++) {
    if (edge !== undefined) {
      const from = x < edge ? arrays.first : arrays.second;
      for (let c = 0; c < 3; c++) pixels[4 * i + c] = encode(gain * from[3 * i + c]);
    } else {
      const rgb = colour(kind, i, x, y);
      for (let c = 0; c < 3; c++) pixels[4 * i + c] = rgb[c];
    }
    pixels[4 * i + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  if (kind === "split") {
    context.fillStyle = "#fff6";
    context.fillRect(Math.round(edge), 0, Math.max(1, Math.round(width / 800)), height);
  }
  find("for-split").hidden = kind !== "split";
  find("for-exposure").hidden = edge === undefined;
  find("for-full").hidden = kind !== "difference";
  find("exposure-text").value = `${Number(find("exposure").value).toFixed(2)} stops`;
  find("full-text").value = `±${(100 * 2 ** find("full").value).toPrecision(2)} %`;
  find("legend").textContent = kind === "split" ? `left ${data.names[0]}, right ${data.names[1]}`
    : legends[kind] || "";
}

function place(event) {
  const box = canvas.getBoundingClientRect();
  const zoom = Math.min(box.width / width, box.height / height);
  return [(event.clientX - box.left) / zoom, (event.clientY - box.top) / zoom];
}
function tell(x, y) {
  x = Math.floor(x);
  y = Math.floor(y);
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  const i = y * width + x;
  const number = x => Number((scale * x).toPrecision(4));
  const rgb = name => [...arrays[name].slice(3 * i, 3 * i + 3)].map(number).join(" ");
  find("readout").textContent = [
    `(${x}, ${y})`, `${data.names[0]} ${rgb("first")}`, `${data.names[1]} ${rgb("second")}`,
    `difference ${(100 * arrays.difference[i]).toFixed(1)} %`,
    `z ${arrays.z[i].toFixed(1)}, of the block ${block(x, y).toFixed(1)}`,
  ].join(" · ");
}
function point(event) {
  const [x, y] = place(event);
  tell(x, y);
  if (event.buttons && view() === "split") {
    find("split").value = x / width;
    draw();
  }
}
async function start() {
  for (const [name, text] of Object.entries(data.arrays)) arrays[name] = await unpack(text);
  find("stage").replaceChildren(canvas);
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    point(event);
  });
  canvas.addEventListener("pointermove", point);
  for (const input of document.querySelectorAll("input")) input.addEventListener("input", draw);
  draw();
  if (data.most) tell(data.most.x, data.most.y);
}
start();
</script>
</body>
</html>
"""
