/* What every page of the console does: live parts, keys, files dropped on the page.

   A part with `data-live="name"` is fetched again from the page's own address when the server says that something
   changed, at most once a second; what the reader is typing or has selected stays.

   A page of a race names it in `data-race`; a row of a board names its result in `data-result`, and is marked and shown
   when the result is new.

   While a part has `data-soon`, something comes of which no event tells: the page looks every other second. With
   `data-soon="page"` it is loaded anew when that has come. */
import { t } from "racecraft.pages/texts.js";
import { showDriving } from "racecraft.console/driving.js";
import { packed } from "racecraft.console/folder_tar.js";

const parts = () => document.querySelectorAll("[data-live]");
let stream = null, hidden = null, due = null, lost = null;

/** @param {string[]} names models that changed */
function isMine(names) {
  const only = document.body.querySelector("[data-model]")?.getAttribute("data-model");
  return !only || names.includes(only);
}

const results = () => [...document.querySelectorAll("[data-result]")];

/** @param {Set<string>} before results that were shown; the page goes to those that are new and marks them for 8 s */
function showNew(before) {
  const fresh = results().filter(row => row.dataset.result && !before.has(row.dataset.result));
  for (const row of fresh) { row.classList.add("fresh"); setTimeout(() => row.classList.remove("fresh"), 8000); }
  fresh[0]?.scrollIntoView({ block: "center", behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
}

/* A model's own page answers 404 with what became of it; an answer to a form has an address that is no page. */
async function leaveIfGone() {
  const name = document.querySelector("[data-model]")?.getAttribute("data-model");
  if (!name) return;
  const own = `/models/${encodeURIComponent(name)}`;
  if ((await fetch(own, { headers: { Accept: "text/html" } })).status === 404) location.assign(own);
}

async function refresh() {
  due = null;
  const before = new Set(results().map(row => row.dataset.result));
  const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
  if (answer.status === 404) await leaveIfGone();
  if (!answer.ok) return;
  const next = new DOMParser().parseFromString(await answer.text(), "text/html");
  for (const old of parts()) {
    const name = old.getAttribute("data-live"), made = next.querySelector(`[data-live="${name}"]`);
    if (!made || made.innerHTML === old.innerHTML) continue;
    const chosen = [...old.querySelectorAll("input:checked")].map(one => one.value);
    const follows = old.scrollTop + old.clientHeight > old.scrollHeight - 24, at = old.scrollTop;
    const focus = old.contains(document.activeElement) ? document.activeElement?.getAttribute("href") : null;
    old.replaceChildren(...made.childNodes);
    for (const box of old.querySelectorAll("input[type=checkbox]")) if (chosen.includes(box.value)) box.checked = true;
    old.scrollTop = follows ? old.scrollHeight : at;
    if (focus) old.querySelector(`[href="${CSS.escape(focus)}"]`)?.focus();
  }
  showNew(before);
  refreshCharts(next);
  const stage = document.getElementById("stage");
  if (stage && stage.dataset.stage !== next.getElementById("stage")?.dataset.stage) location.reload();
  if (document.querySelector("[data-soon=page]") && !next.querySelector("[data-soon]")) location.reload();
  const title = next.querySelector("title")?.textContent;
  if (title) document.title = title;
  soon();
}

function soon() {
  if (document.querySelector("[data-soon]") && !due) due = setTimeout(refresh, 2000);
}

/** @param {Document} next the page as it is now: charts get their new data; one that is new is put behind the others. */
function refreshCharts(next) {
  for (const made of next.querySelectorAll("[data-chart]")) {
    const old = document.querySelector(`[data-chart="${CSS.escape(made.getAttribute("data-chart"))}"]`);
    const chart = old?.querySelector("rc-chart"), text = made.querySelector("script")?.textContent;
    if (!old) document.querySelector("#below")?.prepend(made);
    else if (chart?.show && text && text !== chart.shownText) { chart.shownText = text; chart.show(JSON.parse(text)); }
  }
}

/* A part with `data-look` is brought by that address; a choice made in it brings it anew with what is chosen. What
   changes while it comes is brought once it is there: a look may take seconds of the machine. */
const again = new WeakSet();
/** @param {HTMLElement} place */
export async function look(place) {
  if (place.hasAttribute("aria-busy")) { again.add(place); return; }
  const address = new URL(place.dataset.look, location.href);
  for (const one of place.querySelectorAll("select[name]")) address.searchParams.set(one.name, one.value);
  place.setAttribute("aria-busy", "true");
  const answer = await fetch(address, { headers: { Accept: "text/html" } }).catch(() => null);
  place.removeAttribute("aria-busy");
  if (again.delete(place)) return look(place);
  if (!answer) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const focus = document.activeElement?.getAttribute("name");
  const kept = place.contains(document.activeElement) && focus;
  place.replaceChildren(...(page.querySelector("main") || page.body).childNodes);
  if (kept) place.querySelector(`[name="${CSS.escape(focus)}"]`)?.focus();
  const remarks = place.querySelector("[data-remarks]");
  if (!remarks) return;
  const told = JSON.parse(remarks.dataset.remarks);
  document.querySelector("rc-editor")?.remark?.(told);
  for (const one of told) document.querySelector(`#source [data-line="${one.line}"]`)?.classList.add(one.bad ? "bad" : "warn");
}
for (const place of document.querySelectorAll("[data-look]")) {
  place.addEventListener("change", event => { if (event.target.matches("select[name]")) look(place); });
  look(place);
}

for (const log of document.querySelectorAll("pre.log")) log.scrollTop = log.scrollHeight;   // and follows from then on

function listen() {
  if (stream || !parts().length) return;
  stream = new EventSource("/events");
  stream.addEventListener("models", event => { if (isMine(JSON.parse(event.data).changed) && !due) due = setTimeout(refresh, 700); });
  stream.addEventListener("races", event => {
    const only = document.querySelector("[data-race]")?.getAttribute("data-race");
    if (only !== undefined && (!only || JSON.parse(event.data).changed.includes(only)) && !due) due = setTimeout(refresh, 300);
  });
  stream.addEventListener("drives", event => showDriving(JSON.parse(event.data)));
  stream.onopen = () => { lost = null; showLost(); if (!due) due = setTimeout(refresh, 50); };
  stream.onerror = () => { lost ||= new Date(); setTimeout(showLost, 2500); };
}

function showLost() {
  const bar = document.getElementById("lost");
  if (!bar) return;
  bar.hidden = !lost;
  if (lost) bar.querySelector("p").textContent = t("No connection to racecraft since {time}. Trainings go on; this page tries again.", { time: lost.toLocaleTimeString() });
}

document.addEventListener("visibilitychange", () => {
  clearTimeout(hidden);
  if (document.hidden) hidden = setTimeout(() => { stream?.close(); stream = null; }, 10_000);
  else listen();
});
listen();
soon();

const typing = target => target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName));
const rows = () => [...document.querySelectorAll("tr[data-row]")];
function move(by) {
  const all = rows(), at = all.findIndex(row => row.contains(document.activeElement));
  all[Math.min(Math.max(at + by, 0), all.length - 1)]?.querySelector(".name a")?.focus();
}
function chosenRow() { return rows().find(row => row.contains(document.activeElement)); }
const KEYS = {
  "/": () => document.getElementById("q")?.focus(),
  n: () => { location.href = "/drafts/new"; },
  g: () => { location.href = "/"; },
  j: () => move(1), k: () => move(-1),
  "]": () => document.querySelector("[rel=next]")?.click(), "[": () => document.querySelector("[rel=prev]")?.click(),
  x: () => { const box = chosenRow()?.querySelector("input[type=checkbox]"); if (box) box.checked = !box.checked; },
  c: () => document.querySelector("[name=act][value=compare]")?.click(),
  z: () => document.getElementById("undo")?.click(),
  "?": () => { location.href = "/settings#keys"; },
};
const useKeys = /** @type {HTMLInputElement} */ (document.getElementById("use-keys"));
if (useKeys) {
  useKeys.checked = localStorage.getItem("keys") !== "off";
  useKeys.addEventListener("change", () => localStorage.setItem("keys", useKeys.checked ? "on" : "off"));
}
document.addEventListener("keydown", event => {
  const target = /** @type {HTMLInputElement} */ (event.composedPath()[0]);   // an editor's own, inside its shadow
  if (event.ctrlKey || event.metaKey || event.altKey || (typing(target) && target.type !== "checkbox")) return;
  const act = localStorage.getItem("keys") !== "off" && KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});

addEventListener("dragover", event => { if (event.dataTransfer?.types.includes("Files")) { event.preventDefault(); document.body.classList.add("dropping"); } });
addEventListener("dragleave", event => { if (!event.relatedTarget) document.body.classList.remove("dropping"); });
addEventListener("drop", async event => {
  const dropped = event.dataTransfer?.files[0], entry = event.dataTransfer?.items[0]?.webkitGetAsEntry?.();
  if (!dropped) return;
  event.preventDefault();
  document.body.classList.remove("dropping");
  const file = entry?.isDirectory ? await packed(entry) : dropped;
  const form = new FormData();
  form.append("form_token", document.querySelector("[name=form_token]")?.value || "");
  form.append("archive", file);
  const answer = await fetch("/import", { method: "POST", body: form, headers: { Accept: "text/html" } });
  if (answer.redirected) location.href = answer.url;
  else { const page = new DOMParser().parseFromString(await answer.text(), "text/html"); document.querySelector("main")?.replaceWith(page.querySelector("main")); }
});

document.getElementById("show-names")?.addEventListener("click", () => {
  document.body.classList.toggle("with-names");
  localStorage.setItem("names", document.body.classList.contains("with-names") ? "1" : "");
});
if (localStorage.getItem("names")) document.body.classList.add("with-names");
