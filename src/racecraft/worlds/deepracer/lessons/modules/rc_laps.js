/* <rc-laps>: the whole laps of a recorded training, driven at the same time; each joins the board as it finishes. */
import { t } from "racecraft.pages/texts.js";
import { button, element, still } from "racecraft.lessons/parts.js";

class LapsFigure extends HTMLElement {
  connectedCallback() {
    if (this.table) return;
    const { data } = JSON.parse(this.querySelector("script").textContent);
    this.laps = data.drives.filter(one => one.progress >= 100);
    this.second = 1 / data.tick_seconds;
    const xs = this.laps.flatMap(one => one.x), ys = this.laps.flatMap(one => one.y), pad = 60, low = Math.min(...xs) - pad, top = -Math.max(...ys) - pad;
    const road = this.laps[0].x.map((x, k) => `${x},${-this.laps[0].y[k]}`).join(" ");
    this.map = element("div");
    this.map.innerHTML = `<svg class="picture-svg" role="img" viewBox="${low} ${top} ${Math.max(...xs) + pad - low} ${-Math.min(...ys) + pad - top}"><polyline class="road" stroke-width="76" points="${road}"/>${this.laps.map((_, k) => `<circle class="dot${k % 3 + 1}" r="18"/>`).join("")}</svg>`;
    this.map.firstChild.setAttribute("aria-label", t("{count} cars on their lap", { count: this.laps.length }));
    this.table = element("table");
    this.append(this.map, element("div", { class: "tools" }, button(t("Race"), () => this.race(), "first"), button(t("To the end"), () => this.show(Infinity), "plain")), element("div", { "aria-live": "polite" }, this.table));
    this.show(0);
  }

  show(tick) {
    this.playing = tick === Infinity ? 0 : this.playing;
    this.map.querySelectorAll("circle").forEach((dot, k) => { const one = this.laps[k], at = Math.min(tick, one.x.length - 1); dot.setAttribute("cx", one.x[at]); dot.setAttribute("cy", -one.y[at]); });
    const home = this.laps.filter(one => one.x.length - 1 <= tick).sort((a, b) => a.x.length - b.x.length);
    if (this.table.rows.length === home.length + 1) return;
    this.table.replaceChildren();
    const head = this.table.createTHead().insertRow(), body = this.table.createTBody();
    for (const name of [t("place"), t("car of iteration"), t("lap")]) head.append(element("th", { scope: "col" }, name));
    home.forEach((one, k) => { const row = body.insertRow(); for (const text of [home.findIndex(other => other.x.length === one.x.length) + 1, one.iteration, `${(one.x.length / this.second).toFixed(2)} s`]) row.insertCell().textContent = text; });
  }

  async race() {
    const mine = this.playing = Date.now(), last = Math.max(...this.laps.map(one => one.x.length));
    if (still) { this.show(last); return; }
    for (let tick = 0; tick <= last && this.playing === mine; tick++) {
      this.show(tick);
      await new Promise(done => setTimeout(done, 1000 / this.second / 3));
    }
  }
}

customElements.define("rc-laps", LapsFigure);
