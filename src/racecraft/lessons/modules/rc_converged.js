/* <rc-converged>: three trainings on the grid, each the mean of twenty cars, as far as a pupil may see them. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure } from "racecraft.lessons/parts.js";
import { Chance, learn, makeGrid } from "racecraft.lessons/grid.js";

const CURVES = [{ epsilon: 0.6 }, { epsilon: 0.3 }, { epsilon: 0.6, epsilonLast: 0 }], SEEDS = 20, FIRST_SEED = 1000, SHOWN = 400, WINDOW = 50;

class ConvergedFigure extends Figure {
  begin() {
    const made = chart(t("Mean total of the 50 drives from each drive on"));
    this.append(made);
    const lines = CURVES.map((setting, k) => {
      const trained = Array.from({ length: SEEDS }, (_, seed) => learn(makeGrid(), { ...setting, drives: 600 }, new Chance(FIRST_SEED + seed)).totals);
      const xs = Array.from({ length: SHOWN - WINDOW + 1 }, (_, at) => at);
      return [t("curve {letter}", { letter: "ABC"[k] }), xs, xs.map(at => trained.reduce((sum, row) => sum + row.slice(at, at + WINDOW).reduce((a, b) => a + b), 0) / WINDOW / SEEDS), "line", k + 1];
    });
    made.lines(t("drive"), t("mean total"), lines, { low: 0 });
  }
}

customElements.define("rc-converged", ConvergedFigure);
