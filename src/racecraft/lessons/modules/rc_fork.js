/* <rc-fork>: a small prize near by, a large one further away; the slider of γ decides where the way leads, and with `cost` so
   does one of what a step costs. */
import { t } from "racecraft.pages/texts.js";
import { Figure, element, facts, slider } from "racecraft.lessons/parts.js";
import { COST, LEFT, RIGHT, worth } from "racecraft.lessons/fork.js";

const HERTZ = 15;

class ForkFigure extends Figure {
  begin({ cost }) {
    this.gamma = 0.9;
    this.cost = COST;
    this.live = element("div", { "aria-live": "polite" });
    this.line = element("div", { class: "wide-table" });
    const sliders = [slider("γ", { low: 0, high: 1, step: 0.001, value: this.gamma, digits: 3 }, value => { this.gamma = value; this.draw(); })];
    if (cost) sliders.push(slider(t("a step costs"), { low: 0, high: 0.4, step: 0.005, value: this.cost, digits: 3 }, value => { this.cost = value; this.draw(); }));
    this.append(this.line, this.live, element("div", { class: "tools" }, ...sliders));
    this.draw();
  }

  give() { return this.gamma; }

  draw() {
    const value = (steps, prize) => worth(this.gamma, steps, prize, this.cost);
    const left = value(...LEFT), right = value(...RIGHT), goes = right > left ? t("right") : t("left");
    const row = element("tr");
    for (let at = -LEFT[0]; at <= RIGHT[0]; at++) {
      const end = at === -LEFT[0] ? LEFT[1] : at === RIGHT[0] ? RIGHT[1] : null;
      row.append(element("td", { class: at === 0 ? "car" : end != null ? "goal" : "" }, element("span", { class: "pays" }, end != null ? t("prize") : at === 0 ? t("start") : ""), element("span", { class: "worth" }, (end ?? Math.max(value(LEFT[0] + at, LEFT[1]), value(RIGHT[0] - at, RIGHT[1]))).toFixed(2).replace("-", "−"))));
    }
    this.line.replaceChildren(element("table", { class: "squares", "aria-label": t("The line: prizes at both ends, values between") }, element("tbody", {}, row)));
    const horizon = this.gamma < 1 ? 1 / (1 - this.gamma) : Infinity;
    this.live.replaceChildren(facts([[left.toFixed(3).replace("-", "−"), t("left is worth")], [right.toFixed(3).replace("-", "−"), t("right is worth")], [goes, t("is the better way")],
      [Number.isFinite(horizon) ? `${horizon.toFixed(horizon < 100 ? 1 : 0)}` : "∞", t("steps it looks ahead, 1/(1−γ)")], [Number.isFinite(horizon) ? `${(horizon / HERTZ).toFixed(1)} s` : "∞", t("at 15 steps a second")]]));
  }
}

customElements.define("rc-fork", ForkFigure);
