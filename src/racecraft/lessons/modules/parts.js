/* Small pieces that figures are made of: elements, sliders, tables, pictures, numbers. */

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value != null) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

export const button = (text, onclick, kind = "") => element("button", { type: "button", class: kind, onclick }, text);

/* A slider with its number; `tell` is called with every value. */
export function slider(text, { low, high, step, value, digits = 2 }, tell) {
  const out = element("output", {}, value.toFixed(digits));
  const input = element("input", { type: "range", min: low, max: high, step, value, "aria-label": text });
  input.oninput = () => { out.textContent = (+input.value).toFixed(digits); tell(+input.value); };
  const label = element("label", {}, `${text} `, input, out);
  label.set = to => { input.value = to; out.textContent = (+to).toFixed(digits); };
  return label;
}

export function toggle(text, on, tell) {
  const input = element("input", { type: "checkbox" });
  input.checked = on;
  input.onchange = () => tell(input.checked);
  return element("label", {}, input, ` ${text}`);
}

export const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

export const figure = value => Object.is(+value.toFixed(2), -0) ? "0" : String(+value.toFixed(2)).replace("-", "−");

export function facts(list) {
  return element("ul", { class: "facts" }, ...list.map(([value, name]) => element("li", {}, element("b", {}, value), " ", element("span", {}, name))));
}

/* A table in a box that scrolls by itself. A cell is a text, an element or a list of them; `firstIsHead`: of each row. */
export function table(label, heads, rows, firstIsHead = false) {
  const made = element("table"), head = made.createTHead().insertRow(), body = made.createTBody();
  for (const text of heads) head.append(element("th", { scope: "col" }, text));
  for (const row of rows) body.insertRow().append(...row.map((cell, k) => element(firstIsHead && !k ? "th" : "td", firstIsHead && !k ? { scope: "row" } : {}, ...[cell].flat())));
  return element("div", { class: "wide-table", tabindex: 0, role: "region", "aria-label": label }, made);
}

/* A drawing: its box (left, top, width, height), what stands in it as SVG, and what it shows, for people who do not see it. */
export function picture(box, inside, label) {
  const made = element("div");
  made.innerHTML = `<svg class="picture-svg" role="img" viewBox="${box.join(" ")}">${inside}</svg>`;
  made.firstChild.setAttribute("aria-label", label);
  return made;
}

/* The box around points whose y grows upward, with a margin; and points as an SVG line has them. */
export function boxAround(xs, ys, margin) {
  const left = Math.min(...xs) - margin, top = -Math.max(...ys) - margin;
  return [left, top, Math.max(...xs) + margin - left, margin - Math.min(...ys) - top];
}

export const line = (xs, ys) => xs.map((x, k) => `${x},${-ys[k]}`).join(" ");

/* Bars from 0 to 1 with a name and a number each. */
export const bars = rows => rows.map(([name, share, text]) => element("div", {}, element("span", {}, name), element("meter", { max: 1, value: share, "aria-label": name }), element("b", {}, text)));

/* A figure, <rc-KIND>: `begin` is called once, with what the lesson's text says of it. */
export class Figure extends HTMLElement {
  connectedCallback() {
    if (this.settings) return;
    this.settings = JSON.parse(this.querySelector("script").textContent);
    this.begin(this.settings);
  }

  begin(_settings) {}
}

/* A figure that is played move by move; exercises take the moves. `draw` shows what comes of them. */
export class Played extends Figure {
  moves = [];

  /* Keys and buttons: a move by the name of its key, texts of moves, what board and buttons are called, more buttons. */
  lay(keys, texts, board, group, ...more) {
    this.facts = element("div");
    this.said = element("p", { role: "status", "aria-live": "polite" });
    this.table = element("table", { class: "squares", tabindex: 0, "aria-label": board });
    this.table.onkeydown = event => { if (event.key in keys) { event.preventDefault(); this.move(keys[event.key]); } };
    this.place = element("div", { class: "wide-table" }, this.table);
    this.append(this.facts, this.place, this.said, element("div", { class: "keys", role: "group", "aria-label": group }, ...texts.map(([move, text]) => button(text, () => this.move(move))), ...more));
    this.draw();
  }

  give() { return [...this.moves]; }

  anew() { this.moves = []; this.draw(); }

  move(_move) {}

  draw() {}
}
