// SPDX-License-Identifier: MIT
// Axes after x, y, z: each over arc length, as the program has it, where the setpoints went, where the axis went.
// Used by page.js. Makes its elements in the document, and draws on their canvases.

import { digitsOf, prepare, roundUp, text } from "./scale.js";
import { Ring } from "./store.js";

const POINTS = 12288;
const STEPS = 4; // at most, between the lines of a scale
const LEFT = 62, RIGHT = 8, TOP = 6, BOTTOM = 16;

export class AxisCurves {
  constructor(parent) {
    this.parent = parent;
    this.setAxes([], []);
  }

  /** Names and units of the axes after x, y, z. */
  setAxes(names, units) {
    this.names = names;
    this.units = units;
    this.path = { arc: [], extra: [] };
    this.program = null;
    this.points = new Ring(POINTS, ["s", ...names.flatMap((_, k) => [`c${k}`, `a${k}`])]);
    this.parent.replaceChildren();
    this.curves = names.map((name, k) => {
      const box = document.createElement("div");
      box.className = "chart";
      const title = document.createElement("div");
      title.className = "title";
      const head = document.createElement("b"), now = document.createElement("span");
      head.textContent = `Axis ${name} over arc length`;
      title.append(head, now);
      const frame = document.createElement("div");
      frame.className = "frame";
      const canvas = document.createElement("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", `Axis ${name}, ${units[k]}, over arc length`);
      frame.append(canvas);
      box.append(title, frame);
      this.parent.append(box);
      return { canvas, now };
    });
  }

  /** The program's curves and its CRC-32; without arguments there is none. */
  setPath(arc, extra, program = null) {
    this.path = { arc: arc ?? [], extra: extra ?? [] };
    if (program !== this.program) this.clear();
    this.program = program;
  }

  clear() {
    this.points.clear();
  }

  /** Takes a message of type rows. Arc lengths along another program, as a move to the start, have no place here. */
  add({ arc, extra, program }) {
    if (!arc || !this.names.length || program !== this.program) return;
    const [cmd, act] = extra;
    arc.forEach((s, i) => {
      const row = { s: s ?? NaN };
      this.names.forEach((_, k) => { row[`c${k}`] = cmd[k]?.[i] ?? NaN; row[`a${k}`] = act[k]?.[i] ?? NaN; });
      this.points.put(row);
    });
  }

  draw(colours) {
    this.curves.forEach((_, k) => this.drawAxis(k, colours));
  }

  drawAxis(k, colours) {
    const { canvas, now } = this.curves[k];
    const { context, width, height } = prepare(canvas);
    const planned = this.path.extra[k] ?? [];
    const length = this.path.arc.at(-1) ?? 1;
    let low = Infinity, high = -Infinity;
    for (const value of planned) { low = Math.min(low, value); high = Math.max(high, value); }
    if (!(low <= high)) [low, high] = [-1, 1];
    const room = Math.max(0.05 * (high - low), 1e-3);
    [low, high] = [low - room, high + room];
    const px = (s) => LEFT + (s / length) * (width - LEFT - RIGHT);
    const py = (value) => TOP + ((high - value) / (high - low)) * (height - TOP - BOTTOM);
    this.scale(context, { low, high, length, px, py, width, height }, colours);
    polyline(context, colours.grid, 4, planned.length, (i) => [px(this.path.arc[i]), py(planned[i])]);
    const { start, end } = this.points;
    for (const [what, colour] of [["c", colours.cmd], ["a", colours.act]]) {
      polyline(context, colour, 1.3, end - start, (i) => [px(this.points.get("s", start + i)), py(this.points.get(what + k, start + i))]);
    }
    const value = end > start ? this.points.get(`a${k}`, end - 1) : NaN;
    now.textContent = `${text(value, 3)} ${this.units[k]}`;
    canvas.dataset.points = String(end - start);
    canvas.dataset.planned = String(planned.length);
  }

  scale(context, { low, high, length, px, py, width, height }, colours) {
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = colours.soft;
    context.strokeStyle = colours.grid;
    context.textAlign = "right";
    context.textBaseline = "middle";
    const step = roundUp((high - low) / STEPS), digits = digitsOf(step);
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) {
      const value = k * step, y = Math.round(py(value)) + 0.5;
      polyline(context, colours.grid, 1, 2, (i) => [i ? width - RIGHT : LEFT, y]);
      context.fillText(value.toFixed(digits), LEFT - 6, y);
    }
    context.textBaseline = "bottom";
    context.fillText(`${length.toFixed(1)} mm`, px(length), height);
    context.textAlign = "left";
    context.fillText("0", px(0), height);
  }
}

/** A line through points, broken where one is not known or the arc length runs back. */
function polyline(context, colour, width, count, at) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.beginPath();
  let last = NaN;
  for (let i = 0; i < count; i += 1) {
    const [x, y] = at(i);
    if (Number.isNaN(x) || Number.isNaN(y)) { last = NaN; continue; }
    if (x >= last) context.lineTo(x, y);
    else context.moveTo(x, y);
    last = x;
  }
  context.stroke();
  context.lineWidth = 1;
}
