/* <rc-temperature>: how likely three actions are by their values; a slider sets the temperature. */
import { t } from "racecraft.pages/texts.js";
import { element, slider } from "racecraft.lessons/parts.js";
import { atTemperature } from "racecraft.lessons/family.js";

const NAMES = [t("left"), t("straight"), t("right")], VALUES = [10.1, 12, 10.1];

class TemperatureFigure extends HTMLElement {
  connectedCallback() {
    if (this.bars) return;
    this.bars = element("div", { class: "bars3 wide", "aria-live": "polite" });
    this.append(this.bars, element("div", { class: "tools" }, slider(t("temperature"), { low: 0.1, high: 10, step: 0.1, value: 1, digits: 1 }, value => this.draw(value))));
    this.draw(1);
  }

  draw(temperature) {
    this.bars.replaceChildren(...atTemperature(VALUES, temperature).map((share, k) => element("div", {}, element("span", {}, t("{name}, worth {value}", { name: NAMES[k], value: VALUES[k] })), element("meter", { max: 1, value: share, "aria-label": NAMES[k] }), element("span", {}, `${(100 * share).toFixed(1)} %`))));
  }
}

customElements.define("rc-temperature", TemperatureFigure);
