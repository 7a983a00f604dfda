// The views of a comparison: see compare_page.py, which writes the data.
"use strict";
const find = id => document.getElementById(id);
const data = JSON.parse(find("data").textContent);
const {width, height, side, scale, thresholds} = data;
const columns = Math.ceil(width / side);

const arrays = {};
async function unpack(text) {       // high bytes, then low bytes, compressed by zlib
  const zipped = Uint8Array.from(atob(text), character => character.charCodeAt(0));
  const plain = new Blob([zipped]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(plain).arrayBuffer());
  const length = bytes.length / 2;
  return Float32Array.from({length}, (_, i) => half(bytes[i] << 8 | bytes[length + i]));
}
const block = (x, y) => arrays.blocks[Math.floor(y / side) * columns + Math.floor(x / side)];

function sheet() {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  return canvas;
}
const canvas = sheet(), maps = {};

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

function paint(canvas, kind) {
  const context = canvas.getContext("2d"), image = context.createImageData(width, height);
  const pixels = image.data, gain = scale * 2 ** find("exposure").value;
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
}
function draw() {
  const kind = view();
  paint(canvas, kind);
  find("for-split").hidden = kind !== "split";
  find("for-exposure").hidden = !["split", "first", "second"].includes(kind);
  find("for-full").hidden = kind !== "difference";
  find("exposure-text").value = `${Number(find("exposure").value).toFixed(2)} stops`;
  find("full-text").value = `±${(100 * 2 ** find("full").value).toPrecision(2)} %`;
  find("legend").textContent = kind === "split" ? `left ${data.names[0]}, right ${data.names[1]}`
    : legends[kind] || "click or space: flip between the pictures";
  if (maps.difference) paint(maps.difference, "difference");
}
function choose(kind) {
  document.querySelector(`input[name=view][value=${kind}]`).checked = true;
  draw();
}
const flip = () => choose(view() === "first" ? "second" : "first");

function describe(x, y) {
  const i = y * width + x;
  const number = x => Number((scale * x).toPrecision(4));
  const rgb = name => [...arrays[name].slice(3 * i, 3 * i + 3)].map(number).join(" ");
  find("readout").textContent = [
    `(${x}, ${y})`, `${data.names[0]} ${rgb("first")}`, `${data.names[1]} ${rgb("second")}`,
    `difference ${(100 * arrays.difference[i]).toFixed(1)} %`,
    `z ${arrays.z[i].toFixed(1)}, of the block ${block(x, y).toFixed(1)}`,
  ].join(" · ");
}
// A drag moves the line of the split where that is near, else the picture; a click flips.
let split = false;
function drag(x, y, event) {
  const box = canvas.getBoundingClientRect();
  const near = Math.abs(x - find("split").value * width) * box.width / width < 12;
  if (event.type === "pointerdown") split = view() === "split" && near;
  if (split) {
    find("split").value = Math.min(Math.max(x / width, 0), 1);
    draw();
  }
  return split;
}
function build() {
  const stage = find("stage"), frame = document.createElement("div");
  const side = document.createElement("div");
  frame.className = "frame";
  side.className = "maps";
  frame.append(canvas);
  for (const kind of ["difference", "flip"]) {
    if (!arrays[kind]) continue;
    const figure = document.createElement("figure"), caption = document.createElement("figcaption");
    maps[kind] = sheet();
    caption.textContent = document.querySelector(`input[value=${kind}]`).parentNode.textContent;
    figure.append(maps[kind], caption);
    figure.addEventListener("click", () => choose(kind));
    side.append(figure);
    paint(maps[kind], kind);
  }
  stage.replaceChildren(frame, side);
  zoomable(frame, canvas, describe, drag, () => { if (!split) flip(); });
}
async function start() {
  for (const [name, text] of Object.entries(data.arrays)) arrays[name] = await unpack(text);
  build();
  for (const input of document.querySelectorAll("input")) input.addEventListener("input", draw);
  addEventListener("keydown", event => {
    if (event.key !== " " && event.key !== "f") return;
    event.preventDefault();
    flip();
  });
  draw();
  if (data.most) describe(data.most.x, data.most.y);
}
start();
