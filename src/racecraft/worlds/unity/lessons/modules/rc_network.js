/* <rc-network>: a learned network of Basic computes here; a button lets it take the step that it decides. */
import { t } from "racecraft.pages/texts.js";
import { Figure, button, element, facts, figure, table } from "racecraft.lessons/parts.js";
import { PLACES, play } from "racecraft.worlds.unity.lessons/basic.js";
import { forward } from "racecraft.worlds.unity.lessons/network.js";

const NAMES = [t("stay"), t("left"), t("right")];

class NetworkFigure extends Figure {
  begin({ data }) {
    this.layers = data.network;
    this.panel = element("div", { "aria-live": "polite" });
    this.append(this.panel, element("div", { class: "tools" }, button(t("Take its step"), () => this.step()), button(t("New episode"), () => this.show([]), "plain")));
    this.show([]);
  }

  step() {
    if (!play(this.actions).ended) this.show([...this.actions, this.decided]);
  }

  show(actions) {
    const { place, steps, total, ended } = play(actions), observation = Array.from({ length: PLACES }, (_, k) => +(k === place));
    const [inner, scores] = forward(observation, this.layers);
    this.actions = actions;
    this.decided = scores.indexOf(Math.max(...scores));
    const marked = scores.map((score, k) => k === this.decided ? element("b", {}, figure(score)) : figure(score));
    this.panel.replaceChildren(
      facts([[place, t("place: input {place} is 1, all others 0", { place })], [ended ? t("ended") : NAMES[this.decided], t("decision")], [steps, t("steps")], [figure(total), t("return so far")]]),
      table(t("Eight inner numbers"), inner.map((_, k) => t("number {k}", { k: k + 1 })), [inner.map(figure)]),
      table(t("Three scores"), NAMES, [marked]),
    );
  }
}

customElements.define("rc-network", NetworkFigure);
