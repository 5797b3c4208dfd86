/* <rc-matrix>: recorded cars, trained on rows, judged on columns; a bar and a number a cell. */
import { t } from "racecraft.pages/texts.js";
import { element } from "racecraft.lessons/parts.js";

class MatrixFigure extends HTMLElement {
  connectedCallback() {
    if (this.table) return;
    const { data } = JSON.parse(this.querySelector("script").textContent);
    this.table = element("table");
    const head = this.table.createTHead().insertRow();
    for (const name of [t("trained on"), ...data.columns]) head.append(element("th", { scope: "col" }, name.replaceAll("_", " ")));
    const body = this.table.createTBody();
    for (const row of data.rows) {
      const line = body.insertRow();
      line.append(element("th", { scope: "row" }, row.trained.replaceAll("_", " ")));
      row.progress.forEach((value, k) => line.insertCell().append(element("b", {}, `${value} %`), element("br"), t("{laps} of {starts} laps", { laps: row.full_laps[k], starts: data.starts }), ...(row.on.includes(data.columns[k]) ? [element("br"), element("i", {}, t("trained here"))] : [])));
    }
    this.append(element("div", { class: "wide-table", tabindex: 0, role: "region", "aria-label": t("Mean progress by track") }, this.table));
  }
}

customElements.define("rc-matrix", MatrixFigure);
