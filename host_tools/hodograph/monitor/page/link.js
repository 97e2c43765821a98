// SPDX-License-Identifier: MIT
// The WebSocket to the monitor: opens with the token, connects again after an interruption, gives commands.
// Used by page.js. Opens and closes the WebSocket, keeps the token in sessionStorage, and removes it from the address.

const TOKEN_NEEDED = 4401;
const STORED = "hodograph-token";
const FIRST_WAIT_MS = 500, LONGEST_WAIT_MS = 5000, PING_MS = 2000;
const SILENCE_MS = 10000; // the monitor sends something each second; a browser does not notice a pulled cable for minutes

/** The token of the address, once: it is kept for reloads of this tab and taken out of the address bar. */
export function takeToken() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found) {
    sessionStorage.setItem(STORED, found);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(STORED);
}

export class Link {
  /** `on`: {message(m), up(), down(needsToken)}. */
  constructor(on) {
    this.on = on;
    this.token = takeToken();
    this.waitMs = FIRST_WAIT_MS;
    this.rttMs = 0;
    this.ids = 0;
    this.answers = new Map();
    setInterval(() => this.ping(), PING_MS);
    this.open();
  }

  useToken(token) {
    this.token = token;
    if (token) sessionStorage.setItem(STORED, token);
    else sessionStorage.removeItem(STORED);
    this.socket?.close();
    this.socket = null;
    clearTimeout(this.timer);
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/ws`);
    this.socket = socket;
    this.receivedMs = performance.now();
    socket.onopen = () => socket.send(JSON.stringify({ type: "hello", token: this.token ?? "" }));
    socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    socket.onclose = (event) => {
      if (socket === this.socket) this.lost(event.code);
    };
  }

  /** Cuts a connection over which nothing comes: what the page shows is old then. */
  ping() {
    if (this.socket?.readyState === WebSocket.OPEN && performance.now() - this.receivedMs > SILENCE_MS) {
      const silent = this.socket;
      this.socket = null;
      silent.close();
      this.lost(0);
    }
    this.send({ type: "ping", at: performance.now() });
  }

  receive(message) {
    this.receivedMs = performance.now();
    if (message.type === "hello") {
      this.waitMs = FIRST_WAIT_MS;
      this.on.up();
    }
    if (message.type === "pong") {
      this.rttMs = performance.now() - message.at;
    } else if (message.type === "answer") {
      this.answers.get(message.id)?.(message);
      this.answers.delete(message.id);
      return;
    }
    this.on.message(message);
  }

  lost(code) {
    for (const settle of this.answers.values()) settle({ ok: false, text: "the connection to the monitor was cut" });
    this.answers.clear();
    this.on.down(code === TOKEN_NEEDED);
    if (code === TOKEN_NEEDED) return;
    this.timer = setTimeout(() => this.open(), this.waitMs);
    this.waitMs = Math.min(LONGEST_WAIT_MS, this.waitMs * 1.7);
  }

  send(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Gives a command; {ok, text} when it has been carried out or refused. */
  command(name, more = {}) {
    this.ids += 1;
    const id = this.ids;
    return new Promise((settle) => {
      this.answers.set(id, settle);
      if (!this.send({ type: "command", id, name, ...more })) {
        this.answers.delete(id);
        settle({ ok: false, text: "there is no connection to the monitor" });
      }
    });
  }
}
