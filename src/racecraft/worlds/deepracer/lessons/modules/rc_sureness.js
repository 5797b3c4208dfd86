/* <rc-sureness>: how likely a network's two likeliest actions were at each step of a lap. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/parts.js";

class SurenessFigure extends HTMLElement {
  connectedCallback() {
    if (this.chart) return;
    const { steps } = JSON.parse(this.querySelector("script").textContent).data, at = steps.map((_, k) => k + 1);
    this.chart = chart(t("The two likeliest actions at each step of a lap"));
    this.append(this.chart);
    this.chart.lines(t("step"), t("probability, %"), [[t("likeliest action"), at, steps.map(one => one[2])], [t("second"), at, steps.map(one => one[3])]], { low: 0 });
  }
}

customElements.define("rc-sureness", SurenessFigure);
