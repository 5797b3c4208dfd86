/* Asking our server for JSON, and numbers as a page writes them. */

/* The value at an address; an Error with the server's sentence where there is none. */
export async function ask(way) {
  const answer = await fetch(way, { cache: "no-store" }), told = await answer.json();
  if (!answer.ok) throw new Error(told.message);
  return told;
}

const formats = /** @type {Intl.NumberFormat[]} */ ([]);   // by decimals: making one takes longer than a hundred numbers

/* A number with its decimals; "–" for what is not known. */
export const words = (value, digits = 0) => value == null ? "–"
  : (formats[digits] ??= new Intl.NumberFormat("en", { maximumFractionDigits: digits, minimumFractionDigits: digits })).format(value);
