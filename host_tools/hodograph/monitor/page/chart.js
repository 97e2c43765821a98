// SPDX-License-Identifier: MIT
// One plot over time: for each pixel the least and greatest value, so that no peak is lost.
// Used by page.js. Makes its elements in the document, and draws on their canvas.
// No chart library: uPlot 1.6 is 51 KB minified, six times this file.

import { digitsOf, prepare, roundUp, text } from "./scale.js";

const LEFT = 62, TOP = 4, BOTTOM = 4;
const NAME_ROW = 11;
const LONGEST_BRIDGE_S = 1; // over more time without any word nothing is drawn

export class Chart {
  /** `lines`: [{series, label, colour}]; `least`: smallest top of the scale; `signed`: whether values may be negative. */
  constructor(parent, { title, unit, digits, least, signed, lines }) {
    Object.assign(this, { unit, digits, least, signed, lines, top: least });
    const box = document.createElement("div");
    box.className = "chart";
    this.title = document.createElement("div");
    this.title.className = "title";
    const name = document.createElement("b");
    name.textContent = title;
    this.now = document.createElement("span");
    this.peak = document.createElement("span");
    this.peak.className = "soft";
    this.title.append(name, this.now, this.peak);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title} over time`);
    const frame = document.createElement("div");
    frame.className = "frame";
    frame.append(this.canvas);
    box.append(this.title, frame);
    parent.append(box);
  }

  /** Draws `seconds` up to `end`; `hover`: a time to mark, or null; `marks`: [time, text] of outputs that switched. */
  draw(groups, end, seconds, colours, hover, marks) {
    const { context, width, height } = prepare(this.canvas);
    const columns = Math.max(1, Math.floor(width - LEFT));
    const place = (t) => LEFT + ((t - end) / seconds + 1) * (width - LEFT);
    const reduced = this.lines.map((line) => reduce(groups, line.series, end, seconds, columns));
    const greatest = Math.max(0, ...reduced.map((line) => line.greatest));
    this.rescale(greatest);
    const low = this.signed ? -this.top : 0;
    const at = (value) => TOP + ((this.top - value) / (this.top - low)) * (height - TOP - BOTTOM);
    this.grid(context, width, low, at, end, seconds, place, colours);
    this.lines.forEach((line, i) => {
      stroke(context, reduced[i], at, colours[line.colour]);
    });
    const shown = marks.filter(([t]) => t <= end && t >= end - seconds);
    drawMarks(context, shown.map(([t, words]) => [place(t), words.split("\n")]), width, height, colours);
    this.canvas.dataset.marks = shown.map(([, words]) => words).join("; ");
    if (hover !== null) {
      context.fillStyle = colours.soft;
      context.fillRect(place(hover), 0, 1, height);
    }
    this.words(groups, hover, greatest);
  }

  rescale(greatest) {
    const wanted = roundUp(Math.max(this.least, greatest * 1.05));
    // It grows at once and shrinks when there is much room, so that it does not flicker.
    if (wanted > this.top || wanted < this.top / 2.1) this.top = wanted;
  }

  grid(context, width, low, at, end, seconds, place, colours) {
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "right";
    context.textBaseline = "middle";
    const digits = digitsOf(this.top);
    for (const value of this.signed ? [this.top, 0, low] : [this.top, this.top / 2, 0]) {
      const y = Math.round(at(value)) + 0.5;
      context.strokeStyle = value === 0 ? colours.line : colours.grid;
      line(context, LEFT, y, width, y);
      if (value === this.top / 2) continue;
      context.fillStyle = colours.soft;
      const down = value === this.top ? 5 : value === low ? -5 : 0;
      context.fillText(value.toFixed(digits), LEFT - 6, y + down);
    }
    const step = seconds / 5;
    context.strokeStyle = colours.grid;
    for (let t = Math.ceil((end - seconds) / step) * step; t <= end; t += step) {
      const x = Math.round(place(t)) + 0.5;
      line(context, x, 0, x, this.canvas.clientHeight);
    }
  }

  words(groups, hover, greatest) {
    const i = hover === null ? groups.end - 1 : rowAt(groups, hover);
    const values = this.lines.map((line) => {
      const value = i < groups.start || groups.end === 0 ? NaN : further(groups, line.series, i);
      return `${line.label}${text(value, this.digits)}`;
    });
    this.now.textContent = `${values.join("   ")} ${this.unit}`;
    this.peak.textContent = `peak ${text(greatest, this.digits)}`;
    this.canvas.dataset.peak = String(greatest);
  }
}

function further(groups, series, i) {
  const low = groups.get(`${series}.low`, i), high = groups.get(`${series}.high`, i);
  return Math.abs(low) > Math.abs(high) ? low : high;
}

function rowAt(groups, t) {
  let low = groups.start, high = groups.end - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (groups.get("t", middle) < t) low = middle + 1;
    else high = middle;
  }
  return low;
}

function reduce(groups, series, end, seconds, columns) {
  const low = new Float64Array(columns).fill(Infinity), high = new Float64Array(columns).fill(-Infinity);
  const missing = new Uint8Array(columns);
  let greatest = 0;
  for (let i = groups.end - 1; i >= groups.start; i -= 1) {
    const t = groups.get("t", i);
    if (t > end) continue;
    if (t < end - seconds) break;
    const least = groups.get(`${series}.low`, i), most = groups.get(`${series}.high`, i);
    const column = Math.min(columns - 1, Math.floor(((t - end) / seconds + 1) * columns));
    if (Number.isNaN(least)) {
      missing[column] = 1;
      continue;
    }
    low[column] = Math.min(low[column], least);
    high[column] = Math.max(high[column], most);
    greatest = Math.max(greatest, Math.abs(least), Math.abs(most));
  }
  return { low, high, missing, greatest, gap: (LONGEST_BRIDGE_S * columns) / seconds };
}

function stroke(context, { low, high, missing, gap }, at, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.lineJoin = "round";
  context.beginPath();
  let last = -Infinity, before = 0;
  for (let column = 0; column < low.length; column += 1) {
    if (low[column] === Infinity) {
      if (missing[column]) last = -Infinity;
      continue;
    }
    const x = LEFT + column + 0.5;
    const rising = Math.abs(low[column] - before) <= Math.abs(high[column] - before);
    const [first, second] = rising ? [low[column], high[column]] : [high[column], low[column]];
    if (column - last > Math.max(2, gap)) context.moveTo(x, at(first));
    else context.lineTo(x, at(first));
    if (first !== second) context.lineTo(x, at(second));
    [last, before] = [column, second];
  }
  context.stroke();
  context.lineWidth = 1;
}

/**
 * When outputs switched, `marks` from left to right: a line each, names next to it, from the bottom up. A name goes to
 * the left of its line at the right edge, above names that it would cover, and is left out where there is no room.
 */
function drawMarks(context, marks, width, height, colours) {
  context.fillStyle = colours.second;
  context.font = "10px system-ui, sans-serif";
  context.textBaseline = "bottom";
  const rows = Math.floor((height - 6) / NAME_ROW), used = new Array(Math.max(rows, 0)).fill(LEFT);
  for (const [x, names] of marks) {
    context.fillRect(x, 0, 1, height);
    const wide = Math.max(...names.map((name) => context.measureText(name).width)) + 6;
    const left = x + wide > width ? x - wide : x;
    const row = used.findIndex((_, k) => k + names.length <= rows && used.slice(k, k + names.length).every((end) => end <= left));
    if (row < 0) continue;
    context.textAlign = left < x ? "right" : "left";
    names.forEach((name, k) => context.fillText(name, left < x ? x - 3 : x + 3, height - 3 - NAME_ROW * (row + names.length - 1 - k)));
    used.fill(left + wide, row, row + names.length);
  }
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

/** The time under the pointer over a canvas of a chart; null left of the plot. */
export function timeAt(canvas, clientX, end, seconds) {
  const box = canvas.getBoundingClientRect();
  const x = clientX - box.left - LEFT;
  return x < 0 ? null : end - seconds * (1 - x / (box.width - LEFT));
}
