/* <rc-stress>: a car's laps under each disturbance by itself, with their intervals. */
import { t } from "racecraft.pages/texts.js";
import { Figure, element, table } from "racecraft.lessons/parts.js";

class StressFigure extends Figure {
  begin({ data: { tries, rows } }) {
    const cells = rows.map(row => [row.disturbance, [element("b", {}, String(row.laps)), " ", element("meter", { max: tries, value: row.laps, "aria-label": row.disturbance })], t("{low} to {high} %", { low: row.low, high: row.high })]);
    this.append(table(t("Laps under each disturbance"), [t("disturbance"), t("laps of {tries}", { tries }), t("share, interval")], cells, true));
  }
}

customElements.define("rc-stress", StressFigure);
