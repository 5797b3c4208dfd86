/* The page of a lesson: exercises are sent, and what the check says is shown. Figures are elements of their own; one that
   gives something to exercises has `give(name)`. */
import { t } from "racecraft.pages/texts.js";
import { element, table } from "racecraft.lessons/parts.js";

const page = document.querySelector("[data-lesson]"), id = page.dataset.lesson;
const LABELS = { passed: t("done"), seen: t("seen"), run: t("run seen"), tried: t("tried"), unusable: t("open") };

/* What the fields hold; a figure's value is taken at this moment. */
export function answerOf(part) {
  const answer = {};
  for (const field of part.querySelectorAll(".field")) {
    const { name, kind, figure } = field.dataset;
    if (kind === "take") answer[name] = document.querySelector(`[data-figure="${figure}"]:not(.field)`)?.give?.(name) ?? null;
    else if (kind === "choice") answer[name] = field.querySelector("input:checked")?.value ?? null;
    else answer[name] = field.querySelector("input, textarea, select").value;
  }
  return answer;
}

async function check(part, form) {
  const button = form.querySelector("[type=submit]"), said = part.querySelector(".said");
  button.disabled = true;
  part.setAttribute("aria-busy", "true");
  try {
    const answer = await fetch(`/lessons/${id}/${part.dataset.exercise}`, { method: "POST", body: JSON.stringify(answerOf(part)), headers: { "Content-Type": "application/json" } });
    const told = await answer.json();
    if (!answer.ok) throw new Error(told.message);
    show(part, said, told);
  } catch (error) {
    show(part, said, { state: "unusable", text: String(error.message || error) });
  } finally {
    button.disabled = false;
    part.removeAttribute("aria-busy");
  }
}

function show(part, said, told) {
  const good = told.state === "passed" || told.state === "seen";
  const notice = element("div", { class: `notice ${good ? "good" : told.state === "unusable" ? "warn" : ""}` });
  const head = { passed: t("Done."), seen: t("Seen."), run: t("The run:"), tried: t("Not yet."), unusable: "" }[told.state];
  if (head) notice.append(element("b", {}, head), " ");
  notice.append(...paragraphs(told.text));
  said.replaceChildren(notice);
  if (told.table) said.append(tableOf(told.table));
  if (told.worked) said.append(element("p", { class: "worked" }, `${t("Worked out:")} ${told.worked}`));
  for (const later of part.querySelectorAll("[data-later]")) later.hidden = !(told.state === "run" || told.state === "seen");
  if (told.state === "unusable") return;
  for (const input of part.querySelectorAll("[data-kind] input, [data-kind] select")) if (part.dataset.kind === "prediction" && !input.closest("[data-later]")) input.disabled = true;
  const pill = part.querySelector("[data-state]");
  if (good || !pill.classList.contains("good")) { pill.textContent = LABELS[told.state]; pill.classList.toggle("good", good); }
  if (part.dataset.kind === "prediction" && told.state === "run") part.querySelector("[type=submit]").textContent = t("Check the reason");
}

function tableOf([heads, rows]) {
  return table(heads.join(", "), heads, rows.map(row => row.map(value => typeof value === "number" ? +value.toFixed(3) : value)));
}

const paragraphs = text => text.split("\n").map((line, k) => k ? element("p", {}, line) : document.createTextNode(line));

for (const part of document.querySelectorAll(".exercise")) {
  const form = part.querySelector("form");
  form.addEventListener("submit", event => { event.preventDefault(); check(part, form); });
  const hint = form.querySelector("[data-hint]");
  if (hint) hint.onclick = () => {
    const text = form.querySelector(".hint");
    text.hidden = !text.hidden;
    hint.setAttribute("aria-expanded", String(!text.hidden));
  };
  for (const area of form.querySelectorAll("textarea.code")) area.addEventListener("keydown", event => {
    if (event.key !== "Enter" || event.shiftKey) return;   // a new line begins as far right as the one before
    const start = area.value.lastIndexOf("\n", area.selectionStart - 1) + 1, line = area.value.slice(start, area.selectionStart);
    const more = line.match(/^\s*/)[0] + (line.trimEnd().endsWith(":") ? "    " : "");
    event.preventDefault();
    area.setRangeText(`\n${more}`, area.selectionStart, area.selectionEnd, "end");
  });
}
const anew = document.getElementById("anew");
if (anew) anew.onclick = async () => { await fetch(`/lessons/${id}`, { method: "DELETE" }); location.reload(); };
