/* <rc-learning>: a car's recorded drives while it learned, one an iteration; a slider chooses, a button plays. */
import { t } from "racecraft.pages/texts.js";
import { button, element, facts, slider, still } from "racecraft.lessons/parts.js";

const ENDS = { off_track: t("left the road"), in_progress: t("still driving"), lap_complete: t("lap complete") };

class LearningFigure extends HTMLElement {
  connectedCallback() {
    if (this.told) return;
    const { data } = JSON.parse(this.querySelector("script").textContent);
    this.drives = data.drives;
    this.seconds = data.tick_seconds;
    const xs = this.drives.flatMap(one => one.x), ys = this.drives.flatMap(one => one.y), pad = 60;
    this.box = [Math.min(...xs) - pad, -Math.max(...ys) - pad, Math.max(...xs) - Math.min(...xs) + 2 * pad, Math.max(...ys) - Math.min(...ys) + 2 * pad];
    this.told = element("div", { "aria-live": "polite" });
    this.map = element("div");
    this.at = this.drives.length - 1;
    this.slider = slider(t("iteration"), { low: 1, high: this.drives.length, step: 1, value: 1, digits: 0 }, value => this.show(value - 1));
    this.append(this.told, this.map, element("div", { class: "tools" }, this.slider, button(t("Play all"), () => this.play()), button(t("Stop"), () => { this.playing = 0; }, "plain")));
    this.show(0);
  }

  show(at) {
    const lap = this.drives.at(-1), one = this.drives[at], line = drive => drive.x.map((x, k) => `${x},${-drive.y[k]}`).join(" ");
    this.map.innerHTML = `<svg class="picture-svg" role="img" viewBox="${this.box.join(" ")}"><polyline class="road" stroke-width="76" points="${line(lap)}"/><polyline class="line1" stroke-width="9" points="${line(one)}"/><circle class="dot2" r="16" cx="${one.x.at(-1)}" cy="${-one.y.at(-1)}"/></svg>`;
    this.map.firstChild.setAttribute("aria-label", t("The path of the drive of iteration {number}: {progress} % of a lap", { number: one.iteration, progress: one.progress }));
    this.told.replaceChildren(facts([[String(one.iteration), t("iteration")], [`${one.progress} %`, t("of a lap")], [String(one.reward), t("reward of the drive")], [`${(one.x.length * this.seconds).toFixed(0)} s`, t("driven")], [ENDS[one.status] ?? one.status, t("at its end")]]));
    this.slider.set(at + 1);
    this.at = at;
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
