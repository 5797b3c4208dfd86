/* <rc-params>: one recorded drive; at each moment what a reward function is told, and what three samples pay. */
import { t } from "racecraft.pages/texts.js";
import { Figure, boxAround, element, facts, figure, line, picture, slider } from "racecraft.lessons/parts.js";
import { samples } from "racecraft.worlds.deepracer.lessons/samples.js";

class ParamsFigure extends Figure {
  begin({ data }) {
    this.data = data;
    const { x, y, centre } = data, xs = centre.map(one => one[0]), ys = centre.map(one => one[1]), road = line(xs, ys);
    this.box = boxAround(xs, ys, 0.6);
    this.road = `<polygon class="road" stroke-width="${data.width}" points="${road}"/><polygon class="centre" stroke-width="0.02" points="${road}"/><polyline class="line1" stroke-width="0.03" points="${line(x, y)}"/>`;
    this.map = element("div");
    this.told = element("div");
    this.append(this.map, element("div", { class: "tools" }, slider(t("step"), { low: 1, high: x.length, step: 1, value: 1, digits: 0 }, at => this.show(at - 1))), this.told);
    this.show(0);
  }

  show(at) {
    const d = this.data, turn = Math.PI * d.heading[at] / 180, wheel = turn + Math.PI * d.steering[at] / 180, x = d.x[at], y = -d.y[at];
    const ray = (angle, length, kind) => `<line class="${kind}" stroke-width="0.05" x1="${x}" y1="${y}" x2="${x + length * Math.cos(angle)}" y2="${y - length * Math.sin(angle)}"/>`;
    this.map.replaceChildren(picture(this.box, `${this.road}${ray(turn, 0.5, "line2")}${ray(wheel, 0.35, "line3")}<circle class="dot2" r="0.09" cx="${x}" cy="${y}"/>`, t("The drive, the car's heading and its steering at step {step}", { step: at + 1 })));
    const pays = samples({ distance: d.distance[at], width: d.width, onTrack: d.on_track[at] });
    const told = [[`${figure(d.commanded[at])} m/s`, t("speed: commanded")], [`${figure(d.driven[at])} m/s`, t("driven; no parameter")], [`${figure(d.steering[at])}°`, t("steering_angle: commanded, left positive")], [`${figure(d.heading[at])}°`, "heading"], [`${d.distance[at].toFixed(3)} m`, "distance_from_center"], [`${figure(d.progress[at])} %`, "progress"], [`${figure(d.x[at])}, ${figure(d.y[at])} m`, "x, y"], [d.on_track[at] ? "True" : "False", "all_wheels_on_track"], [String(d.waypoint[at]), t("closest waypoint")]];
    const names = [t("sample 1 pays: inside the borders"), t("sample 2 pays: near the centre line"), t("sample 3 pays: always")];
    this.told.replaceChildren(facts(told), facts(pays.map((pay, k) => [String(pay), names[k]])));
  }
}

customElements.define("rc-params", ParamsFigure);
