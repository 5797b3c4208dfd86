/* Cards found by words and choices: a filter's `data-by` names the card's `data-…` in which its value is one of the
   words. What is chosen stands in the address. */
import { t } from "racecraft.pages/texts.js";

const cards = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[data-words]")]);
const filters = /** @type {(HTMLInputElement | HTMLSelectElement)[]} */ ([...document.querySelectorAll("[data-by]")]);
const left = document.getElementById("cards-left");

function show() {
  const wanted = filters.flatMap(one => one.value.toLowerCase().split(/\s+/).filter(Boolean).map(word => [one.dataset.by, word]));
  for (const card of cards) {
    card.hidden = !wanted.every(([by, word]) => by === "words" ? card.dataset.words.includes(word) : card.dataset[by].split(" ").includes(word));
  }
  const count = cards.filter(card => !card.hidden).length;
  left.textContent = count === 1 ? t("1 circuit") : t("{count} circuits", { count });
}
function keep() {
  const chosen = new URLSearchParams(filters.filter(one => one.value).map(one => [one.dataset.by, one.value]));
  history.replaceState(null, "", chosen.size ? `?${chosen}` : location.pathname);
}
const given = new URLSearchParams(location.search);
for (const one of filters) {
  if (given.has(one.dataset.by)) one.value = given.get(one.dataset.by);
  one.addEventListener("input", event => { event.stopPropagation(); show(); keep(); });   // the draft has nothing of it
}
show();
