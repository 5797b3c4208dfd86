/* The form of a new model: kept one second after each change, checked while one types. */
import { t } from "racecraft.pages/texts.js";
import { look } from "racecraft.console/console.js";

const form = /** @type {HTMLFormElement} */ (document.getElementById("step"));
const kept = document.getElementById("kept");
let due = 0, sent = 0;

async function keep() {
  const number = ++sent, answer = await fetch(form.dataset.keep, { method: "POST", body: new FormData(form) });
  if (number !== sent) return;
  const told = await answer.json();
  if (!answer.ok) { kept.textContent = told.message; return; }
  form.elements.namedItem("edits").value = told.edits;
  kept.textContent = t("Draft kept.");
  for (const field of form.querySelectorAll("[name]")) {
    const wrong = told.wrong[field.name] || "";
    if (field.name === "edits" || field.type === "hidden") continue;
    field.toggleAttribute("aria-invalid", Boolean(wrong));
    const place = document.getElementById(`${field.name}-wrong`);
    if (place) place.textContent = wrong;
  }
  const remarks = document.getElementById("remarks");
  remarks?.replaceChildren(...told.remarks.map(text => Object.assign(document.createElement("p"), { textContent: text })));
  remarks?.classList.toggle("bad", told.remarks.length > 0);
  for (const place of document.querySelectorAll("[data-look]")) look(place);
}
form.addEventListener("input", () => { clearTimeout(due); kept.textContent = "…"; due = setTimeout(keep, 700); });
form.addEventListener("submit", () => clearTimeout(due));
