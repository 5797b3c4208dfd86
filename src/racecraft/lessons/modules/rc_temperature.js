/* <rc-temperature>: how likely three actions are by their values; a slider sets the temperature. */
import { t } from "racecraft.pages/texts.js";
import { Figure, bars, element, slider } from "racecraft.lessons/parts.js";
import { atTemperature } from "racecraft.lessons/family.js";

const NAMES = [t("left"), t("straight"), t("right")], VALUES = [10.1, 12, 10.1];

class TemperatureFigure extends Figure {
  begin() {
    this.bars = element("div", { class: "bars3 wide", "aria-live": "polite" });
    this.append(this.bars, element("div", { class: "tools" }, slider(t("temperature"), { low: 0.1, high: 10, step: 0.1, value: 1, digits: 1 }, value => this.draw(value))));
    this.draw(1);
  }

  draw(temperature) {
    this.bars.replaceChildren(...bars(atTemperature(VALUES, temperature).map((share, k) => [t("{name}, worth {value}", { name: NAMES[k], value: VALUES[k] }), share, `${(100 * share).toFixed(1)} %`])));
  }
}

customElements.define("rc-temperature", TemperatureFigure);
