/* <rc-laps>: the whole laps of a recorded training, driven at the same time; each joins the board as it finishes. */
import { t } from "racecraft.pages/texts.js";
import { Figure, boxAround, button, element, line, picture, still, table } from "racecraft.lessons/parts.js";

class LapsFigure extends Figure {
  begin({ data }) {
    this.laps = data.drives.filter(one => one.progress >= 100);
    this.second = 1 / data.tick_seconds;
    const box = boxAround(this.laps.flatMap(one => one.x), this.laps.flatMap(one => one.y), 60), [{ x, y }] = this.laps;
    this.map = picture(box, `<polyline class="road" stroke-width="76" points="${line(x, y)}"/>${this.laps.map((_, k) => `<circle class="dot${k % 3 + 1}" r="18"/>`).join("")}`, t("{count} cars on their lap", { count: this.laps.length }));
    this.board = element("div", { "aria-live": "polite" });
    this.append(this.map, element("div", { class: "tools" }, button(t("Race"), () => this.race(), "first"), button(t("To the end"), () => this.show(Infinity), "plain")), this.board);
    this.show(0);
  }

  show(tick) {
    this.playing = tick === Infinity ? 0 : this.playing;
    this.map.querySelectorAll("circle").forEach((dot, k) => { const one = this.laps[k], at = Math.min(tick, one.x.length - 1); dot.setAttribute("cx", one.x[at]); dot.setAttribute("cy", -one.y[at]); });
    const home = this.laps.filter(one => one.x.length - 1 <= tick).sort((a, b) => a.x.length - b.x.length);
    if (this.home === home.length) return;
    this.home = home.length;
    const rows = home.map(one => [home.findIndex(other => other.x.length === one.x.length) + 1, one.iteration, `${(one.x.length / this.second).toFixed(2)} s`]);
    this.board.replaceChildren(table(t("Cars that have finished"), [t("place"), t("car of iteration"), t("lap")], rows));
  }

  async race() {
    const mine = this.playing = Date.now(), last = Math.max(...this.laps.map(one => one.x.length));
    for (let tick = still ? last : 0; tick <= last && this.playing === mine; tick++) {
      this.show(tick);
      if (!still) await new Promise(done => setTimeout(done, 1000 / this.second / 3));
    }
  }
}

customElements.define("rc-laps", LapsFigure);
