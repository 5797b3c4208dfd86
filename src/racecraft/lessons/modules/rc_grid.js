/* <rc-grid>: the grid world. Arrow keys or buttons drive; on a square + and − change what it pays; it learns on request.

   Settings: columns, pays ("centre" or "goal"), gamma, alpha, epsilon, drives; show, the tools that a lesson needs:
   "drive" "values" "learn" "edit" "length" "moves". */
import { t } from "racecraft.pages/texts.js";
import { chart } from "racecraft.lessons/curves.js";
import { Figure, button, element, facts, figure, slider, still, toggle } from "racecraft.lessons/parts.js";
import { Chance, MOVES, actionValues, bestDrive, drive, ends, greedyDrive, learnDrive, makeGrid, newQ, optimalValues } from "racecraft.lessons/grid.js";

const ARROWS = { left: "↖", straight: "→", right: "↘" }, FREE = { left: "↑", straight: "→", right: "↓" };
const NAMES = { left: t("left"), straight: t("straight"), right: t("right") };
const ENDS = { goal: t("at the goal"), beside: t("beside the goal"), off: t("at a stop square") };

class GridFigure extends Figure {
  begin(told) {
    this.told = { columns: 7, pays: "centre", goal: 2, moves: "ahead", alpha: 0.5, gamma: 0.9, epsilon: 0.3, drives: 300, show: "drive", ...told };
    this.has = new Set(String(this.told.show).split(" "));
    this.seed = 1;
    this.changed = new Map();
    this.at = [2, 0];
    this.lay();
    this.anew();
  }

  /* What exercises take. */
  give(name) {
    const grid = { columns: this.told.columns, pays: this.told.pays, goal: this.told.goal, moves: this.told.moves, changed: [...this.changed].map(([key, pay]) => [...key.split(",").map(Number), pay]) };
    if (name === "grid") return grid;
    return { grid, moves: this.last?.moves ?? this.moves };
  }

  anew() {
    this.grid = makeGrid(this.told);
    for (const [key, pay] of this.changed) { const [row, column] = key.split(",").map(Number); this.grid.pay[row][column] = pay; }
    this.q = newQ(this.grid);
    this.chance = new Chance(this.seed);
    this.totals = [];
    this.moves = [];
    this.last = null;
    this.layTable();
    this.draw();
    this.drawCurve();
  }

  lay() {
    this.place = element("div", { class: "wide-table" });
    this.facts = element("div");
    this.live = element("p", { class: "unseen", role: "status", "aria-live": "polite" });
    this.append(this.facts, this.place, this.live);
    if (this.has.has("drive")) {
      this.append(element("div", { class: "keys", role: "group", "aria-label": t("Drive the car") }, ...MOVES.map((name, move) => button(`${this.arrow(name)} ${NAMES[name]}`, () => this.move(move))), button(t("New drive"), () => this.newDrive(), "plain")));
    }
    const tools = element("div", { class: "tools" });
    if (this.has.has("learn")) {
      tools.append(button(t("One drive"), () => this.learn(1)), button(t("Ten drives"), () => this.learn(10)), button(t("{count} drives", { count: this.told.drives }), () => this.learn(this.told.drives)), button(t("Show what it learned"), () => this.showGreedy()), button(t("Forget"), () => { this.seed += 1; this.anew(); }, "plain"), button(t("Same chance again"), () => this.anew(), "plain"));
      tools.append(slider("α", { low: 0.05, high: 1, step: 0.05, value: this.told.alpha }, value => { this.told.alpha = value; }));
      tools.append(slider("ε", { low: 0, high: 1, step: 0.05, value: this.told.epsilon }, value => { this.told.epsilon = value; }));
    }
    if (this.has.has("values") || this.has.has("learn")) tools.append(slider("γ", { low: 0, high: 1, step: 0.01, value: this.told.gamma }, value => { this.told.gamma = value; this.draw(); }));
    if (this.has.has("values")) { tools.append(toggle(t("values of the best policy"), false, on => { this.exact = on; this.draw(); })); tools.append(button(t("Drive the best way"), () => this.follow(bestDrive(this.grid, this.told.gamma)))); }
    if (this.has.has("length")) tools.append(slider(t("columns"), { low: 7, high: 40, step: 1, value: this.told.columns, digits: 0 }, value => { this.told.columns = value; this.changed.clear(); this.anew(); }));
    if (this.has.has("pays")) tools.append(toggle(t("pays at the goal alone"), this.told.pays === "goal", on => { this.told.pays = on ? "goal" : "centre"; this.changed.clear(); this.anew(); }));
    if (this.has.has("moves")) tools.append(toggle(t("free moves"), this.told.moves === "free", on => { this.told.moves = on ? "free" : "ahead"; this.anew(); }));
    if (this.has.has("edit")) tools.append(button(t("+ 0.1 on the chosen square"), () => this.change(0.1)), button(t("− 0.1 on the chosen square"), () => this.change(-0.1)), button(t("Undo changes"), () => { this.changed.clear(); this.anew(); }, "plain"));
    if (tools.children.length) this.append(tools);
    if (this.has.has("learn")) this.append(this.curve = chart(t("Total of each drive while it learns")));
    this.append(this.policy = element("details", {}, element("summary", {}, t("Read the policy")), element("ol")));
    this.policy.ontoggle = () => this.writePolicy();
    this.addEventListener("keydown", event => this.press(event));
  }

  arrow(name) { return (this.told.moves === "free" ? FREE : ARROWS)[name]; }

  layTable() {
    const columns = this.grid.pay[0].length;
    this.place.classList.toggle("long", columns > 9);
    this.place.style.setProperty("--columns", columns);
    this.cells = [];
    const body = element("tbody");
    this.grid.pay.forEach((line, row) => {
      const tr = element("tr", { role: "row" });
      this.cells.push(line.map((_, column) => {
        const cell = element("td", { role: "gridcell", tabindex: -1, onclick: () => this.focusOn([row, column]) });
        tr.append(cell);
        return cell;
      }));
      body.append(tr);
    });
    this.table = element("table", { class: "squares", role: "grid", "aria-label": t("The road, five rows; the car drives to the right") }, body);
    this.place.replaceChildren(this.table);
    if (this.at[1] >= columns) this.at = [2, 0];
  }

  worth(square) {   // what a square shows: what was learned, or the exact values
    if (this.exact) { this.values ??= optimalValues(this.grid, this.told.gamma); return actionValues(this.grid, this.values, square, this.told.gamma); }
    return this.q[square[0]][square[1]];
  }

  draw() {
    this.values = null;
    const shown = this.last ?? drive(this.grid, this.moves), path = new Set(shown.squares.map(String)), car = String(shown.squares.at(-1));
    const knows = this.has.has("learn") || this.exact;
    this.grid.pay.forEach((line, row) => line.forEach((pay, column) => {
      const cell = this.cells[row][column], square = [row, column], end = ends(this.grid, square), key = String(square);
      const three = end || !knows ? null : this.worth(square), best = three && Math.max(...three), move = three && best !== Math.min(...three) ? MOVES[three.indexOf(best)] : "";
      cell.className = [end === "off" || end === "beside" ? "stop" : "", end === "goal" ? "goal" : "", path.has(key) ? "path" : "", key === car ? "car" : "", this.changed.has(key) ? "changed" : ""].join(" ").trim();
      cell.tabIndex = key === String(this.at) ? 0 : -1;
      const label = [t("row {row}, column {column}, pays {pay}", { row: row + 1, column: column + 1, pay: figure(pay) }), end === "off" ? t("stop square") : end ? ENDS[end] : "", three ? t("value {value}", { value: figure(best) }) : "", move ? t("best action {move}", { move: NAMES[move] }) : "", key === car ? t("the car") : ""].filter(Boolean).join(", ");
      cell.replaceChildren(element("span", { class: "unseen" }, label), element("span", { class: "pays", "aria-hidden": "true" }, end === "goal" ? `${t("goal")} ${figure(pay)}` : figure(pay)), ...(three ? [element("span", { class: "worth", "aria-hidden": "true" }, figure(best))] : []), ...(move ? [element("span", { class: "arrow", "aria-hidden": "true" }, this.arrow(move))] : []));
    }));
    const list = [];
    if (this.has.has("drive") || this.last) list.push([figure(shown.total), shown.ended ? t("total; ended {where}", { where: ENDS[shown.ended] }) : t("total so far")]);
    if (this.has.has("learn")) list.push([String(this.totals.length), t("drives learned from")]);
    if (this.totals.length) { const late = this.totals.slice(-50); list.push([figure(late.reduce((sum, one) => sum + one, 0) / late.length), t("mean total of the last {count}", { count: late.length })]); }
    this.facts.replaceChildren(facts(list));
    this.writePolicy();
  }

  move(move) {
    const before = drive(this.grid, this.moves);
    if (before.ended || this.last) this.newDrive();
    this.moves = [...this.moves, move];
    const now = drive(this.grid, this.moves);
    this.draw();
    if (now.ended) this.say(t("The drive ended {where} with a total of {total}.", { where: ENDS[now.ended], total: figure(now.total) }));
    this.dispatchEvent(new CustomEvent("rc-moved", { bubbles: true }));
  }

  newDrive() { this.moves = []; this.last = null; this.draw(); }

  learn(count) {
    for (let k = 0; k < count; k++) { this.last = learnDrive(this.grid, this.q, this.told.alpha, this.told.gamma, this.told.epsilon, this.chance); this.totals.push(this.last.total); }
    this.draw();
    this.drawCurve();
    this.say(t("After {count} drives the last total is {total}.", { count: this.totals.length, total: figure(this.last.total) }));
  }

  showGreedy() { this.follow(greedyDrive(this.grid, this.q, this.chance)); }

  async follow(whole) {
    this.moves = [];
    for (let k = still ? whole.moves.length : 1; k <= whole.moves.length; k++) {
      this.last = drive(this.grid, whole.moves.slice(0, k));
      this.draw();
      if (k < whole.moves.length) await new Promise(done => setTimeout(done, 140));
    }
    this.say(t("The drive ended {where} with a total of {total}.", { where: ENDS[whole.ended] ?? "", total: figure(whole.total) }));
  }

  drawCurve() {
    if (!this.curve) return;
    const x = this.totals.map((_, k) => k + 1);
    this.curve.lines(t("drive"), t("total"), [[t("total"), x, this.totals, "dots", 5], [t("mean of 20"), x, this.totals.map((_, k) => { const part = this.totals.slice(Math.max(0, k - 19), k + 1); return part.reduce((sum, one) => sum + one, 0) / part.length; }), "line", 2]], { low: 0 });
  }

  change(by) {
    const key = String(this.at), [row, column] = this.at, pay = Math.round(10 * (this.grid.pay[row][column] + by)) / 10;
    if (pay < -4 || pay > 4 || ends(this.grid, this.at) === "off") { this.say(t("This square cannot pay that.")); return; }
    const usual = makeGrid(this.told).pay[row][column];
    if (Math.abs(pay - usual) < 1e-9) this.changed.delete(key); else this.changed.set(key, pay);
    this.grid.pay[row][column] = pay;
    this.draw();
    this.say(t("It pays {pay}.", { pay: figure(pay) }));
  }

  focusOn(square) {
    this.at = square;
    for (const line of this.cells) for (const cell of line) cell.tabIndex = -1;
    const cell = this.cells[square[0]][square[1]];
    cell.tabIndex = 0;
    cell.focus();
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !event.target.closest("table.squares")) return;
    const [row, column] = this.at, step = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[event.key];
    const acts = { l: () => this.move(0), s: () => this.move(1), r: () => this.move(2), "+": () => this.change(0.1), "=": () => this.change(0.1), "-": () => this.change(-0.1), Enter: () => this.has.has("drive") && this.move(1) };
    if (step) {
      event.preventDefault();
      this.focusOn([Math.max(0, Math.min(this.cells.length - 1, row + step[0])), Math.max(0, Math.min(this.cells[0].length - 1, column + step[1]))]);
    } else if (acts[event.key] && (this.has.has("edit") || !"+=-".includes(event.key)) && (this.has.has("drive") || !"lsr".includes(event.key))) { event.preventDefault(); acts[event.key](); }
  }

  writePolicy() {
    if (!this.policy.open) return;
    const lines = [];
    this.cells.forEach((line, row) => line.forEach((cell, column) => { if (!ends(this.grid, [row, column])) lines.push(element("li", {}, cell.firstChild.textContent)); }));
    this.policy.lastChild.replaceChildren(...lines);
  }

  say(text) { this.live.textContent = text; }
}

customElements.define("rc-grid", GridFigure);
