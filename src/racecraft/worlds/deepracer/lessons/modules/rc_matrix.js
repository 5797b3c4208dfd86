/* <rc-matrix>: recorded cars, trained on rows, judged on columns. */
import { t } from "racecraft.pages/texts.js";
import { Figure, element, table } from "racecraft.lessons/parts.js";

class MatrixFigure extends Figure {
  begin({ data: { columns, rows, starts } }) {
    const named = name => name.replaceAll("_", " ");
    const cell = (row, value, k) => [element("b", {}, `${value} %`), element("br"), t("{laps} of {starts} laps", { laps: row.full_laps[k], starts }), ...(row.on.includes(columns[k]) ? [element("br"), element("i", {}, t("trained here"))] : [])];
    this.append(table(t("Mean progress by track"), [t("trained on"), ...columns.map(named)], rows.map(row => [named(row.trained), ...row.progress.map((value, k) => cell(row, value, k))]), true));
  }
}

customElements.define("rc-matrix", MatrixFigure);
