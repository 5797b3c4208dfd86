/* <rc-learning>: a car's recorded drives while it learned, one an iteration; a slider chooses, a button plays. */
import { t } from "racecraft.pages/texts.js";
import { Figure, boxAround, button, element, facts, line, picture, slider, still } from "racecraft.lessons/parts.js";

const ENDS = { off_track: t("left the road"), in_progress: t("still driving"), lap_complete: t("lap complete") };

class LearningFigure extends Figure {
  begin({ data }) {
    this.drives = data.drives;
    this.seconds = data.tick_seconds;
    this.box = boxAround(this.drives.flatMap(one => one.x), this.drives.flatMap(one => one.y), 60);
    this.live = element("div", { "aria-live": "polite" });
    this.map = element("div");
    this.slider = slider(t("iteration"), { low: 1, high: this.drives.length, step: 1, value: 1, digits: 0 }, value => this.show(value - 1));
    this.append(this.live, this.map, element("div", { class: "tools" }, this.slider, button(t("Play all"), () => this.play()), button(t("Stop"), () => { this.playing = 0; }, "plain")));
    this.show(0);
  }

  show(at) {
    const lap = this.drives.at(-1), one = this.drives[at];
    this.map.replaceChildren(picture(this.box, `<polyline class="road" stroke-width="76" points="${line(lap.x, lap.y)}"/><polyline class="line1" stroke-width="9" points="${line(one.x, one.y)}"/><circle class="dot2" r="16" cx="${one.x.at(-1)}" cy="${-one.y.at(-1)}"/>`, t("The path of the drive of iteration {number}: {progress} % of a lap", { number: one.iteration, progress: one.progress })));
    this.live.replaceChildren(facts([[String(one.iteration), t("iteration")], [`${one.progress} %`, t("of a lap")], [String(one.reward), t("reward of the drive")], [`${(one.x.length * this.seconds).toFixed(0)} s`, t("driven")], [ENDS[one.status] ?? one.status, t("at its end")]]));
    this.slider.set(at + 1);
  }

  async play() {
    const mine = this.playing = Date.now();
    for (let at = 0; at < this.drives.length && this.playing === mine; at++) {
      this.show(at);
      if (!still) await new Promise(done => setTimeout(done, 650));
    }
  }
}

customElements.define("rc-learning", LearningFigure);
