// SPDX-License-Identifier: MIT
// Light, dark, or as the system has it; and the colours for the canvases.
// Used by page.js. Keeps the choice in localStorage, and sets the theme of the document.

const STORED = "hodograph-theme";
const NEXT = { auto: "light", light: "dark", dark: "auto" };
const NAMES = ["page", "card", "ink", "soft", "line", "grid", "program", "cmd", "act", "second", "third"];
const system = matchMedia("(prefers-color-scheme: dark)");

export class Theme {
  constructor(button, changed) {
    this.button = button;
    this.changed = changed;
    this.choice = NEXT[localStorage.getItem(STORED)] ? localStorage.getItem(STORED) : "auto";
    button.addEventListener("click", () => this.choose(NEXT[this.choice]));
    system.addEventListener("change", () => this.apply());
    this.apply();
  }

  choose(choice) {
    this.choice = choice;
    localStorage.setItem(STORED, choice);
    this.apply();
  }

  apply() {
    const dark = this.choice === "dark" || (this.choice === "auto" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    this.button.textContent = { auto: "Auto", light: "Light", dark: "Dark" }[this.choice];
    this.button.setAttribute("aria-label", `Colours: ${this.choice === "auto" ? "automatic" : this.choice}`);
    const style = getComputedStyle(document.documentElement);
    this.colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    this.changed();
  }
}
