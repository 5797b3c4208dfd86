/* News of a run, pushed: `feedOf("/")` is one stream for all that show this run on a page.

   feed.run    what is trained, and whether it still is      feed.rows   the figures of each iteration so far
   events      "run", "rows"; "lost" within five seconds of a lost connection, "found" when it is back

   A page that is hidden for ten seconds lets go of its stream; shown again, it asks anew. */
import { ask } from "racecraft.pages/ask.js";

const HIDDEN_MS = 10_000, LOST_MS = 3_000;
const feeds = new Map();

export function feedOf(from) {
  if (!feeds.has(from)) feeds.set(from, new RunFeed(from));
  return feeds.get(from);
}

export class RunFeed extends EventTarget {
  constructor(from) {
    super();
    this.from = from; this.run = null; this.rows = []; this.lost = false;
    this.open();
    document.addEventListener("visibilitychange", () => {
      clearTimeout(this.leaving);
      if (document.hidden) this.leaving = setTimeout(() => this.close(), HIDDEN_MS);
      else if (!this.stream) this.open();
    });
  }

  open() {
    this.stream = new EventSource(`${this.from}api/events`);
    this.stream.addEventListener("run", event => this.take(JSON.parse(event.data)));
    this.stream.onopen = () => { clearTimeout(this.losing); this.losing = null; if (this.lost) { this.lost = false; this.tell("found"); } };
    this.stream.onerror = () => {
      this.losing ??= setTimeout(() => { this.lost = true; this.tell("lost"); }, LOST_MS);
      if (this.stream.readyState === EventSource.CLOSED) setTimeout(() => { if (this.stream) { this.stream.close(); this.open(); } }, LOST_MS);
    };
  }

  close() { this.stream?.close(); this.stream = null; }

  async take(run) {
    this.run = run;
    this.tell("run");
    if (this.asking || run.last <= (this.rows.at(-1)?.iteration ?? 0)) return;
    this.asking = true;
    try { this.rows.push(...(await ask(`${this.from}api/curves?after=${this.rows.at(-1)?.iteration ?? 0}`)).rows); }
    finally { this.asking = false; }
    this.tell("rows");
  }

  tell(what) { this.dispatchEvent(new Event(what)); }
}
