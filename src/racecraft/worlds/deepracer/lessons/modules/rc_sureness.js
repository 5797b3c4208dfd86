/* <rc-sureness>: how likely a network's two likeliest actions were at each step of a lap. */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure } from "racecraft.lessons/parts.js";

class SurenessFigure extends Figure {
  begin({ data: { steps } }) {
    const made = chart(t("The two likeliest actions at each step of a lap")), at = steps.map((_, k) => k + 1);
    this.append(made);
    made.lines(t("step"), t("probability, %"), [[t("likeliest action"), at, steps.map(one => one[2])], [t("second"), at, steps.map(one => one[3])]], { low: 0 });
  }
}

customElements.define("rc-sureness", SurenessFigure);
