/* <rc-stress>: a car's laps under each disturbance by itself, with their intervals. */
import { t } from "racecraft.pages/texts.js";
import { element } from "racecraft.lessons/parts.js";

class StressFigure extends HTMLElement {
  connectedCallback() {
    if (this.table) return;
    const { tries, rows } = JSON.parse(this.querySelector("script").textContent).data;
    this.table = element("table");
    const head = this.table.createTHead().insertRow(), body = this.table.createTBody();
    for (const name of [t("disturbance"), t("laps of {tries}", { tries }), t("share, interval")]) head.append(element("th", { scope: "col" }, name));
    for (const row of rows) {
      const line = body.insertRow();
      line.append(element("th", { scope: "row" }, row.disturbance));
      line.insertCell().append(element("b", {}, String(row.laps)), " ", element("meter", { max: tries, value: row.laps, "aria-label": row.disturbance }));
      line.insertCell().textContent = t("{low} to {high} %", { low: row.low, high: row.high });
    }
    this.append(element("div", { class: "wide-table", tabindex: 0, role: "region", "aria-label": t("Laps under each disturbance") }, this.table));
  }
}

customElements.define("rc-stress", StressFigure);
