/* The page of `racecraft watch`: where a run stands, its figures and its curves, as they come. */
import { ask, words } from "racecraft.pages/ask.js";
import "racecraft.pages/chart.js";
import { t } from "racecraft.pages/texts.js";
import { feedOf } from "racecraft.pages/run_feed.js";

const $ = id => document.getElementById(id);
const feed = feedOf($("watch").dataset.from);
const beside = new Map();   // the figures of other runs that lie over this one's, by name
const SHOWN = new Set(["iteration", "training_score", "evaluation_score", "mean_reward"]);

function tellState() {
  const { run } = feed, pill = $("state");
  pill.className = `pill ${feed.lost ? "warn" : run?.training ? "on" : ""}`;
  pill.textContent = feed.lost ? t("the server of this page is gone; it is tried again") : run.training ? t("training") : t("ended");
}

function tellRun() {
  const { run, rows } = feed, row = rows.at(-1) || {}, stops = run.stops.join(t(" or "));
  $("about").textContent = [run.title, run.algorithm, run.seed == null ? "" : t("seed {seed}", run), run.stops.length ? t("stops at {stops}", { stops }) : ""].filter(Boolean).join(" · ");
  const evaluated = rows.findLast(one => one.evaluation_score != null) || {};
  const laps = rows.map(one => one.best_lap_seconds).filter(one => one != null);
  const time = row.seconds == null ? "–" : row.seconds < 600 ? `${words(row.seconds)} s` : t("{minutes} min", { minutes: words(row.seconds / 60, 1) });
  const unit = run.score_name.endsWith(" %") && evaluated.evaluation_score != null ? " %" : "";
  const stats = [[words(row.iteration), t("iterations")], [words(row.steps), t("steps")], [words(row.steps_per_second), t("steps a second")], [time, t("of training")],
    [words(evaluated.evaluation_score, 1) + unit, t("{score}, evaluated", { score: run.score_name.replace(" %", "") })]];
  if (laps.length) stats.push([`${words(Math.min(...laps), 2)} s`, t("best lap, evaluated")]);
  if (run.best != null) stats.push([words(run.best), t("best checkpoint")]);
  const strip = $("stats");
  while (strip.children.length < stats.length) strip.append(stat());
  stats.forEach(([value, name], k) => { say(strip.children[k].children[0], value); say(strip.children[k].children[1], name); });
}

function stat() {
  const card = document.createElement("div");
  card.className = "card stat";
  card.append(document.createElement("b"), document.createElement("span"));
  return card;
}

function drawCurves() {
  const { run, rows } = feed;
  draw("scores", run.score_name, [["training_score", t("training"), "line", 2], ["evaluation_score", t("evaluation, greedy"), "both", 1]]);
  draw("rewards", t("mean reward of an episode"), [["mean_reward", t("training"), "line", 1]]);
  const names = [...new Set(rows.flatMap(row => Object.keys(row)))].filter(name => !SHOWN.has(name));
  const select = $("figure"), chosen = select.value || (names.includes("entropy") ? "entropy" : names[0]);
  if (select.options.length !== names.length) select.replaceChildren(...names.map(name => new Option(name.replaceAll("_", " "), name, false, name === chosen)));
  if (chosen) draw("others", chosen.replaceAll("_", " "), [[chosen, chosen.replaceAll("_", " "), "line", 1]]);
}

function draw(id, label, lines) {
  const series = lines.map(([key, name, look, colour]) => line(feed.rows, key, name, look, colour));
  [...beside].forEach(([run, rows], k) => {   // in one colour, what is drawn first of several stands back
    for (const [at, [key, name, look]] of lines.entries())
      series.push({ ...line(rows, key, lines.length > 1 ? `${run}: ${name}` : run, look, 3 + k), faint: at < lines.length - 1 });
  });
  $(id).show({ x: t("iteration"), y: label, right: "", low: null, high: null, log: false, logX: false, names: [], smooth: true, digits: 2, series, bands: [], marks: [], levels: [] });
  $(id).writeTable();
}

function line(rows, key, name, look, colour) {
  const told = rows.filter(row => row[key] != null);
  return { name, look, colour, right: false, faint: false, x: told.map(row => row.iteration), y: told.map(row => row[key]) };
}

/* Other runs of the folder, as they are when they are chosen; the address keeps which. */
async function layBeside() {
  const chosen = () => [...document.querySelectorAll("#beside input:checked")].map(box => box.value);
  history.replaceState(null, "", `?${new URLSearchParams(chosen().map(name => ["with", name]))}${location.hash}`);
  let wrong = "";
  try {
    for (const name of chosen()) if (!beside.has(name)) beside.set(name, (await ask(`${feed.from}api/curves?run=${encodeURIComponent(name)}`)).rows);
  } catch (error) { wrong = error.message; }
  say($("beside-wrong"), wrong);
  $("beside-wrong").hidden = !wrong;
  for (const name of beside.keys()) if (!chosen().includes(name)) beside.delete(name);
  if (feed.run) drawCurves();
}

const say = (part, text) => { if (part.textContent !== text) part.textContent = text; };
feed.addEventListener("run", () => { tellState(); tellRun(); });
feed.addEventListener("rows", () => { tellRun(); drawCurves(); });
feed.addEventListener("lost", tellState);
feed.addEventListener("found", () => feed.run && tellState());
$("figure").onchange = drawCurves;
$("beside")?.addEventListener("change", layBeside);
if ($("beside")?.open) layBeside();
