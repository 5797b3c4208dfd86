/* <rc-chart>: a chart of what `pages/chart.py` describes, drawn by uPlot; nothing else calls uPlot.

   Inside it stand a figure with its caption and its table, which need no script, and the data as JSON.
   `element.show(plot)` draws other data, as a live page does; a click on a point sends `rc-choose` with its x.
   Keys: ← → move the cursor, with Shift by ten; + − zoom; 0 or Escape show all. */
import { words as long } from "racecraft.pages/ask.js";
import { t } from "racecraft.pages/texts.js";
import { onTokens, token } from "racecraft.pages/tokens.js";
import uPlot from "racecraft.pages/uplot.js";

const colourOf = number => token(number <= 6 ? `--series-${number}` : "--series-more");
const soft = (number, share) => `color-mix(in srgb, ${colourOf(number)} ${100 * share}%, transparent)`;
const WHOLE = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 1e7, 1e8, 1e9];
const WIDTH = { line: 2, both: 2, dashed: 1.6, steps: 2, dots: 0, bars: 0 };

class Chart extends HTMLElement {
  connectedCallback() {
    this.quit = onTokens(() => this.plot?.redraw());
    if (!this.place) this.lay();
    const data = this.querySelector("script");
    if (data && !this.told) this.show(JSON.parse(data.textContent));
    this.wide = new ResizeObserver(() => this.fit());
    this.wide.observe(this.place);
  }

  disconnectedCallback() {
    this.quit();
    this.wide.disconnect();
  }

  lay() {   // the plot and its tools stand between the caption and the table
    const figure = this.querySelector("figure") || this.appendChild(document.createElement("figure"));
    const caption = figure.querySelector("figcaption");
    this.key = document.createElement("ul");
    this.key.className = "key";
    this.place = document.createElement("div");
    this.place.className = "plot";
    this.place.tabIndex = 0;
    this.place.setAttribute("role", "slider");
    this.place.setAttribute("aria-label", this.getAttribute("aria-label") || caption?.textContent || t("chart"));
    this.tools = document.createElement("div");
    this.tools.className = "tools";
    const table = figure.querySelector("details");
    figure.insertBefore(this.key, table); figure.insertBefore(this.place, table); figure.insertBefore(this.tools, table);
    this.place.addEventListener("keydown", event => this.press(event));
    this.smoothing = 0;
    this.hidden_ = new Set();
  }

  show(told) {
    const { min, max } = this.zoomed ? this.plot.scales.x : {};
    this.told = told;
    this.arrange();
    const looks = looksOf(this);
    if (this.plot && looks === this.looks) this.plot.setData(this.columns);   // values alone: a live page costs little
    else this.build();
    this.looks = looks;
    if (min !== undefined) this.plot.setScale("x", { min, max });
    this.nothing?.remove();
    if (!this.columns[0].length) {
      this.nothing = this.place.appendChild(document.createElement("p"));
      this.nothing.className = "nothing"; this.nothing.textContent = t("no values yet");
    }
  }

  build() {
    this.plot?.destroy();
    this.plot = new uPlot(this.options(), this.columns, this.place);
    this.layTools();
    this.layKey();
  }

  arrange() {   // all series on one x; what is missing there is no gap
    const { series, bands, smooth } = this.told;
    this.drawn = [];
    const tables = [];
    for (const [k, one] of series.entries()) {
      const [x, y] = apart(...inOrder(one.x, one.y));
      const smoothed = smooth && this.smoothing > 0 && one.look !== "dots" && one.look !== "bars";
      tables.push([x, y]); this.drawn.push({ ...one, k, behind: smoothed });
      if (smoothed) { tables.push([x, average(y, this.smoothing)]); this.drawn.push({ ...one, k, look: "line", over: true }); }
    }
    for (const band of bands) {
      tables.push([band.x, band.low, band.high]);
      this.drawn.push({ ...band, edge: true, k: -1 }, { ...band, edge: true, k: -1, upper: true });
    }
    this.columns = tables.length ? uPlot.join(tables) : [[]];
    this.isWhole = series.every(one => one.x.every(Number.isInteger));
  }

  options() {
    const { told } = this, named = !!told.names?.length, quiet = () => token("--quiet"), line = () => token("--line");
    const font = `${token("--axis") || "11px"} ${token("--text")}`;
    const axis = { stroke: quiet, font, labelFont: font, labelSize: 16, ticks: { show: false }, grid: { stroke: line, width: 1 } };
    const range = (plot, low, high) => {
      if (low == null) return [0, 1];
      if (told.log) return [low, high];
      const from = told.low != null ? Math.min(told.low, low) : low, to = told.high != null ? Math.max(told.high, high) : high;
      const [soft0, soft1] = uPlot.rangeNum(from, to === from ? from + (Math.abs(from) || 1) : to, 0.06, true);
      return [told.low != null && low >= told.low ? told.low : soft0, told.high != null && high <= told.high ? told.high : soft1];
    };
    return {
      width: this.place.clientWidth || 320, height: this.place.clientHeight || 230, padding: [8, told.right ? 10 : 18, 0, 0],   // half a figure stands beyond the last line of the grid
      legend: { show: false },
      cursor: { sync: { key: `x ${told.x}`, scales: ["x", null] }, drag: { x: true, y: false, setScale: true, dist: 8 },
        points: { size: 8, fill: (plot, k) => plot.series[k].stroke(plot, k) }, focus: { prox: 24 } },
      scales: { x: { time: false, distr: told.logX ? 3 : 1, range: (plot, low, high) => this.wholeBars(low, high) }, y: { range, distr: told.log ? 3 : 1 }, right: { range: (plot, low, high) => low == null ? [0, 1] : uPlot.rangeNum(low, high, 0.06, true) } },
      axes: [{ ...axis, grid: { show: false }, label: told.x, space: 56, size: 30, incrs: named || this.isWhole ? WHOLE : undefined, values: (plot, all) => all.map(value => named ? told.names[value] ?? "" : short(value)) },
        { ...axis, label: told.y, size: 44, space: 38, values: (plot, all) => all.map(short) },
        ...(told.right ? [{ ...axis, scale: "right", side: 1, label: told.right, size: 44, grid: { show: false }, values: (plot, all) => all.map(short) }] : [])],
      series: [{}, ...this.drawn.map(one => this.look(one))],
      bands: this.bandPairs(),
      hooks: { setCursor: [plot => this.tell(plot)], setScale: [(plot, key) => key === "x" && this.tellZoom()],
        drawClear: [plot => this.drawMarks(plot)], draw: [plot => this.drawLevels(plot)],
        ready: [plot => plot.over.addEventListener("click", () => this.choose())] },
    };
  }

  wholeBars(low, high) {   // room for half a bar at both ends, where all are shown
    const xs = this.columns[0];
    if (low == null) return [0, 1];
    if (xs.length === 1 || high - low < 1e-6 * Math.max(1, Math.abs(high))) return [xs[0] - 1, xs[0] + 1];
    if (xs.length < 2 || low > xs[0] || high < xs.at(-1) || !this.told.series.some(one => one.look === "bars")) return [low, high];
    const half = (xs.at(-1) - xs[0]) / (xs.length - 1) / 2;
    return [low - half, high + half];
  }

  look(one) {
    const stroke = one.edge ? () => "transparent" : () => one.behind || one.faint ? soft(one.colour, one.behind ? 0.35 : 0.4) : colourOf(one.colour);
    const dots = one.look === "dots" || one.look === "both";
    return { label: one.name, scale: one.right ? "right" : "y", stroke, show: !this.hidden_.has(one.k),
      width: one.edge ? 0 : one.faint || one.behind ? 1.2 : WIDTH[one.look] ?? 2, dash: one.look === "dashed" ? [6, 5] : undefined,
      paths: one.look === "bars" ? uPlot.paths.bars({ size: [0.8, 40] }) : one.look === "steps" ? uPlot.paths.stepped({ align: 1 }) : one.look === "dots" ? () => null : undefined,
      fill: one.look === "bars" ? () => soft(one.colour, 0.7) : undefined,
      points: { show: dots ? true : one.edge || one.over || one.look === "bars" ? false : undefined, size: one.look === "dots" ? 5 : 6, width: 0, fill: stroke } };
  }

  bandPairs() {
    const pairs = [];
    this.drawn.forEach((one, k) => { if (one.upper) pairs.push({ series: [k + 1, k], fill: () => soft(one.colour, 0.18) }); });
    return pairs;
  }

  drawMarks(plot) {
    const { ctx, bbox } = plot, ratio = devicePixelRatio || 1;
    ctx.save(); ctx.font = `${11 * ratio}px ${token("--text")}`; ctx.textAlign = "center";
    for (const { x, end, text } of this.told.marks) {
      const from = plot.valToPos(x, "x", true), to = end == null ? from : plot.valToPos(end, "x", true);
      if (to < bbox.left || from > bbox.left + bbox.width) continue;
      const left = Math.max(from, bbox.left), right = Math.min(to, bbox.left + bbox.width);
      ctx.fillStyle = token(end == null ? "--edge" : "--slot");
      ctx.fillRect(left, bbox.top, Math.max(ratio, right - left), bbox.height);
      ctx.fillStyle = token("--quiet"); ctx.fillText(text, (left + right) / 2, bbox.top + 11 * ratio);
    }
    ctx.restore();
  }

  drawLevels(plot) {
    const { ctx, bbox } = plot, ratio = devicePixelRatio || 1;
    ctx.save(); ctx.font = `${11 * ratio}px ${token("--text")}`; ctx.textAlign = "right"; ctx.textBaseline = "bottom"; ctx.strokeStyle = ctx.fillStyle = token("--quiet"); ctx.setLineDash([5 * ratio, 4 * ratio]);
    for (const { y, text } of this.told.levels) {
      const at = plot.valToPos(y, "y", true);
      if (at < bbox.top || at > bbox.top + bbox.height) continue;
      ctx.beginPath(); ctx.moveTo(bbox.left, at); ctx.lineTo(bbox.left + bbox.width, at); ctx.stroke();
      ctx.fillText(text, bbox.left + bbox.width - 4 * ratio, at - 2 * ratio);
    }
    ctx.restore();
  }

  writeTable() {   // for data that a page's module brought: at most sixty rows, when somebody opens it
    const details = this.querySelector("details");
    details.ontoggle ??= () => this.writeTable();
    if (!details.open) return;
    const { x, series, digits } = this.told, [xs, ...columns] = this.columns, every = Math.max(1, Math.ceil(xs.length / 60));
    details.querySelector("summary").textContent = every > 1 ? t("as table, one row of {every}", { every }) : t("as table");
    const shown = this.drawn.map((one, k) => [one, columns[k]]).filter(([one]) => !one.over && !one.edge);
    const table = details.querySelector("table"), head = table.createTHead();
    head.replaceChildren(); table.tBodies[0]?.remove();
    const first = head.insertRow(), body = table.createTBody();
    for (const name of [x, ...series.map(one => one.name)]) { const cell = document.createElement("th"); cell.scope = "col"; cell.className = "right"; cell.textContent = name; first.append(cell); }
    for (let k = 0; k < xs.length; k += every) {
      const row = body.insertRow();
      for (const value of [xs[k], ...shown.map(([, column]) => column[k])]) {
        const cell = row.insertCell();
        cell.className = "right"; cell.textContent = value == null ? "–" : long(value, value === xs[k] ? 0 : digits);
      }
    }
  }

  layKey() {
    const { series, digits } = this.told;
    this.key.replaceChildren(...series.map((one, k) => {
      const item = document.createElement("li"), button = document.createElement("button");
      button.type = "button";
      button.innerHTML = `<svg aria-hidden="true"><line x1="0" x2="18" y1="5" y2="5" stroke-width="2.5" ${one.look === "dashed" ? 'stroke-dasharray="5 3"' : ""}/></svg> <span></span> <b></b>`;
      const ink = `var(${one.colour <= 6 ? `--series-${one.colour}` : "--series-more"})`;
      button.querySelector("line").style.stroke = ink;
      button.querySelector("span").textContent = one.name;
      button.setAttribute("aria-pressed", !this.hidden_.has(k));
      button.title = t("show or hide");
      button.onclick = () => {
        if (this.hidden_.has(k)) this.hidden_.delete(k); else this.hidden_.add(k);
        button.setAttribute("aria-pressed", !this.hidden_.has(k));
        this.drawn.forEach((other, s) => { if (other.k === k) this.plot.setSeries(s + 1, { show: !this.hidden_.has(k) }); });
      };
      item.append(button);
      return item;
    }));
    this.where = this.key.appendChild(document.createElement("li"));
    this.digits = digits;
  }

  layTools() {
    if (this.whole) return;
    this.whole = document.createElement("button");
    this.whole.type = "button"; this.whole.textContent = t("show all"); this.whole.hidden = true;
    this.whole.onclick = () => this.zoom(null);
    this.tools.append(this.whole);
    if (!this.told.smooth) return;
    const label = document.createElement("label"), slider = document.createElement("input"), says = document.createElement("span");
    slider.type = "range"; slider.min = "0"; slider.max = "0.95"; slider.step = "0.05"; slider.value = "0";
    label.append(`${t("smoothing")} `, slider, " ", says);
    slider.oninput = () => { this.smoothing = +slider.value; says.textContent = this.smoothing ? t("{share}, over the true values", { share: this.smoothing }) : ""; this.show(this.told); };
    this.tools.prepend(label);
  }

  tell(plot) {   // values at the cursor, in the key
    const row = plot.cursor.idx, x = row == null ? null : +this.columns[0][row].toPrecision(6);
    this.key.querySelectorAll("b").forEach((value, k) => {
      const at = this.drawn.findIndex(one => one.k === k && !one.over);
      const y = row == null ? null : near(this.columns[at + 1], row);
      value.textContent = y == null ? "" : long(y, this.digits);
    });
    this.where.textContent = x == null ? "" : this.told.names?.[x] ? this.told.names[x] : `${this.told.x.split(",")[0]} ${long(x, Number.isInteger(x) ? 0 : 2)}`;
    this.place.setAttribute("aria-valuemin", 0);
    this.place.setAttribute("aria-valuemax", Math.max(1, this.columns[0].length - 1));
    this.place.setAttribute("aria-valuenow", row ?? 0);
    this.place.setAttribute("aria-valuetext", x == null ? t("no place chosen") : this.key.textContent);
  }

  choose() {
    const row = this.plot.cursor.idx;
    if (row != null) this.dispatchEvent(new CustomEvent("rc-choose", { detail: { x: this.columns[0][row] }, bubbles: true }));
  }

  press(event) {
    const { plot, columns: [xs] } = this;
    if (event.ctrlKey || event.metaKey || event.altKey || !xs.length) return;
    const step = event.shiftKey ? 10 : 1, row = plot.cursor.idx ?? -1;
    const move = to => plot.setCursor({ left: plot.valToPos(xs[Math.max(0, Math.min(xs.length - 1, to))], "x"), top: plot.over.clientHeight / 2 });
    const acts = { ArrowRight: () => move(row + step), ArrowLeft: () => move(row - step), Home: () => move(0), End: () => move(xs.length - 1),
      "+": () => this.zoom(0.5), "=": () => this.zoom(0.5), "-": () => this.zoom(2), "0": () => this.zoom(null), Escape: () => this.zoom(null), Enter: () => this.choose() };
    if (acts[event.key]) { event.preventDefault(); event.stopPropagation(); acts[event.key](); }
  }

  zoom(factor) {
    const { plot, columns: [xs] } = this, first = xs[0], last = xs.at(-1), { min, max } = plot.scales.x;
    const middle = plot.cursor.idx != null ? xs[plot.cursor.idx] : (min + max) / 2, half = factor && (max - min) / 2 * factor;
    if (!factor || 2 * half >= last - first) plot.setScale("x", { min: first, max: last });
    else plot.setScale("x", { min: Math.max(first, middle - half), max: Math.min(last, middle + half) });
  }

  tellZoom() {
    const xs = this.columns[0], { min, max } = this.plot?.scales.x || {};
    this.zoomed = xs.length > 0 && min !== undefined && (min > xs[0] || max < xs.at(-1));
    if (this.whole) this.whole.hidden = !this.zoomed;
  }

  fit() {
    const width = this.place.clientWidth;
    if (this.plot && width && width !== this.plot.width) this.plot.setSize({ width, height: this.place.clientHeight });
  }
}

function looksOf({ told: { series, bands, marks, levels, ...axes }, drawn, isWhole }) {   // all but values
  return JSON.stringify([axes, isWhole, drawn.map(({ x, y, low, high, ...look }) => look)]);
}

function inOrder(x, y) {
  if (x.every((value, k) => !k || value >= x[k - 1])) return [x, y];
  const order = x.map((_, k) => k).sort((a, b) => x[a] - x[b]);
  return [order.map(k => x[k]), order.map(k => y[k])];
}

function apart(x, y) {   // several values at one x are kept: joined tables have each x once, so they move by a hair
  const hair = (x.at(-1) - x[0] || 1) * 1e-8;
  let count = 0;
  return [x.map((value, k) => value + hair * (count = k && value === x[k - 1] ? count + 1 : 0)), y];
}

function average(y, weight) {   // exponential, free of the pull to its first value
  let sum = 0, parts = 0;
  return y.map(value => {
    if (value == null) return value;
    sum = sum * weight + value * (1 - weight); parts = parts * weight + 1 - weight;
    return sum / parts;
  });
}

function near(column, row) {   // a series without a value just there tells its latest before
  for (let k = row; column && k >= 0 && k > row - 40; k--) if (column[k] != null) return column[k];
  return null;
}

const compact = new Intl.NumberFormat("en", { notation: "compact", maximumFractionDigits: 1 });
const plain = new Intl.NumberFormat("en", { maximumFractionDigits: 4 });
const short = value => value == null ? "" : Math.abs(value) >= 10000 ? compact.format(value)
  : value !== 0 && Math.abs(value) < 0.001 ? value.toExponential(0) : plain.format(value);

customElements.define("rc-chart", Chart);
export { Chart };
