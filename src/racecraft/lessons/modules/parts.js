/* Small pieces that figures are made of: elements, sliders, charts, numbers. */
import { t } from "racecraft.pages/texts.js";
import "racecraft.pages/chart.js";

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

/* A chart of lines: [name, x, y, look, colour]. */
export function chart(label) {
  const made = element("rc-chart", { "aria-label": label });
  made.append(element("figure", {}, element("figcaption", {}, label), element("details", {}, element("summary", {}, t("as table")), element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": label }, element("table")))));
  made.lines = (x, y, lines, more = {}) => {
    const series = lines.map(([name, xs, ys, look = "line", colour]) => ({ name, x: xs, y: ys, look, right: false, faint: look === "faint", colour: colour ?? 1 + lines.findIndex(one => one[0] === name) }));
    for (const one of series) if (one.look === "faint") one.look = "line";
    made.show({ x, y, right: "", low: null, high: null, log: false, logX: false, names: [], smooth: false, digits: 2, series, bands: [], marks: [], levels: [], ...more });
    made.writeTable();
  };
  return made;
}

export const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

export const figure = value => Object.is(+value.toFixed(2), -0) ? "0" : String(+value.toFixed(2)).replace("-", "−");

export function facts(list) {
  return element("ul", { class: "facts" }, ...list.map(([value, name]) => element("li", {}, element("b", {}, value), " ", element("span", {}, name))));
}
