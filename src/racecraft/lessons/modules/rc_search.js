/* <rc-search>: three moves that a search has tried; each press tries the one with the highest score once more. */
import { t } from "racecraft.pages/texts.js";
import { button, element, slider } from "racecraft.lessons/parts.js";
import { searchScores } from "racecraft.lessons/family.js";

const WORTHS = [0.5, 0.4, 0.1], PRIORS = [0.5, 0.3, 0.2], VISITS = [6, 3, 1];

class SearchFigure extends HTMLElement {
  connectedCallback() {
    if (this.table) return;
    this.c = 1.5;
    this.visits = [...VISITS];
    this.table = element("table", { "aria-label": t("Moves with visits, values, priors and scores") });
    this.append(element("div", { class: "wide-table", tabindex: 0, role: "region", "aria-label": t("Moves that a search tries"), "aria-live": "polite" }, this.table),
      element("div", { class: "tools" }, slider("c", { low: 0, high: 4, step: 0.1, value: this.c, digits: 1 }, value => { this.c = value; this.draw(); }),
        button(t("Try the highest"), () => { this.visits[this.next]++; this.draw(); }), button(t("From the beginning"), () => { this.visits = [...VISITS]; this.draw(); }, "plain")));
    this.draw();
  }

  draw() {
    const scores = searchScores(WORTHS, PRIORS, this.visits, this.c);
    this.next = scores.indexOf(Math.max(...scores));
    this.table.replaceChildren();
    const head = this.table.createTHead().insertRow(), body = this.table.createTBody();
    for (const name of [t("move"), t("visits n"), t("value Q"), t("prior P"), t("score"), t("next")]) head.append(element("th", { scope: "col" }, name));
    scores.forEach((score, k) => { const row = body.insertRow(); for (const text of [k + 1, this.visits[k], WORTHS[k], PRIORS[k], score.toFixed(3), k === this.next ? t("this one") : ""]) row.insertCell().textContent = text; });
  }
}

customElements.define("rc-search", SearchFigure);
