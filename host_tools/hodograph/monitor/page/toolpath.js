// SPDX-License-Identifier: MIT
// A toolpath on the plane: programmed path, curve with its feed as colour, rapid moves dashed, the source line of a place.
// Used by page.js; plane.js draws it. Draws on the canvas that it is given; no other effects.

const COLOURS = 24; // grades of feed
const RAPID = -1;
const VISIBLE = 3; // pixels of the tolerance, from one side to the other
const NEAR = 14; // pixels around the pointer in which a place is looked for
const AROUND = 400; // points around the last place in which the tool is looked for first
const ON_PATH = 0.05; // mm

const dot = (direction, x, y, z) => direction[0] * x + direction[1] * y + direction[2] * z;

/** Colour of a share 0 … 1 of the greatest feed: blue is slow, red is fast. */
export const colourOf = (share) => `hsl(${260 - 260 * share} 75% 50%)`;

export class Toolpath {
  constructor({ x, y, z, f, l, r, text, programmed, tolerance }) {
    Object.assign(this, { x, y, z, f, l, r, text, programmed, tolerance });
    this.most = f.reduce((most, feed, i) => (r[i] ? most : Math.max(most, feed)), 1e-9);
    this.last = 0;
  }

  get size() {
    return this.x.length;
  }

  /** Calls take(right, up) for all points of a path with columns x, y, z. */
  points({ x, y, z }, [right, up], take) {
    for (let i = 0; i < x.length; i += 1) take(dot(right, x[i], y[i], z[i]), dot(up, x[i], y[i], z[i]), i);
  }

  /** Whether all places have the same height. */
  get flat() {
    return this.z.every((z) => z === this.z[0]);
  }

  /** The curve, and where it is drawn so large that they differ, the programmed path with its tolerance. `px`, `py`: mm
   * to pixels. */
  draw(context, directions, px, py, scale, colours) {
    const band = 2 * this.tolerance * scale;
    if (band > VISIBLE) {
      this.line(context, directions, px, py, colours.program, band);
      this.line(context, directions, px, py, colours.ink, 1);
    }
    this.curve(context, directions, px, py, colours);
  }

  line(context, directions, px, py, colour, width) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    this.points(this.programmed, directions, (x, y) => context.lineTo(px(x), py(y)));
    context.stroke();
  }

  kind(i) {
    return this.r[i] ? RAPID : Math.min(COLOURS, Math.round((COLOURS * this.f[i]) / this.most));
  }

  curve(context, directions, px, py, colours) {
    context.lineWidth = 2.2;
    let before = null, kind = null;
    this.points(this, directions, (x, y, i) => {
      const now = this.kind(i);
      if (now !== kind && before) {
        if (kind !== null) context.stroke();
        kind = now;
        context.setLineDash(kind === RAPID ? [5, 4] : []);
        context.strokeStyle = kind === RAPID ? colours.soft : colourOf(kind / COLOURS);
        context.beginPath();
        context.moveTo(...before);
      }
      before = [px(x), py(y)];
      if (kind !== null) context.lineTo(...before);
    });
    if (kind !== null) context.stroke();
    context.setLineDash([]);
    context.lineWidth = 1;
  }

  /** The point nearest to a place on the screen in pixels; -1: none is near. */
  under(left, top, directions, px, py) {
    let best = NEAR * NEAR, found = -1;
    this.points(this, directions, (x, y, i) => {
      const dx = px(x) - left, dy = py(y) - top, away = dx * dx + dy * dy;
      if (away < best) { best = away; found = i; }
    });
    return found;
  }

  /** Square of how far a position on the curve may be from the chord that ends at point i: long jobs have long chords. */
  near(i) {
    const chord = Math.hypot(this.x[i] - this.x[i - 1], this.y[i] - this.y[i - 1], this.z[i] - this.z[i - 1]);
    return (ON_PATH + chord / 4) ** 2;
  }

  /** The point at a position in mm, near the last one where the path passes there; -1: it is not on the path. */
  at(x, y, z) {
    const among = (first, end) => {
      let best = Infinity, found = -1;
      for (let i = Math.max(1, first); i < Math.min(end, this.size); i += 1) {
        const away = this.away(i, x, y, z);
        if (away < best && away < this.near(i)) { best = away; found = i; }
      }
      return found;
    };
    let found = among(this.last - AROUND, this.last + AROUND);
    if (found < 0) found = among(1, this.size);
    if (found >= 0) this.last = found;
    return found;
  }

  /** Square of the distance of a position from the chord that ends at point i. */
  away(i, x, y, z) {
    const a = [this.x[i - 1], this.y[i - 1], this.z[i - 1]];
    const along = [this.x[i] - a[0], this.y[i] - a[1], this.z[i] - a[2]], off = [x - a[0], y - a[1], z - a[2]];
    const square = dot(along, ...along);
    const share = square > 0 ? Math.min(1, Math.max(0, dot(along, ...off) / square)) : 0;
    const rest = off.map((value, axis) => value - share * along[axis]);
    return dot(rest, ...rest);
  }

  /** The source line of point i. */
  source(i) {
    const line = this.l[i], text = this.text[line];
    return text ? `line ${line}: ${text}` : `line ${line}`;
  }

  /** Source line, place and planned feed of point i. */
  describe(i) {
    const place = ["x", "y", "z"].map((axis) => `${axis.toUpperCase()}${this[axis][i].toFixed(3)}`).join(" ");
    return `${this.source(i)}   ${place}   ${this.r[i] ? "rapid, " : ""}${this.f[i].toFixed(1)} mm/s`;
  }
}
