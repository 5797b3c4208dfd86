/* <rc-schedule>: what of ML-Agents' PPO falls while it learns; a slider is the step, another the last step. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure, element, facts, slider } from "racecraft.lessons/parts.js";
import { STARTS, scheduled } from "racecraft.worlds.unity.lessons/schedule.js";

const POINTS = Array.from({ length: 51 }, (_, k) => k / 50), THOUSAND = 1000;

class ScheduleFigure extends Figure {
  begin() {
    this.at = 250 * THOUSAND;
    this.last = 500 * THOUSAND;
    this.panel = element("div", { "aria-live": "polite" });
    this.chart = chart(t("Share of its first value that each has left"));
    const sliders = [["at", t("steps done, in thousands")], ["last", t("max_steps, in thousands")]].map(([name, text]) =>
      slider(text, { low: 10, high: 1000, step: 10, value: this[name] / THOUSAND, digits: 0 }, value => { this[name] = THOUSAND * value; this.draw(); }));
    this.append(this.panel, element("div", { class: "tools" }, ...sliders), this.chart);
    this.draw();
  }

  draw() {
    const names = Object.keys(STARTS), done = this.at / this.last;
    this.panel.replaceChildren(facts(names.map(name => [scheduled(name, done).toPrecision(3), name])));
    this.chart.lines(t("steps"), t("share"), names.map(name => [name, POINTS.map(one => one * this.last), POINTS.map(one => scheduled(name, one) / STARTS[name])]), { low: 0 });
  }
}

customElements.define("rc-schedule", ScheduleFigure);
