/* <rc-gradient>: four drives, the table of their gradient, a step, and the policy that comes of it. */
import { t } from "racecraft.pages/texts.js";
import { Figure, bars, button, element, facts, slider, table, toggle } from "racecraft.lessons/parts.js";
import { Chance, drive, driveBy, makeGrid } from "racecraft.lessons/grid.js";
import { climbed, drawn, driveRow, entropy, gradient, probabilities, weights } from "racecraft.lessons/gradient.js";

const SIDES = [t("left"), t("straight"), t("right")], LETTERS = "lsr";
const FIRST = [[1, 0, 1, 0], [0, 0], [2, 2], [1, 1, 0, 0]];
const written = value => value.toFixed(4).replace("-", "−");

class GradientFigure extends Figure {
  begin() {
    this.road = makeGrid(); this.chance = new Chance(5);
    this.batch = FIRST; this.theta = [0, 0, 0]; this.baseline = false; this.step = 0.5; this.steps = 0;
    this.bars = element("div", { class: "bars3", role: "group", "aria-label": t("Policy at the start square") });
    this.table = element("div");
    this.told = element("div", { "aria-live": "polite" });
    this.append(this.bars, this.told, this.table, element("div", { class: "tools" },
      button(t("Step uphill"), () => this.climb(), "first"), button(t("Four new drives"), () => this.collect()), button(t("The lesson's four drives"), () => { this.batch = FIRST; this.draw(); }), button(t("Back to 1/3 each"), () => { this.theta = [0, 0, 0]; this.steps = 0; this.draw(); }, "plain"),
      toggle(t("baseline"), false, on => { this.baseline = on; this.draw(); }), slider(t("step size"), { low: 0.1, high: 5, step: 0.1, value: 0.5, digits: 1 }, value => { this.step = value; this.draw(); })));
    this.draw();
  }

  give() { return this.batch; }

  get drives() { return this.batch.map(moves => drive(this.road, moves)); }

  climb() {
    const slope = gradient(this.theta, this.drives.map(one => [one.moves[0], one.total]), this.baseline);
    this.theta = climbed(this.theta, slope, this.step);
    this.steps += 1;
    this.draw();
  }

  collect() {   // the first move by the policy, the others at random, as the lesson has it
    const pi = probabilities(this.theta);
    this.batch = Array.from({ length: 4 }, () => driveBy(this.road, square => square === this.road.start ? drawn(pi, this.chance) : this.chance.below(3)).moves);
    this.draw();
  }

  draw() {
    const pi = probabilities(this.theta), drives = this.drives, totals = drives.map(one => one.total), counted = weights(totals, this.baseline);
    this.bars.replaceChildren(...bars(SIDES.map((name, k) => [name, pi[k], pi[k].toFixed(4)])));
    this.told.replaceChildren(facts([[String(this.steps), t("steps climbed")], [entropy(pi).toFixed(3), t("entropy")], [(totals.reduce((a, b) => a + b, 0) / 4).toFixed(3), t("mean total")]]));
    const rows = drives.map((one, k) => [this.input(one, k), ...[one.total, counted[k], ...driveRow(this.theta, one.moves[0], counted[k])].map(written)]);
    const slope = gradient(this.theta, drives.map(one => [one.moves[0], one.total]), this.baseline), after = climbed(this.theta, slope, this.step);
    for (const [name, values] of [[t("mean"), slope], [t("θ after a step"), after], [t("π after a step"), probabilities(after)]]) rows.push([name, "", "", ...values.map(value => element("b", {}, written(value)))]);
    this.table.replaceChildren(table(t("The gradient, drive by drive"), [t("moves (l, s, r)"), t("total"), t("weight"), ...SIDES], rows, true));
  }

  input({ moves }, number) {
    const made = element("input", { type: "text", size: 8, "aria-label": t("moves of drive {number}", { number: number + 1 }), value: moves.map(move => LETTERS[move]).join("") });
    made.onchange = () => {
      const given = drive(this.road, [...made.value.toLowerCase()].map(letter => LETTERS.indexOf(letter)).filter(move => move >= 0));
      if (given.ended) this.batch = this.batch.map((old, at) => at === number ? given.moves : old);
      this.draw();
    };
    return made;
  }
}

customElements.define("rc-gradient", GradientFigure);
