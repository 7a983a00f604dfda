// A canvas that fills its frame and is zoomed to its pixels: wheel or + and -, drag, double click.
"use strict";

// point(x, y, event) gets the pixel under the pointer; drag(x, y, event) may return true to take a
// drag for itself; click() is called for a press without a drag. The frame's height follows from the
// picture's shape.
function zoomable(frame, canvas, point, drag = () => false, click = () => {}) {
  let scale = 1, left = 0, top = 0, from = null, taken = false, moved = false;
  const fit = () => Math.min(frame.clientWidth / canvas.width, frame.clientHeight / canvas.height);
  const clamp = (value, size, room) => size <= room ? (room - size) / 2
    : Math.min(0, Math.max(room - size, value));
  function lay() {
    frame.style.width = "100%";
    const width = Math.min(frame.clientWidth, .7 * innerHeight * canvas.width / canvas.height);
    frame.style.width = `${width}px`;
    frame.style.height = `${width * canvas.height / canvas.width}px`;
    const zoom = fit() * scale;
    left = clamp(left, canvas.width * zoom, frame.clientWidth);
    top = clamp(top, canvas.height * zoom, frame.clientHeight);
    canvas.style.transform = `translate(${left}px, ${top}px) scale(${zoom})`;
  }
  function place(event) {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width * canvas.width,
            (event.clientY - box.top) / box.height * canvas.height];
  }
  function inside([x, y]) {
    return x >= 0 && y >= 0 && x < canvas.width && y < canvas.height;
  }
  function zoom(factor, x, y) {       // about a point of the frame
    const before = fit() * scale, most = 64 / fit();
    scale = Math.min(Math.max(scale * factor, 1), Math.max(most, 1));
    const ratio = fit() * scale / before;
    left = x - (x - left) * ratio;
    top = y - (y - top) * ratio;
    lay();
  }
  frame.addEventListener("wheel", event => {
    event.preventDefault();
    const box = frame.getBoundingClientRect();
    zoom(2 ** (-event.deltaY / 300), event.clientX - box.left, event.clientY - box.top);
  }, {passive: false});
  frame.addEventListener("pointerdown", event => {
    frame.setPointerCapture(event.pointerId);
    from = [event.clientX - left, event.clientY - top];
    taken = drag(...place(event), event);
    moved = false;
  });
  frame.addEventListener("pointermove", event => {
    const at = place(event);
    if (inside(at)) point(Math.floor(at[0]), Math.floor(at[1]), event);
    if (!from) return;
    moved ||= Math.hypot(event.clientX - left - from[0], event.clientY - top - from[1]) > 3;
    if (taken) drag(...at, event);
    else if (moved) {
      left = event.clientX - from[0];
      top = event.clientY - from[1];
      lay();
    }
  });
  frame.addEventListener("pointerup", () => {
    if (from && !moved) click();
    from = null;
  });
  frame.addEventListener("pointercancel", () => from = null);
  frame.addEventListener("dblclick", () => { scale = 1; lay(); });
  addEventListener("keydown", event => {
    if (event.target.matches("input[type=text]") || event.ctrlKey || event.metaKey) return;
    const factor = {"+": 2, "=": 2, "-": .5, "0": 1e-9}[event.key];
    if (factor) zoom(factor, frame.clientWidth / 2, frame.clientHeight / 2);
  });
  addEventListener("resize", lay);
  lay();
  return lay;
}

const half = h => {
  const exponent = h >> 10 & 31, mantissa = h & 1023, sign = h >> 15 ? -1 : 1;
  return sign * (exponent ? (1 + mantissa / 1024) * 2 ** (exponent - 15) : mantissa * 2 ** -24);
};
const encode = value => 255 * Math.min(Math.max(value, 0), 1) ** (1 / 2.2);
