/* A chart of lines for figures. */
import { t } from "racecraft.pages/texts.js";
import "racecraft.pages/chart.js";
import { element } from "racecraft.lessons/parts.js";

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
