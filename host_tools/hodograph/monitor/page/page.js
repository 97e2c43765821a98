// SPDX-License-Identifier: MIT
// The page put together: messages go to store and panel, what changed is drawn at the next frame of the screen.
// Loaded by index.html. Opens the link to the monitor, sends commands of buttons and keys, changes the document.

import { AxisCurves } from "./axes.js";
import { Chart, timeAt } from "./chart.js";
import { Link } from "./link.js";
import { Panel } from "./panel.js";
import { Plane } from "./plane.js";
import { text } from "./scale.js";
import { Store } from "./store.js";
import { Theme } from "./theme.js";
import { Toolpath } from "./toolpath.js";

const $ = (id) => document.getElementById(id);
const OVERRIDE_MS = 100;
const COLOURS = ["act", "second", "third", "cmd", "soft", "ink"];

const store = new Store();
const panel = new Panel();
let charts = [];
let seconds = 10;
let frozenAt = null;
let hover = null;
let wanted = false;
let arrivedMs = null; // when the newest rows came, and how old they were then
let ageMs = null;
const figures = { lag: null, worst: 0, pump: {}, usage: {}, dropped: 0 };

function redraw() {
  if (wanted) return;
  wanted = true;
  requestAnimationFrame(draw);
}

const plane = new Plane($("plane-canvas"), redraw);
const axisCurves = new AxisCurves($("axis-curves"));
const theme = new Theme($("theme"), redraw);

function draw() {
  wanted = false;
  const end = frozenAt ?? store.newest;
  plane.draw(store.points, theme.colours);
  $("place").textContent = plane.place;
  axisCurves.draw(theme.colours);
  for (const chart of charts) chart.draw(store.groups, end, seconds, theme.colours, hover, store.marks);
  if (arrivedMs !== null && ageMs !== null) {
    const lag = ageMs + link.rttMs / 2 + (performance.now() - arrivedMs);
    figures.lag = figures.lag === null ? lag : 0.9 * figures.lag + 0.1 * lag;
    figures.worst = Math.max(figures.worst, lag);
    arrivedMs = null;
  }
}

/** A path in space can be looked at from several sides. */
function offerViews(inSpace, names) {
  $("side-label").hidden = !inSpace;
  plane.names = names.slice(0, 3);
  for (const option of $("side").options) {
    if (option.value !== "isometric") option.textContent = [...option.value].map((axis) => names["xyz".indexOf(axis)]).join("–");
  }
  plane.look(inSpace ? $("side").value : "xy");
}

function makeCharts(axes, units) {
  $("charts").replaceChildren();
  const one = (title, unit, digits, least, signed, series) =>
    new Chart($("charts"), { title, unit, digits, least, signed, lines: [{ series, label: "", colour: "act" }] });
  charts = [
    one("Feed", "mm/s", 2, 1, false, "feed"),
    one("Acceleration along the path", "mm/s²", 0, 10, true, "acceleration"),
    one("Jerk along the path", "mm/s³", 0, 100, true, "jerk"),
    one("Contour error", "µm", 2, 1, false, "contour"),
    new Chart($("charts"), {
      title: "Following error", unit: units.includes("deg") ? "µm, 0.001°" : "µm", digits: 2, least: 1, signed: true,
      lines: axes.map((name, i) => ({ series: `following${i}`, label: `${name} `, colour: COLOURS[i] })),
    }),
  ];
  for (const chart of charts) {
    chart.canvas.addEventListener("pointermove", (event) => {
      hover = timeAt(chart.canvas, event.clientX, frozenAt ?? store.newest, seconds);
      redraw();
    });
    chart.canvas.addEventListener("pointerleave", () => { hover = null; redraw(); });
  }
}

function addRows(message, live) {
  store.add(message);
  axisCurves.add(message);
  if (live) {
    arrivedMs = performance.now();
    ageMs = message.age_ms;
    const last = message.t.length - 1;
    panel.following = store.series.filter((name) => name.startsWith("following")).map((name) => {
      const [low, high] = message[name].map((values) => values[last]);
      return Math.abs(low) > Math.abs(high) ? low : high;
    });
  }
}

const handlers = {
  hello(message) {
    store.setAxes(message.axes.length);
    makeCharts(message.axes, message.units);
    offerViews(message.drawn > 2, message.axes);
    axisCurves.setAxes(message.axes.slice(message.drawn, message.path_axes), message.units.slice(message.drawn, message.path_axes));
    plane.setPath([], []); // of another run of the monitor, perhaps: the present ones follow
    plane.setToolpath(null);
    $("place").hidden = $("speeds").hidden = true;
    panel.hello(message);
    $("event-rows").replaceChildren();
  },
  rows: (message) => addRows(message, true),
  history: ({ messages }) => messages.forEach((m) => (m.type === "rows" ? addRows(m, false) : handlers[m.type](m))),
  restart: () => { store.clear(); axisCurves.clear(); },
  path(message) {
    plane.setPath(message.x, message.y, message.z, message.marks);
    axisCurves.setPath(message.arc, message.extra, message.crc32);
    panel.name = message.name;
    panel.lengthMm = message.length_mm;
    $("path-note").textContent = message.note;
  },
  toolpath(message) {
    plane.setToolpath(new Toolpath(message));
    $("place").hidden = $("speeds").hidden = false;
    $("speeds-most").textContent = `${text(plane.toolpath.most, 1)} mm/s`;
    if (plane.toolpath.flat) $("side").value = "xy";
    plane.look($("side-label").hidden ? "xy" : $("side").value);
  },
  bus: ({ there, note }) => panel.reason("bus", there ? "" : note, true),
  status: (message) => panel.status(message),
  drives: (message) => panel.drives(message),
  event: ({ text: words, fault }) => panel.event(words, fault),
  pump(message) {
    figures.pump = message;
    $("replay-state").textContent = message.ended ? "at its end" : "";
    showFigures();
  },
  usage(message) {
    figures.usage = message;
    showFigures();
  },
  pong: (message) => { figures.dropped = message.dropped; },
};

function showFigures() {
  const { pump, usage } = figures;
  const lag = figures.lag === null ? "–" : `${text(figures.lag, 0)} ms (worst ${text(figures.worst, 0)})`;
  $("footer").textContent = [
    `lag ${lag}`, `${pump.frames_per_s ?? "–"} frames/s`, `monitor ${text(usage.cpu_percent, 1)} % of a processor, ${usage.memory_mib ?? "–"} MiB`,
    `browsers ${usage.clients ?? "–"}`, `frames lost ${pump.dropped ?? 0}`, `messages skipped ${figures.dropped}`,
  ].join("  ·  ");
  Object.assign($("footer").dataset, { lag: figures.lag ?? "", worst: figures.worst, cpu: usage.cpu_percent ?? "" });
  figures.worst = figures.lag ?? 0;
}

const link = new Link({
  message(message) {
    handlers[message.type]?.(message);
    redraw();
  },
  up: () => panel.reason("monitor", ""),
  down(needsToken) {
    panel.state("not connected", "bad");
    panel.buttons(null);
    panel.reason("monitor", needsToken ? "The token is missing or wrong." : "The monitor does not answer: trying again.", true);
    if (needsToken && !$("token-dialog").open) $("token-dialog").showModal();
  },
});

let overrideTimer = null;
/** Gives a command after the override that waits, so that a program starts as slowly as the slider shows. */
async function command(name, more) {
  if (overrideTimer) giveOverride();
  const answer = await link.command(name, more);
  if (!answer.ok || name !== "override") panel.event(answer.text, !answer.ok);
}

for (const button of document.querySelectorAll("[data-command]")) {
  button.addEventListener("click", () => command(button.dataset.command));
}

function slide(percent) {
  panel.sliding = true;
  $("override-value").textContent = `${percent} %`;
  clearTimeout(panel.slidingTimer);
  panel.slidingTimer = setTimeout(() => { panel.sliding = false; }, 1500);
  if (overrideTimer) return;
  overrideTimer = setTimeout(giveOverride, OVERRIDE_MS);
}
function giveOverride() {
  clearTimeout(overrideTimer);
  overrideTimer = null;
  command("override", { percent: Number($("override").value) });
}
$("override").addEventListener("input", () => slide(Number($("override").value)));
$("override-100").addEventListener("click", () => { $("override").value = "100"; slide(100); });

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  if (event.target.closest("input, select, dialog")) return;
  document.querySelector(`[aria-keyshortcuts="${CSS.escape(event.key)}"]`)?.click();
});

$("window").addEventListener("change", () => { seconds = Number($("window").value); redraw(); });
$("pause").addEventListener("click", () => {
  frozenAt = frozenAt === null ? store.newest : null;
  $("pause").setAttribute("aria-pressed", String(frozenAt !== null));
  redraw();
});
$("side").addEventListener("change", () => plane.look($("side").value));
$("magnify").addEventListener("change", () => { plane.magnify = Number($("magnify").value); redraw(); });
$("follow").addEventListener("change", () => { plane.follow = $("follow").checked; redraw(); });
$("fit").addEventListener("click", () => plane.fit());
$("again").addEventListener("click", () => command("replay"));
$("unlock").addEventListener("click", () => $("token-dialog").showModal());
$("token-ok").addEventListener("click", () => { $("token-dialog").close(); link.useToken($("token").value.trim()); });
$("token-cancel").addEventListener("click", () => $("token-dialog").close());
$("token").addEventListener("keydown", (event) => { if (event.key === "Enter") $("token-ok").click(); });
new ResizeObserver(redraw).observe(document.body);
