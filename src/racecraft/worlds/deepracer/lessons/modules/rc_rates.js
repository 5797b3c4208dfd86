/* <rc-rates>: recorded curves of three learning rates; with `hidden` the third seed of each, without its name. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure } from "racecraft.lessons/parts.js";

const ORDER = ["3e-3", "3e-5", "3e-4"], LETTERS = ["A", "B", "C"], RATES = ["3e-5", "3e-4", "3e-3"];

class RatesFigure extends Figure {
  begin({ data, hidden }) {
    const made = chart(hidden ? t("Three curves of seeds that were not shown") : t("Progress while training, two seeds of each learning rate"));
    const at = row => row.training.map((_, k) => k + 1), of = (rate, isWanted) => data.rows.filter(one => one.rate === rate && isWanted(one.seed));
    const lines = hidden
      ? ORDER.map((rate, k) => { const [row] = of(rate, seed => seed === 3); return [t("curve {letter}", { letter: LETTERS[k] }), at(row), row.training, "line", k + 4]; })
      : RATES.flatMap((rate, k) => of(rate, seed => seed < 3).map(row => [t("learning rate {rate}, seed {seed}", { rate, seed: row.seed }), at(row), row.training, row.seed === 1 ? "line" : "dashed", k + 1]));
    this.append(made);
    made.lines(t("iteration"), t("progress, % of a lap"), lines, { low: 0 });
  }
}

customElements.define("rc-rates", RatesFigure);
