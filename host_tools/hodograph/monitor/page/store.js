// SPDX-License-Identifier: MIT
// What the plots draw: the last groups of each series and the last points of the path, in rings of fixed size.
// Used by page.js and axes.js. Changes its own arrays only; no I/O.

const GROUPS = 8192;
const POINTS = 12288;
const MARKS = 200; // times at which outputs switched

export class Ring {
  constructor(size, columns) {
    this.size = size;
    this.columns = Object.fromEntries(columns.map((name) => [name, new Float64Array(size)]));
    this.clear();
  }

  clear() {
    this.end = 0; // rows ever put; row i is at i % size
  }

  get start() {
    return Math.max(0, this.end - this.size);
  }

  put(row) {
    const at = this.end % this.size;
    for (const [name, column] of Object.entries(this.columns)) column[at] = row[name] ?? NaN;
    this.end += 1;
  }

  get(name, i) {
    return this.columns[name][i % this.size];
  }
}

export class Store {
  constructor() {
    this.names = ["feed", "acceleration", "jerk", "contour"];
    this.setAxes(2);
  }

  setAxes(axes) {
    const series = [...this.names, ...Array.from({ length: axes }, (_, i) => `following${i}`)];
    this.series = series;
    this.groups = new Ring(GROUPS, ["t", ...series.flatMap((name) => [`${name}.low`, `${name}.high`])]);
    this.points = new Ring(POINTS, ["cx", "cy", "cz", "ax", "ay", "az"]);
    this.changes = 0;
    this.marks = []; // [time, text]
  }

  clear() {
    this.groups.clear();
    this.points.clear();
    this.marks = [];
    this.changes += 1;
  }

  /** Takes a message of type rows. */
  add(message) {
    this.marks = [...this.marks, ...(message.marks ?? [])].slice(-MARKS);
    message.t.forEach((t, i) => {
      const row = { t };
      for (const name of this.series) {
        row[`${name}.low`] = message[name]?.[0][i];
        row[`${name}.high`] = message[name]?.[1][i];
      }
      this.groups.put(row);
    });
    const { cmd, act } = message;
    if (cmd) {
      cmd[0].forEach((x, i) => this.points.put({
        cx: x, cy: cmd[1][i], cz: cmd[2]?.[i] ?? 0, ax: act[0][i], ay: act[1][i], az: act[2]?.[i] ?? 0,
      }));
    }
    this.changes += 1;
  }

  get newest() {
    return this.groups.end ? this.groups.get("t", this.groups.end - 1) : 0;
  }
}
