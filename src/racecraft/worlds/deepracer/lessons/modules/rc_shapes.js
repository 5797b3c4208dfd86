/* <rc-shapes>: centre lines of tracks, each in a box of its own with letter, length and width. */
import { t } from "racecraft.pages/texts.js";
import { Figure, boxAround, element, line, picture } from "racecraft.lessons/parts.js";

class ShapesFigure extends Figure {
  begin({ data: { tracks } }) {
    this.append(element("div", { class: "four" }, ...tracks.map(({ letter, length, width, points }) => {
      const xs = points.map(one => one[0]), ys = points.map(one => one[1]), name = letter.toUpperCase();
      const drawn = picture(boxAround(xs, ys, 100), `<polygon class="road" stroke-width="${100 * width}" points="${line(xs, ys)}"/>`, t("Centre line of track {name}", { name }));
      const size = t("{length} m long, {width} m wide", { length: length.toFixed(1), width: width.toFixed(2) });
      drawn.append(element("b", {}, name), ` ${size}`);
      return drawn;
    })));
  }
}

customElements.define("rc-shapes", ShapesFigure);
