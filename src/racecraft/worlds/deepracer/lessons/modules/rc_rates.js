/* <rc-rates>: recorded curves of three learning rates; with `hidden` the third seed of each, without its name. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/parts.js";

const ORDER = ["3e-3", "3e-5", "3e-4"], LETTERS = ["A", "B", "C"];

class RatesFigure extends HTMLElement {
  connectedCallback() {
    if (this.chart) return;
    const { data, hidden } = JSON.parse(this.querySelector("script").textContent), rates = ["3e-5", "3e-4", "3e-3"];
    this.chart = chart(hidden ? t("Three curves of seeds that were not shown") : t("Progress while training, two seeds of each learning rate"));
    this.append(this.chart);
    const lines = hidden
      ? ORDER.map((rate, k) => { const row = data.rows.find(one => one.rate === rate && one.seed === 3); return [t("curve {letter}", { letter: LETTERS[k] }), x(row), row.training, "line", k + 4]; })
      : rates.flatMap((rate, k) => data.rows.filter(one => one.rate === rate && one.seed < 3).map(row => [t("learning rate {rate}, seed {seed}", { rate, seed: row.seed }), x(row), row.training, row.seed === 1 ? "line" : "dashed", k + 1]));
    this.chart.lines(t("iteration"), t("progress, % of a lap"), lines, { low: 0 });
  }
}

const x = row => row.training.map((_, k) => k + 1);
customElements.define("rc-rates", RatesFigure);
