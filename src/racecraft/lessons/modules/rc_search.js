/* <rc-search>: three moves that a search has tried; each press tries the one with the highest score once more. */
import { t } from "racecraft.pages/texts.js";
import { Figure, button, element, slider, table } from "racecraft.lessons/parts.js";
import { searchScores } from "racecraft.lessons/family.js";

const WORTHS = [0.5, 0.4, 0.1], PRIORS = [0.5, 0.3, 0.2], VISITS = [6, 3, 1];

class SearchFigure extends Figure {
  begin() {
    this.c = 1.5;
    this.visits = [...VISITS];
    this.live = element("div", { "aria-live": "polite" });
    this.append(this.live, element("div", { class: "tools" }, slider("c", { low: 0, high: 4, step: 0.1, value: this.c, digits: 1 }, value => { this.c = value; this.draw(); }),
      button(t("Try the highest"), () => { this.visits[this.next]++; this.draw(); }), button(t("From the beginning"), () => { this.visits = [...VISITS]; this.draw(); }, "plain")));
    this.draw();
  }

  draw() {
    const scores = searchScores(WORTHS, PRIORS, this.visits, this.c);
    this.next = scores.indexOf(Math.max(...scores));
    const rows = scores.map((score, k) => [k + 1, this.visits[k], WORTHS[k], PRIORS[k], score.toFixed(3), k === this.next ? t("this one") : ""]);
    this.live.replaceChildren(table(t("Moves that a search tries"), [t("move"), t("visits n"), t("value Q"), t("prior P"), t("score"), t("next")], rows));
  }
}

customElements.define("rc-search", SearchFigure);
