/* <rc-learners>: recorded trainings in Basic; a slider chooses a moment: what the policy does at each place, and its return. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure, element, facts, figure, slider, table } from "racecraft.lessons/parts.js";

const ARROWS = ["·", "←", "→"], NAMES = [t("stays"), t("goes left"), t("goes right")], FIRST = 8, START = 10;

class LearnersFigure extends Figure {
  begin({ data, learner }) {
    const runs = data.runs.filter(one => !learner || one.learner === learner), learners = [...new Set(runs.map(one => one.learner))];
    const name = one => t("{learner}, seed {seed}", one), curves = chart(t("Mean return of 20 greedy episodes while training"));
    const select = element("select", { onchange: () => this.choose(runs[+select.value]) }, ...runs.map((one, at) => element("option", { value: at }, name(one))));
    this.panel = element("div", { "aria-live": "polite" });
    this.tools = element("div", { class: "tools" });
    this.append(element("label", {}, `${t("training")} `, select), this.panel, this.tools, curves);
    curves.lines(t("steps"), t("mean return"), runs.map(one => [name(one), one.steps, one.means, one.means.length === 1 ? "dots" : one.seed === 1 ? "line" : "dashed", 1 + (learner ? one.seed - 1 : learners.indexOf(one.learner))]));
    this.choose(runs[0]);
  }

  choose(run) {
    this.tools.replaceChildren(slider(t("evaluation"), { low: 1, high: run.means.length, step: 1, value: 1, digits: 0 }, at => this.show(run, at - 1)));
    this.show(run, 0);
  }

  show({ acts, means, steps }, at) {
    const row = acts[at].map(act => element("span", { role: "img", "aria-label": NAMES[act] }, ARROWS[act]));
    this.panel.replaceChildren(
      facts([[steps[at].toLocaleString(), t("steps so far")], [figure(means[at]), t("mean return")], [NAMES[acts[at][START - FIRST]], t("at the start, place {place}", { place: START })]]),
      table(t("What the policy does at each place"), row.map((_, k) => FIRST + k), [row]),
    );
  }
}

customElements.define("rc-learners", LearnersFigure);
