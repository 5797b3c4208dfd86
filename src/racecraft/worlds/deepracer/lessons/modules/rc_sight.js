/* <rc-sight>: pictures that a network decided at, their heat, and a patch that covers a part; what it decides is recorded. */
import { t } from "racecraft.pages/texts.js";
import { Figure, bars, element, facts, picture, slider } from "racecraft.lessons/parts.js";
import { placeOf } from "racecraft.worlds.deepracer.lessons/sight.js";

const MOST = 5;

class SightFigure extends Figure {
  begin({ data }) {
    const { rows, columns, pictures } = data;
    this.data = data;
    this.number = 1;
    this.patch = [0, 0, 0, 1];
    this.maps = element("div", { class: "two" });
    this.told = element("div", { "aria-live": "polite" });
    const tell = (text, at, low, high) => slider(text, { low, high, step: 1, value: low, digits: 0 }, value => { this.patch[at] = at < 2 ? value - 1 : value; this.draw(); });
    this.append(this.maps, element("div", { class: "tools" },
      slider(t("picture"), { low: 1, high: pictures.length, step: 1, value: 1, digits: 0 }, value => { this.number = value; this.draw(); }),
      tell(t("patch from row"), 0, 1, rows), tell(t("from column"), 1, 1, columns), tell(t("squares high"), 2, 0, rows), tell(t("squares wide"), 3, 1, columns)), this.told);
    this.draw();
  }

  /** The patch within the picture; null: none. @returns {[number, number, number, number] | null} */
  get cover() {
    const [top, left, height, width] = this.patch, { rows, columns } = this.data;
    return height ? [top, left, Math.min(height, rows - top), Math.min(width, columns - left)] : null;
  }

  give() { return this.cover && { picture: this.number, patch: this.cover }; }

  draw() {
    const { actions, rows, columns, pictures } = this.data, one = pictures[this.number - 1], cover = this.cover, place = cover && placeOf(rows, columns, cover);
    const box = [0, 0, this.data.width, this.data.height];
    this.maps.replaceChildren(picture(box, this.camera(one, cover), t("The camera's picture at step {step}", { step: one.step })), picture(box, this.heat(one, cover), t("Heat of each square, per cent: {list}", { list: one.heat.map(Math.round).join(" ") })));
    const best = one.shares.indexOf(Math.max(...one.shares)), likeliest = actions.map((name, k) => [one.shares[k], name]).sort((a, b) => b[0] - a[0]).slice(0, MOST);
    const behind = cover ? [[`${actions[one.covered[place]]}, ${one.share[place]} %`, one.covered[place] === best ? t("chosen with the patch: the same") : t("chosen with the patch: another")], [`${cover[2] * cover[3]} / ${rows * columns}`, t("squares covered")]] : [[t("none"), t("patch: it is 0 squares high")]];
    this.told.replaceChildren(facts([[String(one.step), t("step of the lap")], [actions[best], t("chosen at the whole picture")], ...behind]), element("div", { class: "bars3 wide" }, ...bars(likeliest.map(([share, name]) => [name, share / 100, `${share} %`]))));
  }

  camera(one, cover) {
    const { width } = this.data, grey = Math.round(one.grey.reduce((a, b) => a + b) / one.grey.length);
    const pixel = (value, at) => `<rect x="${at % width}" y="${Math.floor(at / width)}" width="1.05" height="1.05" fill="rgb(${value},${value},${value})"/>`;
    return one.grey.map(pixel).join("") + this.frame(cover, `fill="rgb(${grey},${grey},${grey})"`);
  }

  heat(one, cover) {
    const { columns, rows, width, height } = this.data, wide = width / columns, high = height / rows, most = Math.max(...one.heat);
    const square = (value, at) => { const x = at % columns * wide, y = Math.floor(at / columns) * high; return `<rect class="heat" x="${x}" y="${y}" width="${wide}" height="${high}" fill-opacity="${(0.5 * value / most).toFixed(2)}"/><text x="${x + wide / 2}" y="${y + high / 2 + 0.7}" font-size="2" text-anchor="middle">${Math.round(value)}</text>`; };
    return one.heat.map(square).join("") + this.frame(cover, 'fill="none"');
  }

  frame(cover, fill) {
    if (!cover) return "";
    const wide = this.data.width / this.data.columns, high = this.data.height / this.data.rows;
    return `<rect class="frame" x="${cover[1] * wide}" y="${cover[0] * high}" width="${cover[3] * wide}" height="${cover[2] * high}" ${fill}/>`;
  }
}

customElements.define("rc-sight", SightFigure);
