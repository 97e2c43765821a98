// SPDX-License-Identifier: MIT
// Words and buttons: the controller's state, faults with remedy, drives, program, messages.
// Used by page.js. Changes elements of the document, and the title; no I/O.

import { text } from "./scale.js";

const $ = (id) => document.getElementById(id);
const MOST_EVENTS = 60;

/** Commands that make sense in a state; quick stop always does. In ready a stop ends the job of a host. */
const POSSIBLE = {
  off: ["enable", "home"], enabling: ["stop", "disable"], ready: ["start", "stop", "disable"], running: ["hold", "stop"],
  holding: ["resume", "stop"], held: ["resume", "stop"], fault: ["reset"], stopping: [], boot: [], homing: ["stop"],
};
const LOOKS = { running: "good", ready: "good", fault: "bad", holding: "warn", held: "warn", stopping: "warn", homing: "warn", "quick stop": "bad" };

export class Panel {
  constructor() {
    this.mayCommand = false;
    this.connected = false;
    this.reasons = new Map(); // why something is not as it should be; the first one is shown
    this.following = [];
    this.units = [];
  }

  hello(message) {
    this.mayCommand = message.may_command;
    this.units = message.units;
    this.replay = message.mode === "replay";
    $("controls").hidden = this.replay;
    $("replay").hidden = !this.replay;
    $("program").hidden = false;
    $("what").textContent = `${this.replay ? "recording" : "bus"} ${message.what}`;
    $("unlock").hidden = this.mayCommand || this.replay;
    this.reason("look on", this.mayCommand || this.replay ? "" : "Opened without the token: this page may look on, not command.");
    if (this.replay) this.state("replay", "");
    this.buttons(null);
  }

  reason(key, words, bad = false) {
    if (words) this.reasons.set(key, { words, bad });
    else this.reasons.delete(key);
    const all = [...this.reasons.values()].sort((a, b) => b.bad - a.bad);
    $("banner").hidden = all.length === 0;
    const shown = all.map((reason) => reason.words).join("  ·  ");
    if ($("banner").textContent !== shown) $("banner").textContent = shown;
    $("banner").classList.toggle("bad", Boolean(all[0]?.bad));
  }

  state(name, look) {
    if ($("state").textContent !== name) $("state").textContent = name;
    $("state").className = `pill ${look}`;
    document.title = `${name} – Hodograph`;
  }

  status({ connected, note, status }) {
    this.connected = connected;
    this.reason("controller", connected ? "" : note, true);
    this.state(connected ? status.state : "no controller", connected ? (LOOKS[status.state] ?? "") : "bad");
    this.buttons(connected ? status.state : null);
    if (!connected) {
      for (const key of ["fault", "boot"]) this.reason(key, "");
      $("override-now").textContent = "";
      facts([]);
      return;
    }
    this.reason("fault", status.fault ? faultWords(status.fault) : "", true);
    const trouble = status.boot_trouble;
    this.reason("boot", trouble ? `Not ready, node ${trouble.node}: ${trouble.text}. What to do: ${trouble.remedy}.` : "");
    this.program(status);
    this.override(status.override);
  }

  buttons(state) {
    const possible = POSSIBLE[state] ?? [];
    for (const button of document.querySelectorAll("[data-command]")) {
      const name = button.dataset.command;
      const makesSense = name === "quick-stop" ? state !== null : possible.includes(name);
      button.disabled = !this.mayCommand || !makesSense;
    }
    $("override").disabled = $("override-100").disabled = !this.mayCommand || state === null;
  }

  override({ wanted_percent: wanted, actual_percent: actual, saturated }) {
    if (!this.sliding) {
      $("override").value = String(wanted);
      $("override-value").textContent = `${wanted} %`;
    }
    const now = actual > 0 ? `now ${text(actual, 1)} %` : "";
    $("override-now").textContent = saturated ? `${now}, all that is allowed here` : now;
  }

  program({ state, program, motion, statistics, stream }) {
    const rows = [["program", program.state]];
    if (program.state === "ready") {
      const length = program.length_mm;
      $("progress").value = length ? Math.min(1, motion.arc_length_mm / length) : 0;
      rows[0] = ["program", `${this.name ? `${this.name}, ` : ""}${text(length, 2)} mm, ${text(program.duration_s, 2)} s`];
      rows.push(["arc length", `${text(motion.arc_length_mm, 3)} mm`]);
    }
    const programRuns = OVER.includes(stream?.state) && MOVES.includes(state);
    if (stream && !programRuns) rows.splice(0, rows.length, ...streamRows(stream));
    rows.push(
      ["feed", `${text(motion.feed_mm_s, 2)} mm/s`],
      ["missed ticks", String(statistics.deadline_misses)],
      ["worst tick", `${text(statistics.worst_tick_ns / 1000, 0)} µs`],
      ["missed answers", String(statistics.missed_tpdos)],
    );
    if (this.load !== undefined) rows.push(["bus load", this.load === null ? "–" : `${text(this.load, 1)} %`]);
    facts(rows);
  }

  drives(message) {
    this.load = message.load_percent;
    $("drive-rows").replaceChildren(...message.drives.map((drive, i) => {
      const bad = /fault|silent|quick/.test(drive.state);
      return row([drive.name, `axis${i % 3}`], [String(drive.node)], [drive.state, bad ? "bad-text" : ""],
        [`${text(drive.actual_mm, 6)} ${this.units[i] === "deg" ? "°" : "mm"}`, "number"],
        [`${text(drive.state === "silent" ? null : this.following[i], 2)} ${this.units[i] === "deg" ? "m°" : "µm"}`, "number"]);
    }));
    if (this.replay) {
      facts([
        ["program", this.name || "–"], ["arc length", message.arc_length_mm === null ? "–" : `${text(message.arc_length_mm, 3)} mm`],
        ["bus load", message.load_percent === null ? "–" : `${text(message.load_percent, 1)} %`],
      ]);
      $("progress").value = this.lengthMm && message.arc_length_mm !== null ? message.arc_length_mm / this.lengthMm : 0;
    }
  }

  event(words, bad) {
    const item = document.createElement("li"), time = document.createElement("time");
    time.textContent = new Date().toLocaleTimeString([], { hour12: false });
    item.append(time, words);
    item.classList.toggle("bad", Boolean(bad));
    $("event-rows").prepend(item);
    while ($("event-rows").childElementCount > MOST_EVENTS) $("event-rows").lastElementChild.remove();
  }
}

function faultWords(fault) {
  const code = `0x${fault.code.toString(16).toUpperCase().padStart(4, "0")}`;
  const detail = fault.detail_text ? `, ${fault.detail_text}` : "";
  return `Fault: ${fault.text} (${code}, node ${fault.node}${detail}). What to do: ${fault.remedy}, then reset the fault.`;
}

const OVER = [3, 4], MOVES = ["running", "holding", "held"]; // a job that is over; states of a motion
const STREAM = ["", "open", "waits for its next part", "ended", "stopped", "waits at a program stop: resume goes on"];

/** A job in chunks: line of its source, motion ahead in the controller, time left. */
function streamRows(stream) {
  const left = stream.remaining_s === null ? "not known yet" : clock(stream.remaining_s);
  return [
    ["job", STREAM[stream.state] ?? ""], ["source line", String(stream.line)],
    ["arc length", `${text(stream.way_mm, 3)} mm`], ["ahead", `${text(stream.committed_s, 1)} s`], ["time left", left],
    ["rests for want of data", String(stream.underruns)],
  ];
}

function clock(seconds) {
  const whole = Math.round(seconds), two = (n) => String(n).padStart(2, "0");
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

function facts(rows) {
  $("facts").replaceChildren(...rows.flatMap(([name, value]) => {
    const term = document.createElement("dt"), data = document.createElement("dd");
    term.textContent = name;
    data.textContent = value;
    return [term, data];
  }));
}

function row(...cells) {
  const line = document.createElement("tr");
  line.append(...cells.map(([words, look]) => {
    const cell = document.createElement("td");
    cell.textContent = words;
    if (look) cell.className = look;
    return cell;
  }));
  return line;
}
