// SPDX-License-Identifier: MIT
// The path: the program's curve, where the setpoints went, where the axes went. A path in space is projected.
// Used by page.js. Draws on the canvas that it is given, and takes its pointer and keys.

import { digitsOf, prepare, roundUp } from "./scale.js";

const MARGIN = 0.08;
const TURN = Math.PI / 12;
const ELEVATION = Math.atan(Math.SQRT1_2); // of the isometric view
const FLAT = { xy: [[1, 0, 0], [0, 1, 0]], xz: [[1, 0, 0], [0, 0, 1]], yz: [[0, 1, 0], [0, 0, 1]] };
const KEYS = { "+": "in", "=": "in", "-": "out", 0: "fit", ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", "[": "turnLeft", "]": "turnRight" };

/** Where x, y and z point to on the screen, to the right and upwards, seen from this azimuth. */
export function isometric(azimuth) {
  const sin = Math.sin(ELEVATION);
  return [[-Math.sin(azimuth), Math.cos(azimuth), 0], [-Math.cos(azimuth) * sin, -Math.sin(azimuth) * sin, Math.cos(ELEVATION)]];
}

const along = (direction, x, y, z) => direction[0] * x + direction[1] * y + (direction[2] ? direction[2] * z : 0);

export class Plane {
  constructor(canvas, redraw) {
    this.canvas = canvas;
    this.redraw = redraw;
    this.path = { x: [], y: [], z: [] };
    this.marks = []; // {x, y, z, text}: where outputs switch
    this.toolpath = null; // Toolpath: drawn in place of the path
    this.pointer = null; // [left, top] in pixels
    this.names = ["x", "y", "z"];
    this.azimuth = -Math.PI / 4;
    this.side = "xy";
    this.magnify = 1;
    this.follow = false;
    this.view = null; // {x, y: middle in mm; scale: pixels a mm}; null: fitted
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.drag(event));
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("pointermove", (event) => this.point([event.offsetX, event.offsetY]));
    canvas.addEventListener("pointerleave", () => this.point(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** A path in the plane has no z: it is drawn at 0. */
  setPath(x, y, z, marks) {
    this.path = { x, y, z: z ?? x.map(() => 0) };
    this.marks = marks ?? [];
    this.canvas.dataset.marks = this.marks.map((mark) => mark.text).join("; ");
    this.redraw();
  }

  /** A toolpath is drawn in place of the path of the program, which is a part of it. */
  setToolpath(toolpath) {
    this.toolpath = toolpath;
    this.redraw();
  }

  point(place) {
    this.pointer = place;
    if (this.toolpath) this.redraw();
  }

  /** Point of the toolpath under the pointer, else where the tool is; -1: neither is on the path. */
  placed(points, px, py) {
    if (this.pointer) {
      const found = this.toolpath.under(...this.pointer, this.directions, px, py);
      if (found >= 0) return found;
    }
    if (points.end === 0) return -1;
    return this.toolpath.at(...["cx", "cy", "cz"].map((name) => points.get(name, points.end - 1)));
  }

  /** "xy", "xz", "yz", or "isometric", which `turn` turns. */
  look(side) {
    this.side = side;
    this.fit();
  }

  turn(angle) {
    if (this.side !== "isometric") return;
    this.azimuth += angle;
    this.fit();
  }

  get directions() {
    return FLAT[this.side] ?? isometric(this.azimuth);
  }

  /** A point of the ring on the screen, in mm; `what`: c commanded, a actual. */
  at(points, what, i) {
    const place = [0, 1, 2].map((axis) => points.get(what + "xyz"[axis], i));
    return this.directions.map((direction) => along(direction, ...place));
  }

  fit() {
    this.view = null;
    this.redraw();
  }

  draw(points, colours) {
    const { context, width, height } = prepare(this.canvas);
    const view = this.seen(points, width, height);
    this.shown = view;
    const px = (x) => width / 2 + (x - view.x) * view.scale;
    const py = (y) => height / 2 - (y - view.y) * view.scale;
    if (this.side in FLAT) grid(context, view, width, height, px, py, colours);
    else triad(context, this.directions, this.names, height, colours);
    context.lineJoin = context.lineCap = "round";
    if (this.toolpath) this.toolpath.draw(context, this.directions, px, py, view.scale, colours);
    else this.curve(context, px, py, colours);
    this.trail(context, points, "c", 1, px, py, colours.cmd, 1);
    this.trail(context, points, "a", this.magnify, px, py, colours.act, 1.8);
    this.outputs(context, px, py, width, colours);
    this.tool(context, points, px, py, colours);
    const found = this.toolpath ? this.placed(points, px, py) : -1;
    this.place = found < 0 ? "" : this.toolpath.describe(found);
    this.canvas.dataset.points = String(points.end);
  }

  seen(points, width, height) {
    const view = this.view ?? this.whole(points, width, height);
    if (!this.follow || points.end === 0) return view;
    const [x, y] = this.at(points, "c", points.end - 1);
    return Number.isNaN(x + y) ? view : { ...view, x, y };
  }

  whole(points, width, height) {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const take = (px, py) => {
      if (Number.isNaN(px + py)) return;
      box[0] = Math.min(box[0], px); box[1] = Math.min(box[1], py);
      box[2] = Math.max(box[2], px); box[3] = Math.max(box[3], py);
    };
    this.curvePoints((px, py) => take(px, py));
    const step = Math.max(1, Math.floor((points.end - points.start) / 500));
    for (let i = points.start; i < points.end; i += step) take(...this.at(points, "c", i));
    if (points.end) take(...this.at(points, "c", points.end - 1));
    if (box[0] === Infinity) return { x: 0, y: 0, scale: width / 100 };
    const room = 1 - 2 * MARGIN;
    const scale = Math.min((room * width) / Math.max(box[2] - box[0], 1), (room * height) / Math.max(box[3] - box[1], 1));
    return { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, scale };
  }

  curve(context, px, py, colours) {
    context.strokeStyle = colours.program;
    context.lineWidth = 6;
    context.beginPath();
    this.curvePoints((x, y) => context.lineTo(px(x), py(y)));
    context.stroke();
  }

  curvePoints(take) {
    if (this.toolpath) return this.toolpath.points(this.toolpath, this.directions, take);
    const { x, y, z } = this.path, [right, up] = this.directions;
    x.forEach((value, i) => take(along(right, value, y[i], z[i]), along(up, value, y[i], z[i])));
  }

  /** Positions, `magnify` times as far from the commanded ones as they are. */
  trail(context, points, what, magnify, px, py, colour, lineWidth) {
    context.strokeStyle = colour;
    context.lineWidth = lineWidth;
    context.beginPath();
    let lastX = NaN, lastY = NaN;
    for (let i = points.start; i < points.end; i += 1) {
      const [cx, cy] = this.at(points, "c", i);
      const [ax, ay] = this.at(points, what, i);
      const x = px(cx + magnify * (ax - cx)), y = py(cy + magnify * (ay - cy));
      if (Number.isNaN(x + y)) { lastX = NaN; continue; }
      if (Number.isNaN(lastX)) context.moveTo(x, y);
      else if (Math.abs(x - lastX) + Math.abs(y - lastY) < 0.7) continue;
      else context.lineTo(x, y);
      lastX = x; lastY = y;
    }
    context.stroke();
    context.lineWidth = 1;
  }

  /** A triangle at each place where outputs switch, and what switches: next to it, to the right where there is room. */
  outputs(context, px, py, width, colours) {
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.fillStyle = colours.second;
    for (const { x, y, z, text } of this.marks) {
      const [right, up] = this.directions.map((direction) => along(direction, x, y, z ?? 0));
      const left = px(right), top = py(up);
      context.beginPath();
      context.moveTo(left, top);
      context.lineTo(left - 5, top - 9);
      context.lineTo(left + 5, top - 9);
      context.fill();
      const lines = text.split("\n");
      const fits = left + 9 + Math.max(...lines.map((line) => context.measureText(line).width)) <= width;
      context.textAlign = fits ? "left" : "right";
      lines.forEach((line, k) => context.fillText(line, fits ? left + 9 : left - 9, top - 6 + 12 * k));
    }
  }

  tool(context, points, px, py, colours) {
    if (points.end === 0) return;
    const [x, y] = this.at(points, "a", points.end - 1);
    if (Number.isNaN(x + y)) return;
    context.beginPath();
    context.arc(px(x), py(y), 6, 0, 2 * Math.PI);
    context.fillStyle = colours.act;
    context.fill();
    context.strokeStyle = colours.card;
    context.lineWidth = 2;
    context.stroke();
    context.lineWidth = 1;
  }

  zoom(factor, x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    const view = this.shown ?? { x: 0, y: 0, scale: 1 };
    const scale = Math.min(1e6, Math.max(1e-2, view.scale * factor));
    const change = 1 / view.scale - 1 / scale;
    this.view = { x: view.x + (x - clientWidth / 2) * change, y: view.y - (y - clientHeight / 2) * change, scale };
    this.redraw();
  }

  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY / 500), event.offsetX, event.offsetY);
  }

  drag(event) {
    this.canvas.setPointerCapture(event.pointerId);
    const move = (moved) => this.move(moved.movementX, moved.movementY);
    this.canvas.addEventListener("pointermove", move);
    this.canvas.addEventListener("pointerup", () => this.canvas.removeEventListener("pointermove", move), { once: true });
  }

  move(right, down) {
    if (!this.shown) return;
    const { x, y, scale } = this.shown;
    this.view = { x: x - right / scale, y: y + down / scale, scale };
    this.redraw();
  }

  key(event) {
    const step = 40, { clientWidth, clientHeight } = this.canvas;
    const actions = {
      in: () => this.zoom(1.25, clientWidth / 2, clientHeight / 2),
      out: () => this.zoom(0.8, clientWidth / 2, clientHeight / 2),
      fit: () => this.fit(),
      left: () => this.move(step, 0), right: () => this.move(-step, 0),
      up: () => this.move(0, step), down: () => this.move(0, -step),
      turnLeft: () => this.turn(-TURN), turnRight: () => this.turn(TURN),
    };
    const action = actions[KEYS[event.key]];
    if (!action || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    action();
  }
}

/** The directions of the three axes, in the lower left corner. */
function triad(context, [right, up], names, height, colours) {
  const length = 30, x0 = 45, y0 = height - 45;
  context.font = "11px system-ui, sans-serif";
  context.lineWidth = 1.5;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.strokeStyle = context.fillStyle = colours.soft;
  names.forEach((name, axis) => {
    const dx = length * right[axis], dy = -length * up[axis];
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x0 + dx, y0 + dy);
    context.stroke();
    context.fillText(name, x0 + 1.35 * dx, y0 + 1.35 * dy);
  });
}

function grid(context, view, width, height, px, py, colours) {
  const step = roundUp(70 / view.scale), digits = digitsOf(step);
  context.font = "11px system-ui, sans-serif";
  context.lineWidth = 1;
  context.textAlign = "left";
  context.textBaseline = "bottom";
  const lines = (middle, half, draw) => {
    for (let k = Math.ceil((middle - half) / step); k * step <= middle + half; k += 1) {
      context.strokeStyle = k === 0 ? colours.line : colours.grid;
      context.fillStyle = colours.soft;
      context.beginPath();
      draw(k * step, (k * step).toFixed(digits));
      context.stroke();
    }
  };
  lines(view.x, width / 2 / view.scale, (x, label) => {
    const at = Math.round(px(x)) + 0.5;
    context.moveTo(at, 0);
    context.lineTo(at, height);
    context.fillText(label, at + 3, height - 2);
  });
  lines(view.y, height / 2 / view.scale, (y, label) => {
    const at = Math.round(py(y)) + 0.5;
    context.moveTo(0, at);
    context.lineTo(width, at);
    if (at < height - 20) context.fillText(label, 3, at - 2);
  });
  context.textAlign = "right";
  context.textBaseline = "top";
  context.fillText("mm", width - 4, 4);
}
