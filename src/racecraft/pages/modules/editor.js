/* <rc-editor>: a text area of Python as an editor, drawn by CodeMirror; nothing else calls CodeMirror.

   Inside it stands the labelled text area, which needs no script and stays the value of the form; every change of it
   sends `input` as typing would. `element.remark([{ line, bad, text }])` marks lines, counted from 1.
   Keys: Tab indents, Esc then Tab leaves, F8 goes to the next remark. */
import {
  bracketMatching, defaultKeymap, drawSelection, EditorState, EditorView, highlightActiveLine,
  highlightActiveLineGutter, HighlightStyle, highlightSelectionMatches, history, historyKeymap, indentOnInput,
  indentUnit, indentWithTab, keymap, lineNumbers, lintGutter, lintKeymap, python, search, searchKeymap,
  setDiagnostics, syntaxHighlighting, tags, toggleTabFocusMode,
} from "racecraft.pages/codemirror.js";
import { t } from "racecraft.pages/texts.js";

const LOOK = EditorView.theme({
  "&": { color: "var(--ink)", backgroundColor: "var(--card)", fontSize: "var(--small)", height: "100%" },
  "&.cm-focused": { outline: "3px solid var(--blue)", outlineOffset: "1px" },
  ".cm-scroller": { fontFamily: "var(--code)", lineHeight: "1.5", overflow: "auto" },
  ".cm-gutters": { color: "var(--quiet)", backgroundColor: "var(--ground)", border: "0" },
  ".cm-activeLine": { backgroundColor: "transparent" },
  "&.cm-focused .cm-activeLine, .cm-activeLineGutter": { backgroundColor: "var(--blue-soft)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { background: "var(--slot)" },
  ".cm-tooltip, .cm-panels": { color: "var(--ink)", backgroundColor: "var(--card)", border: "1px solid var(--line)" },
  ".cm-diagnostic": { whiteSpace: "pre-wrap", maxWidth: "60ch" },
  ".cm-line.bad": { backgroundColor: "var(--bad-soft)" },
});
const INKS = syntaxHighlighting(HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword], color: "var(--blue-ink)", fontWeight: "600" },
  { tag: [tags.string, tags.docString], color: "var(--good)" },
  { tag: [tags.number, tags.bool, tags.null], color: "var(--warn)" },
  { tag: [tags.comment], color: "var(--quiet)", fontStyle: "italic" },
  { tag: [tags.definition(tags.function(tags.variableName)), tags.className], fontWeight: "600" },
]));

class Editor extends HTMLElement {
  connectedCallback() {
    if (this.view) return;
    const area = /** @type {HTMLTextAreaElement} */ (this.querySelector("textarea"));
    const label = document.querySelector(`label[for="${CSS.escape(area.id)}"]`);
    const root = document.createElement("div");   // a shadow root takes CodeMirror's styles without an inline one
    const shadow = root.attachShadow({ mode: "open" });
    root.className = "editor";
    this.append(root);
    this.view = new EditorView({
      root: shadow, parent: shadow,
      state: EditorState.create({ doc: area.value, extensions: [
        lineNumbers(), highlightActiveLineGutter(), highlightActiveLine(), history(), drawSelection(), indentOnInput(),
        bracketMatching(), highlightSelectionMatches(), search(), lintGutter(), python(), indentUnit.of("    "),
        EditorState.tabSize.of(4), LOOK, INKS,
        keymap.of([{ key: "Escape", run: toggleTabFocusMode }, indentWithTab, ...defaultKeymap, ...historyKeymap, ...searchKeymap, ...lintKeymap]),
        EditorView.contentAttributes.of({ "aria-label": label?.textContent || t("code"), spellcheck: "false", tabindex: "0" }),
        EditorView.updateListener.of(update => {
          if (!update.docChanged) return;
          area.value = update.state.doc.toString();
          area.dispatchEvent(new Event("input", { bubbles: true }));
        }),
      ] }),
    });
    area.hidden = true;
    label?.addEventListener("click", () => this.view.focus());
  }

  disconnectedCallback() {
    this.view?.destroy();
    this.view = null;
  }

  /** @param {{ line: number | null, bad: boolean, text: string }[]} remarks */
  remark(remarks) {
    if (!this.view) return;
    const { doc } = this.view.state;
    const marks = remarks.filter(one => one.line && one.line <= doc.lines).map(one => {
      const line = doc.line(one.line), first = line.from + (line.text.length - line.text.trimStart().length);
      return { from: first, to: Math.max(line.to, first), severity: /** @type {"error" | "warning"} */ (one.bad ? "error" : "warning"), message: one.text };
    });
    this.view.dispatch(setDiagnostics(this.view.state, marks.sort((a, b) => a.from - b.from)));
  }
}
customElements.define("rc-editor", Editor);
