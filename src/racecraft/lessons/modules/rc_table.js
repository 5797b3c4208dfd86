/* <rc-table>: rows of what was recorded, with the heads that the lesson's text gives them; the first cell names its row. */
import { Figure, table } from "racecraft.lessons/parts.js";

class TableFigure extends Figure {
  begin({ data, heads }) {
    this.append(table(this.getAttribute("aria-label"), heads.split(" | "), data.rows.map(row => Object.values(row).map(String)), true));
  }
}

customElements.define("rc-table", TableFigure);
