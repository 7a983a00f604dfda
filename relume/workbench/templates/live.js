// The page of a running render: see relume/live.py, which serves what it asks for.
"use strict";
const find = id => document.getElementById(id);
const canvas = document.createElement("canvas");
let shown = -1, pixels = null, lay = null, ended = false, stopping = false;

function duration(seconds) {
  const unit = [[86400, "days"], [3600, "h"], [60, "min"], [1, "s"]].find(([u]) => seconds >= 2 * u)
    || [1, "s"];
  return `${Number((seconds / unit[0]).toPrecision(2))} ${unit[1]}`;
}
const percent = ratio => `${Number((100 * ratio).toPrecision(2))} %`;

function draw() {
  if (!pixels) return;
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  const gain = 2 ** find("exposure").value;
  for (let i = 0, k = 0; i < pixels.length; k++) {
    for (let c = 0; c < 3; c++) image.data[4 * k + c] = encode(gain * pixels[i++]);
    image.data[4 * k + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  find("exposure-text").value = `${Number(find("exposure").value).toFixed(2)} stops`;
}
function point(x, y) {
  const rgb = pixels.slice(3 * (y * canvas.width + x), 3 * (y * canvas.width + x) + 3);
  find("readout").textContent =
    `(${x}, ${y})  ${[...rgb].map(v => Number(v.toPrecision(4))).join("  ")}`;
}
async function picture(state) {
  const answer = await fetch("picture", {cache: "no-store"});
  if (!answer.ok) return;
  const halves = new Uint16Array(await answer.arrayBuffer());
  pixels = Float32Array.from(halves, half);
  if (!lay) {
    canvas.width = state.width;
    canvas.height = state.height;
    find("frame").append(canvas);
    lay = zoomable(find("frame"), canvas, point);
  }
  shown = state.picture;
  draw();
}

// Noise over time, both logarithmic: it falls along a line of slope -1/2.
function chart(state) {
  const context = find("chart").getContext("2d"), {width, height} = find("chart");
  const points = state.history.filter(([t, n]) => t > 0 && n > 0);
  context.clearRect(0, 0, width, height);
  if (points.length < 2) return;
  const last = points[points.length - 1];
  const end = Math.max(last[0] * 4, points[0][0] * 10);
  const low = Math.min(last[1] / 3, .04), high = Math.max(...points.map(p => p[1])) * 1.2;
  const x = t => 60 + (width - 70) * Math.log(t / points[0][0]) / Math.log(end / points[0][0]);
  const y = n => 10 + (height - 50) * Math.log(high / n) / Math.log(high / low);
  context.font = "20px system-ui";
  context.fillStyle = context.strokeStyle = "#9aa0a8";
  context.lineWidth = 1;
  for (const n of [.001, .002, .005, .01, .02, .05, .1, .2, .5, 1, 2, 5, 10]) {
    if (n < low || n > high) continue;
    context.fillText(percent(n), 0, y(n) + 6);
    context.globalAlpha = .3;
    context.strokeRect(60, y(n), width - 70, 0);
    context.globalAlpha = 1;
  }
  context.fillText(duration(points[0][0]), 60, height - 8);
  context.fillText(duration(end), width - 80, height - 8);
  const line = (from, style, dash) => {
    context.beginPath();
    context.setLineDash(dash);
    from.forEach(([t, n], i) => context[i ? "lineTo" : "moveTo"](x(t), y(n)));
    context.strokeStyle = style;
    context.lineWidth = 3;
    context.stroke();
    context.setLineDash([]);
  };
  line(points, "#56b4e9", []);
  line([last, [end, last[1] * Math.sqrt(last[0] / end)]], "#56b4e9", [6, 6]);
}

function tell(state) {
  const left = goal => {
    if (!state.noise) return "–";
    if (state.noise <= goal) return "reached";
    const more = state.seconds * ((state.noise / goal) ** 2 - 1);
    return state.ended ? `${duration(more)} more` : `in ${duration(more)}`;
  };
  find("status").textContent =
    state.ended || (stopping ? "stops after this pass" : "renders");
  find("spp").textContent = state.all_spp ? `${state.spp} of ${state.all_spp}` : state.spp;
  find("passes").textContent = `${state.passes} of ${state.all_passes}`;
  find("rate").textContent = `${(state.rate / 1e6).toFixed(2)} M`;
  find("seconds").textContent = duration(state.seconds);
  find("noise").textContent = state.noise ? percent(state.noise) : "–";
  find("eta5").textContent = left(.05);
  find("eta1").textContent = left(.01);
  if (state.ended) find("stop").disabled = true;
  chart(state);
}

async function look() {
  try {
    const answer = await fetch("state", {cache: "no-store"});
    const state = await answer.json();
    if (state.picture !== shown && state.picture >= 0) await picture(state);
    tell(state);
    ended = Boolean(state.ended);
    if (ended) await fetch("seen", {method: "POST"});
  } catch (error) {
    find("status").textContent = "the render has ended";
    find("stop").disabled = true;
    ended = true;
  }
  if (!ended) setTimeout(look, 500);
}
find("exposure").addEventListener("input", draw);
find("auto").addEventListener("click", () => {
  const Y = [];
  for (let i = 0; i < pixels.length; i += 3) {
    const y = .2126 * pixels[i] + .7152 * pixels[i + 1] + .0722 * pixels[i + 2];
    if (y > 0) Y.push(y);
  }
  if (!Y.length) return;
  const least = Y.sort((a, b) => a - b)[Math.floor(.99 * (Y.length - 1))] * 1e-3;
  const logs = Y.filter(y => y >= least).map(Math.log2);
  find("exposure").value = Math.log2(.18) - logs.reduce((a, b) => a + b) / logs.length;
  draw();
});
find("stop").addEventListener("click", async () => {
  find("stop").disabled = stopping = true;
  await fetch("stop", {method: "POST"});
});
look();
